//! scratch
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example's output")]
use glam::Vec3;
use image_space_radiosity::{Bound, Lights, Method, Options, Params, Thresholds, cpu};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::GBuffer;
use indirect_scene::{LoadOptions, resolve};
use rsm::Selection;

fn rmse(found: &[Vec3], expected: &[Vec3], camera: &GBuffer) -> f64 {
    let (mut square, mut mean, mut count) = (0.0, 0.0, 0.0_f64);
    for i in (0..found.len()).filter(|&i| camera.is_surface(i)) {
        let (x, r) = (found[i].as_dvec3(), expected[i].as_dvec3());
        square += (x - r).length_squared() / 3.0;
        mean += r.element_sum() / 3.0;
        count += 1.0;
    }
    (square / count).sqrt() / (mean / count)
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: u32 = args.get(2).map_or(256, |s| s.parse().unwrap());
    for name in args[1].split(',') {
        let scene = resolve(name, &LoadOptions::default()).unwrap().scene;
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let size = [n, n];
        let view = scene.cameras[0].view(size);
        let camera = cast::gbuffer(&accel, &view, size);
        let surfaces = (0..camera.len()).filter(|&i| camera.is_surface(i)).count();
        println!("== {name} {surfaces} surface pixels");
        let res = 256;
        let rsm =
            rsm::cpu::generate(&accel, &rsm::Options { resolution: res, selection: Selection::All }).unwrap();
        let run = |o: &Options, p: &Params| cpu::indirect_from(rsm.clone(), &camera, &view, o, p).unwrap();
        let ms =
            |o: &cpu::Output| -> f64 { o.passes.iter().filter(|p| p.name != "vpls").map(|p| p.ms).sum() };
        let base = Options {
            resolution: res,
            lights: Lights::Flat(Selection::Grid { cells: 64 }),
            method: Method::Gather,
            coarsest_block: 0,
        };
        let exact = Params { blocks: Thresholds { depth: 0.0, normal: 0.0 }, tau: 0.0, ..Params::default() };
        // flat 4096 at full resolution
        let flat = run(&base, &exact);
        let full = run(&Options { lights: Lights::Flat(Selection::All), ..base }, &exact);
        println!(
            "flat4096 {:.1} ms, vs all {:.4}; all {:.0} ms {} vpls",
            ms(&flat),
            rmse(&flat.image.pixels, &full.image.pixels, &camera),
            ms(&full),
            full.lights.len()
        );
        println!("{:?}", flat.passes);
        println!("-- eye space (flat 4096)");
        for margin in [3.0, 100.0] {
            for depth in [0.1, 0.05, 0.03] {
                let p = Params { blocks: Thresholds { depth, normal: 0.3 }, margin, ..exact };
                let o = run(&Options { coarsest_block: 6, ..base }, &p);
                println!(
                    "margin {margin} depth {depth}: rmse {:.4} fragments {} ({:.1} %), {:.1} ms ({:.1}x)",
                    rmse(&o.image.pixels, &flat.image.pixels, &camera),
                    o.fragments.nodes.len(),
                    100.0 * o.fragments.nodes.len() as f64 / surfaces as f64,
                    ms(&o),
                    ms(&flat) / ms(&o)
                );
                if depth == 0.1 {
                    println!("{:?}", o.passes);
                }
            }
        }
        println!("-- light space (full res eye), vs all texels");
        for bound in [Bound::Error] {
            for coarsest in [1] {
                for tau in [10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3] {
                    let p = Params { tau, bound, ..exact };
                    let o =
                        run(&Options { lights: Lights::Hierarchical { coarsest, finest: 256 }, ..base }, &p);
                    let cut = o.cuts.iter().map(|c| *c as f64).sum::<f64>() / o.cuts.len() as f64;
                    println!(
                        "{bound:?} {coarsest} tau {tau}: rmse {:.4} cut {cut:.0}, {:.1} ms ({:.1}x)",
                        rmse(&o.image.pixels, &full.image.pixels, &camera),
                        ms(&o),
                        ms(&flat) / ms(&o)
                    );
                    if tau == 1e-3 {
                        println!("{:?}", o.passes);
                    }
                }
            }
        }
        println!("-- both");
        for depth in [0.1, 0.05] {
            for tau in [0.3, 0.1, 0.03, 0.01] {
                let p = Params { blocks: Thresholds { depth, normal: 0.3 }, margin: 3.0, tau, ..exact };
                let o = run(
                    &Options {
                        lights: Lights::Hierarchical { coarsest: 1, finest: 256 },
                        coarsest_block: 6,
                        ..base
                    },
                    &p,
                );
                let cut = o.cuts.iter().map(|c| *c as f64).sum::<f64>() / o.cuts.len() as f64;
                println!(
                    "both depth {depth} tau {tau}: rmse {:.4} fragments {} cut {cut:.0}, {:.1} ms ({:.1}x) {:?}",
                    rmse(&o.image.pixels, &full.image.pixels, &camera),
                    o.fragments.nodes.len(),
                    ms(&o),
                    ms(&flat) / ms(&o),
                    o.passes
                );
            }
        }
        for t in [0.5, 0.2, 0.1, 0.05] {
            let p = Params { patches: Thresholds { depth: t, normal: t }, ..exact };
            let o = run(&Options { lights: Lights::Basic { coarsest: 16, finest: 256 }, ..base }, &p);
            println!(
                "basic {t}: rmse {:.4} lights {}, {:.1} ms ({:.1}x)",
                rmse(&o.image.pixels, &full.image.pixels, &camera),
                o.lights.len(),
                ms(&o),
                ms(&flat) / ms(&o)
            );
        }
        for cells in [8, 16, 32] {
            let o = run(&Options { lights: Lights::Flat(Selection::Grid { cells }), ..base }, &exact);
            println!(
                "grid {cells}: rmse {:.4} {:.1} ms",
                rmse(&o.image.pixels, &full.image.pixels, &camera),
                ms(&o)
            );
        }
    }
}
