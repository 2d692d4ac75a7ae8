use glam::Vec3;
use indirect_core::Image;
#[cfg(feature = "cpu")]
use indirect_filter::cpu::shade;
use indirect_technique::{Row, Technique, passes};
use rsm::Error;
#[cfg(feature = "cpu")]
use rsm::cpu::{Receivers, compact as compact_vpls, gather, vpls};

#[cfg(feature = "cpu")]
use crate::cpu;
#[cfg(feature = "gpu")]
use crate::gpu;
#[cfg(feature = "cpu")]
use crate::levels::{Links, Pyramids};
use crate::output::{ImageSpaceRadiosity, Output, Setup};
use crate::settings::{Lights, Method, Options, Params};

#[cfg(feature = "cpu")]
fn maps(output: &Output) -> Vec<cpu::Patches<'_>> {
    output.rsm.maps.iter().zip(&output.patches).map(|(m, p)| cpu::Patches::new(m, p)).collect()
}

#[cfg(feature = "cpu")]
fn pyramids(frame: &cpu::Frame<'_, Setup>) -> Pyramids {
    Pyramids::new(&frame.setup.options, frame.camera.size)
}

#[cfg(feature = "cpu")]
fn tiles<'a>(frame: &cpu::Frame<'_, Setup>, pyramids: &'a Pyramids) -> cpu::Tiles<'a> {
    cpu::Tiles { layout: &pyramids.texels, level: pyramids.shadow, seed: frame.setup.params.seed }
}

#[cfg(feature = "cpu")]
fn tree(f: &cpu::Frame<'_, Setup>, o: &Output) -> Vec<crate::Branch> {
    let (p, Setup { options, params, .. }) = (pyramids(f), f.setup);
    let split = match options.lights {
        Lights::Flat => return cpu::tree_of_list(&o.lights),
        Lights::Basic => cpu::Split::Flat(params.patches()),
        Lights::Hierarchical => cpu::Split::Far { bound: params.bound, threshold: params.tau * o.reference },
    };
    let tiles = options.has_shadows().then(|| tiles(f, &p));
    cpu::tree(&maps(o), &Links::new(&p.texels, p.range[1]), p.range, split, tiles.as_ref())
}

