//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod blocks;
mod clusters;
mod compact;
mod mips;
mod patches;
mod refine;
mod sources;
mod splat;
mod traverse;
mod tree;
mod upsample;

use std::time::Instant;

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{GBuffer, Image, View};
use rsm::cpu::Receivers;
use rsm::{PyramidLayout, Rsm, Vpl};

pub use blocks::Blocks;
pub use clusters::clusters;
pub use compact::{Fragments, compact};
pub use mips::mips;
pub use patches::{Patches, patches};
pub use refine::{Subdivision, refine, stencil};
pub use rsm::cpu::PassTime;
pub use sources::{reference_irradiance, sources, sources_at};
pub use splat::{splat, splat_bounded};
pub use traverse::{Tile, cut, traverse};
pub use tree::{ALWAYS, tree};
pub use upsample::{Irradiance, pull, push};

use crate::{
    Error,
    layout::{Block, Branch, Patch},
    levels::{Links, level_of_cells},
    params::{Lights, Method, Options, Params},
};

/// The indirect light of a frame and everything that was computed on the way. What the options do not ask for is empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
    /// The maps.
    pub rsm: Rsm,
    /// Patches of each map, see [`patches`].
    pub patches: Vec<Vec<Patch>>,
    /// The coarsest of them, see [`sources`].
    pub sources: Vec<Patch>,
    /// See [`reference_irradiance`].
    pub reference: f32,
    /// The traversal's tree: the branches of all maps, one map after the other.
    pub tree: Vec<Branch>,
    /// One light or none per slot, for lights that are a list.
    pub light_slots: Vec<Vpl>,
    /// The lights with flux.
    pub lights: Vec<Vpl>,
    /// Blocks of pixels, see [`mips`].
    pub blocks: Vec<Block>,
    /// Which blocks need subdivision.
    pub needs: Vec<u32>,
    /// What becomes of each block.
    pub states: Vec<u32>,
    /// The valid blocks.
    pub fragments: Fragments,
    /// Irradiance on each fragment, W/m².
    pub gathered: Vec<Vec3>,
    /// Lights in the cut of each tile of fragments.
    pub cuts: Vec<u32>,
    /// Irradiance of pixels and blocks.
    pub irradiance: Irradiance,
    /// Time per pass, in order.
    pub passes: Vec<PassTime>,
}

impl Output {
    /// Bytes that the maps and everything made from them hold.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let fragments =
            self.fragments.points.len() * (2 * size_of::<Vec3>() + 4) + self.fragments.slots.len() * 4;
        let Irradiance { pixels, coarse } = &self.irradiance;
        let vectors = self.gathered.len() + pixels.len() + coarse.len() + self.image.pixels.len();
        self.rsm.bytes()
            + self.patches.iter().map(|p| size_of_val(&p[..])).sum::<usize>()
            + size_of_val(&self.sources[..])
            + size_of_val(&self.tree[..])
            + size_of_val(&self.light_slots[..])
            + size_of_val(&self.lights[..])
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.needs[..])
            + size_of_val(&self.states[..])
            + fragments
            + vectors * size_of::<Vec3>()
            + size_of_val(&self.cuts[..])
    }
}

/// Runs passes and notes their time.
#[derive(Default)]
struct Clock(Vec<PassTime>);

impl Clock {
    fn time<T>(&mut self, name: &'static str, pass: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = pass();
        self.0.push(PassTime { name, ms: start.elapsed().as_secs_f64() * 1e3 });
        result
    }
}

/// One bounce of all lights of the scene at the pixels of `camera`, which is what `view` sees, without indirect visibility.
///
/// # Errors
/// [`Error::BadOption`] where `options` or `params` are out of range.
pub fn indirect(
    accel: &Accel<'_>,
    camera: &GBuffer,
    view: &View,
    options: &Options,
    params: &Params,
) -> Result<Output, Error> {
    options.validate()?;
    params.validate()?;
    let mut clock = Clock::default();
    let rsm = clock.time("rsm", || rsm::cpu::generate(accel, &options.rsm()))?;
    Ok(indirect_of_maps(rsm, camera, view, options, params, clock))
}

/// [`indirect`] from maps that are there already, of `options.resolution`.
///
/// # Errors
/// As there, and [`Error::BadOption`] for maps of another resolution.
pub fn indirect_from(
    rsm: Rsm,
    camera: &GBuffer,
    view: &View,
    options: &Options,
    params: &Params,
) -> Result<Output, Error> {
    options.validate()?;
    params.validate()?;
    if rsm.resolution != options.resolution {
        let (option, value) = ("resolution", options.resolution.to_string());
        return Err(Error::BadOption { option, value, requirement: "that of the maps" });
    }
    Ok(indirect_of_maps(rsm, camera, view, options, params, Clock::default()))
}