impl Technique for ImageSpaceRadiosity {
    const NAME: &'static str = "image-space-radiosity";
    const MAP_PASSES: &'static [&'static str] = &rsm::MAP_PASSES;
    type Options = Options;
    type Params = Params;
    type Setup = Setup;
    type Output = Output;
    #[cfg(feature = "gpu")]
    type Sizes = gpu::Sizes;
    #[cfg(not(feature = "gpu"))]
    type Sizes = ();
    #[cfg(feature = "gpu")]
    type Buffers = gpu::Buffers;
    #[cfg(not(feature = "gpu"))]
    type Buffers = ();
    type Error = Error;

    fn options(setup: &Setup) -> &Options {
        &setup.options
    }

    fn rows() -> Vec<Row<Self>> {
        let mut rows = rsm::map_rows!(Self, |s| s.options.has_pyramids().into());
        rows.extend(passes!(
            Self,
            [
                Row {
                    name: "patches",
                    times: |s| s.options.has_patches().into(),
                    cpu: |f, o, _| {
                        let p = pyramids(f);
                        o.patches = o.rsm.maps.iter().map(|map| cpu::patches(map, &p.texels)).collect();
                        o.sources = cpu::sources(&maps(o), p.source_level(), &p.texels);
                    },
                    gpu: |b, pass, _| gpu::patches(b, pass),
                    data: |b, o, x, _| {
                        for part in &b.parts {
                            let maps = o.patches.iter_mut().enumerate().skip(part.maps.start);
                            for (i, (map, patches)) in maps.take(part.maps.len()).enumerate() {
                                x.within(&format!("map {map} "));
                                x.elements("", &part.buffers.patches, i * patches.len(), patches);
                            }
                        }
                        x.within("");
                        x.elements("sources", &b.own.sources, 0, &mut o.sources);
                    },
                },
                Row {
                    name: "mips",
                    times: |_| 1,
                    cpu: |f, o, _| o.blocks = cpu::mips(f.camera, &pyramids(f).pixels),
                    gpu: |b, pass, _| gpu::mips(b, pass),
                    data: |b, o, x, _| x.elements("", &b.own.blocks, 0, &mut o.blocks),
                },
                Row {
                    name: "sources",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let blocks = cpu::Blocks::new(f.camera, &o.blocks);
                        o.reference = cpu::reference_irradiance(&o.sources, &blocks, &pyramids(f).pixels);
                    },
                    gpu: |b, pass, _| gpu::sources(b, pass),
                    data: |b, o, x, _| {
                        let reference = core::slice::from_mut(&mut o.reference);
                        x.floats("reference", &b.own.reference, reference, 1);
                    },
                },
                Row {
                    name: "vpls",
                    times: |s| (s.options.lights == Lights::Flat).into(),
                    cpu: |f, o, _| {
                        let selection = f.setup.options.selection();
                        o.light_slots = vpls(&o.rsm, selection, &selection.points(f.setup.params.seed));
                    },
                    gpu: |b, pass, _| gpu::vpls(b, pass),
                    data: |b, o, x, _| x.elements("", b.light_slots(), 0, &mut o.light_slots),
                },
                Row {
                    name: "clusters",
                    times: |s| s.options.has_clusters().into(),
                    cpu: |f, o, _| {
                        let p = pyramids(f);
                        let thresholds = f.setup.params.patches();
                        o.light_slots = cpu::clusters(&maps(o), &p.texels, p.range, thresholds);
                    },
                    gpu: |b, pass, _| gpu::clusters(b, pass),
                    data: |b, o, x, _| x.elements("", b.light_slots(), 0, &mut o.light_slots),
                },
                Row {
                    name: "lights",
                    times: |s| s.options.has_list().into(),
                    cpu: |_, o, _| o.lights = compact_vpls(&o.light_slots),
                    gpu: |b, pass, _| b.buffers.list.compact(b.pipelines, pass, b.buffers.light_slots()),
                    data: |b, o, x, _| b.list.exchange(&mut o.lights, x),
                },
                Row {
                    name: "tree",
                    times: |s| s.options.has_tree().into(),
                    cpu: |f, o, _| o.tree = tree(f, o),
                    gpu: |b, pass, _| gpu::tree(b, pass),
                    data: |b, o, x, _| {
                        if b.list_traversal().is_some() {
                            x.elements("", &b.own.list_branches, 0, &mut o.tree);
                            return;
                        }
                        let per_map = o.tree.len() / b.rsm.maps.len().max(1);
                        for part in &b.parts {
                            let tree = &mut o.tree[part.maps.start * per_map..part.maps.end * per_map];
                            x.elements("", &part.buffers.branches, 0, tree);
                        }
                    },
                },
                Row {
                    name: "shadows",
                    times: |s| s.options.has_shadows().into(),
                    cpu: |f, o, _| {
                        let (options, points) = (f.setup.options, &f.setup.fitted.points);
                        o.shadow_lights = if options.lights == Lights::Flat {
                            o.lights.clone()
                        } else {
                            let p = pyramids(f);
                            cpu::shadow_lights(&maps(o), &tiles(f, &p))
                        };
                        o.shadows = imperfect_shadow_maps::cpu::build(
                            &o.shadow_lights,
                            points,
                            &options.shadow_maps(),
                        );
                    },
                    gpu: |b, pass, _| gpu::shadows(b, pass),
                    data: |b, o, x, _| {
                        if let Some(atlas) = &b.atlas {
                            x.elements("lights", b.shadow_lights(), 0, &mut o.shadow_lights);
                            atlas.exchange_maps(&mut o.shadows, x);
                        }
                    },
                },
                Row {
                    name: "refine",
                    times: |s| s.options.has_fragments().into(),
                    cpu: |f, o, _| {
                        let (p, params) = (pyramids(f), &f.setup.params);
                        let blocks = cpu::Blocks::new(f.camera, &o.blocks);
                        let bend = params.bend * o.reference;
                        let subdivision =
                            cpu::Subdivision { thresholds: params.blocks(), margin: params.margin, bend };
                        o.needs = cpu::refine(&blocks, &p.pixels, p.block, &subdivision, &o.sources);
                        o.states = cpu::stencil(&blocks, &o.needs, &p.pixels, p.block);
                    },
                    gpu: |b, pass, _| gpu::refine(b, pass),
                    data: |b, o, x, _| {
                        x.words("needs", &b.own.needs, &mut o.needs);
                        x.words("states", &b.own.states, &mut o.states);
                    },
                },
                Row {
                    name: "compact",
                    times: |s| s.options.has_fragments().into(),
                    cpu: |f, o, _| {
                        let (p, blocks) = (pyramids(f), cpu::Blocks::new(f.camera, &o.blocks));
                        o.fragments = cpu::compact(&blocks, &o.states, &p.pixels, p.block);
                    },
                    gpu: |b, pass, _| gpu::compact(b, pass),
                    data: |b, o, x, _| {
                        let f = &mut o.fragments;
                        x.length(&b.own.totals, 0, &mut f.nodes);
                        f.positions.resize(f.nodes.len(), Vec3::ZERO);
                        f.normals.resize(f.nodes.len(), Vec3::ZERO);
                        x.words("nodes", &b.own.fragment_nodes, &mut f.nodes);
                        let valid = |i: usize| o.states[i] == crate::layout::state::VALID;
                        x.words_where("slots", &b.own.slots, &mut f.slots, valid);
                        x.vectors("positions", &b.own.fragment_positions, 0, &mut f.positions);
                        x.vectors("normals", &b.own.fragment_normals, 0, &mut f.normals);
                    },
                },
                Row {
                    name: "gather",
                    times: |s| (s.options.method == Method::Gather && !s.options.has_tree()).into(),
                    cpu: |f, o, _| {
                        let points =
                            o.fragments.positions.iter().copied().zip(o.fragments.normals.iter().copied());
                        let receivers: Receivers = points.collect();
                        o.gathered = gather(&o.lights, &receivers, f.setup.params.form);
                    },
                    gpu: |b, pass, _| gpu::gather(b, pass),
                    data: |b, o, x, _| x.vectors("irradiance", &b.own.gathered, 0, &mut o.gathered),
                },
                Row {
                    name: "traverse",
                    times: |s| s.options.has_tree().into(),
                    cpu: |f, o, _| {
                        let (positions, normals) = (&o.fragments.positions, &o.fragments.normals);
                        let form = f.setup.params.form;
                        (o.gathered, o.cuts) = if f.setup.options.has_shadows() {
                            let visible = |light: u32, i: usize| {
                                cpu::light_visible(&o.shadows, light, positions[i], normals[i])
                            };
                            cpu::traverse_visible(&o.tree, positions, normals, form, visible)
                        } else {
                            cpu::traverse(&o.tree, positions, normals, form)
                        };
                    },
                    gpu: |b, pass, _| gpu::traverse(b, pass),
                    data: |b, o, x, _| {
                        if b.atlas.is_some() {
                            // Fragments that lie at the border of a texel of one of the shadow maps.
                            let found = x.read(&b.own.gathered, 0, o.gathered.len());
                            x.same(Some(gpu::same_answers(&o.gathered, &found)));
                        }
                        x.vectors("irradiance", &b.own.gathered, 0, &mut o.gathered);
                        x.same(None);
                        x.words("cuts", &b.own.cuts, &mut o.cuts);
                    },
                },
                Row {
                    name: "splat",
                    times: |s| (s.options.method != Method::Gather).into(),
                    cpu: |f, o, _| {
                        let Params { cutoff, form, .. } = f.setup.params;
                        if f.setup.options.has_fragments() {
                            let (positions, normals) = (&o.fragments.positions, &o.fragments.normals);
                            o.gathered = cpu::splat(&o.lights, positions, normals, form);
                        } else {
                            // Without light the reference is 0 and there is nothing to cut off.
                            let cutoff = (cutoff * o.reference).max(f32::MIN_POSITIVE);
                            o.irradiance.pixels =
                                cpu::splat_bounded(&o.lights, f.camera, f.view, cutoff, form);
                        }
                    },
                    gpu: |b, pass, _| gpu::splat(b, pass),
                    data: |b, o, x, _| {
                        // One of the two is empty.
                        x.vectors("fragments", &b.own.gathered, 0, &mut o.gathered);
                        x.vectors("pixels", &b.own.irradiance, 0, &mut o.irradiance.pixels);
                    },
                },
                Row {
                    name: "upsample",
                    times: |s| s.options.has_fragments().into(),
                    cpu: |f, o, _| {
                        let (p, blocks) = (pyramids(f), cpu::Blocks::new(f.camera, &o.blocks));
                        o.irradiance =
                            cpu::pull(&blocks, &o.states, &o.fragments, &o.gathered, &p.pixels, p.block);
                    },
                    gpu: |b, pass, _| gpu::pull(b, pass),
                    data: |b, o, x, _| {
                        x.vectors("pulled pixels", &b.own.irradiance, 0, &mut o.irradiance.pixels);
                        x.vectors("pulled blocks", &b.own.coarse_irradiance, 0, &mut o.irradiance.coarse);
                    },
                },
                Row {
                    name: "upsample",
                    times: |s| s.options.has_fragments().into(),
                    cpu: |f, o, _| {
                        let (p, blocks) = (pyramids(f), cpu::Blocks::new(f.camera, &o.blocks));
                        cpu::push(&blocks, &o.states, &p.pixels, p.block, &mut o.irradiance);
                    },
                    gpu: |b, pass, _| gpu::push(b, pass),
                    data: |b, o, x, _| {
                        x.vectors("pixels", &b.own.irradiance, 0, &mut o.irradiance.pixels);
                        x.vectors("blocks", &b.own.coarse_irradiance, 0, &mut o.irradiance.coarse);
                    },
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| o.image = shade(f.camera, &o.irradiance.pixels),
                    gpu: |b, pass, _| gpu::shade(b, pass),
                    data: |b, o, x, _| x.image("image", &b.own.image, &mut o.image),
                },
            ]
        ));
        rows
    }

    fn image(output: &Output) -> &Image {
        &output.image
    }

    fn output_bytes(o: &Output) -> u64 {
        let vectors = o.fragments.positions.len()
            + o.fragments.normals.len()
            + o.gathered.len()
            + o.irradiance.pixels.len()
            + o.irradiance.coarse.len()
            + o.image.pixels.len();
        let words =
            o.needs.len() + o.states.len() + o.fragments.nodes.len() + o.fragments.slots.len() + o.cuts.len();
        #[cfg(feature = "cpu")]
        let shadows = o.shadows.bytes();
        #[cfg(not(feature = "cpu"))]
        let shadows = 0;
        let bytes = o.rsm.bytes()
            + o.patches.iter().map(|p| size_of_val(&p[..])).sum::<usize>()
            + size_of_val(&o.sources[..])
            + size_of_val(&o.blocks[..])
            + size_of_val(&o.tree[..])
            + size_of_val(&o.light_slots[..])
            + size_of_val(&o.lights[..])
            + size_of_val(&o.shadow_lights[..])
            + shadows
            + vectors * size_of::<Vec3>()
            + words * size_of::<u32>();
        bytes as u64
    }
}