fn indirect_of_maps(
    rsm: Rsm,
    camera: &GBuffer,
    view: &View,
    options: &Options,
    params: &Params,
    mut clock: Clock,
) -> Output {
    let light_layout = PyramidLayout::new([options.resolution; 2]);
    let mut out = Output {
        image: Image::new(camera.size),
        rsm,
        patches: Vec::new(),
        sources: Vec::new(),
        reference: 0.0,
        tree: Vec::new(),
        light_slots: Vec::new(),
        lights: Vec::new(),
        blocks: Vec::new(),
        needs: Vec::new(),
        states: Vec::new(),
        fragments: Fragments::default(),
        gathered: Vec::new(),
        cuts: Vec::new(),
        irradiance: Irradiance::default(),
        passes: Vec::new(),
    };
    if camera.is_empty() {
        out.passes = clock.0;
        return out;
    }
    if options.has_patches() {
        out.patches =
            clock.time("patches", || out.rsm.maps.iter().map(|map| patches(map, &light_layout)).collect());
    }
    let maps: Vec<_> = out.rsm.maps.iter().zip(&out.patches).map(|(m, p)| Patches::new(m, p)).collect();
    out.sources = sources(&maps, &light_layout);
    let layout = &PyramidLayout::new(camera.size);
    let coarsest = (options.coarsest_block as usize).min(layout.levels.len() - 1);
    out.blocks = clock.time("mips", || mips(camera, layout));
    let blocks = Blocks::new(camera, &out.blocks);
    out.reference = clock.time("sources", || reference_irradiance(&out.sources, &blocks, layout));
    let range = |coarsest, finest| {
        let level = |cells| level_of_cells(&light_layout, cells);
        [level(coarsest), level(finest)]
    };
    match options.lights {
        Lights::Flat(selection) => {
            let points = selection.points(params.seed);
            out.light_slots = clock.time("vpls", || rsm::cpu::vpls(&out.rsm, selection, &points));
        }
        Lights::Basic { coarsest, finest } => {
            let range = range(coarsest, finest);
            out.light_slots =
                clock.time("clusters", || clusters(&maps, &light_layout, range, &params.patches));
        }
        Lights::Hierarchical { coarsest, finest } => {
            let range = range(coarsest, finest);
            let threshold = params.tau * out.reference;
            out.tree = clock.time("tree", || {
                let links = Links::new([options.resolution; 2], range[1]);
                tree(&maps, &links, range, params.bound, threshold)
            });
        }
    }
    out.lights = rsm::cpu::compact(&out.light_slots);

    if options.method == Method::BoundedSplat {
        // Without light the reference is 0 and there is nothing to cut off.
        let cutoff = (params.cutoff * out.reference).max(f32::MIN_POSITIVE);
        out.irradiance.pixels =
            clock.time("splat", || splat_bounded(&out.lights, camera, view, cutoff, params.form));
    } else {
        (out.needs, out.states) = clock.time("refine", || {
            let bend = params.bend * out.reference;
            let subdivision = Subdivision { thresholds: params.blocks, margin: params.margin, bend };
            let needs = refine(&blocks, layout, coarsest, &subdivision, &out.sources);
            let states = stencil(&blocks, &needs, layout, coarsest);
            (needs, states)
        });
        out.fragments = clock.time("compact", || compact(&blocks, &out.states, layout, coarsest));
        let points = &out.fragments.points;
        (out.gathered, out.cuts) = match (options.method, options.lights) {
            (Method::Splat, _) => {
                (clock.time("splat", || splat(&out.lights, points, params.form)), Vec::new())
            }
            (_, Lights::Hierarchical { .. }) => {
                clock.time("traverse", || traverse(&out.tree, points, params.form))
            }
            _ => clock.time("gather", || {
                let receivers: Receivers = points.iter().copied().collect();
                (rsm::cpu::gather(&out.lights, &receivers, params.form), Vec::new())
            }),
        };
        out.irradiance = clock.time("upsample", || {
            let mut irradiance = pull(&blocks, &out.states, &out.fragments, &out.gathered, layout, coarsest);
            push(&blocks, &out.states, layout, coarsest, &mut irradiance);
            irradiance
        });
    }
    out.image = clock.time("shade", || {
        let pixels: Vec<u32> = (0..camera.len() as u32).collect();
        rsm::cpu::shade(camera, &pixels, &out.irradiance.pixels)
    });
    out.passes = clock.0;
    out
}
