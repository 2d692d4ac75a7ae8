//! The table of `docs/radiance-hints.md`: errors on the Cornell box under a spot light, means over eight seeds, on the CPU.
//!
//!     cargo run --release -p radiance-hints --example accuracy

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::GBuffer;
use indirect_metrics::{Reference, compare};
use indirect_scene::fixtures;
use radiance_hints::{
    Lattice, Options, Order, Params, RadianceHints, Reconstruction, Sampling, Scale, Setup, Surround,
    Visibility,
    cpu::{self, Fit},
};
use reference_pathtracer::{Bounces, Components, Estimate, Samples, Settings, render};

const SIZE: [u32; 2] = [128, 128];
const SEEDS: u32 = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = fixtures::build("cornell_spot").ok_or("no such fixture")?;
    let accel = Accel::build(&scene, BuildPreset::Best);
    let view = scene.cameras[0].view(SIZE);
    let camera: GBuffer = cast::gbuffer(&accel, &view, SIZE);
    let bounds = scene.bounds().ok_or("an empty scene")?;
    let truth = |bounces, unoccluded, samples| {
        let settings = Settings {
            components: Components::Indirect,
            bounces: Bounces::Count(bounces),
            unoccluded,
            samples: Samples::count(samples),
            seed: 9,
            ..Settings::default()
        };
        render(&accel, &view, SIZE, &settings)
    };
    let measure = |what: &str, cells: u32, options: Options, params: Params, truth: &Estimate| {
        // What surrounds the box, where the options ask for it; and cubes of cells, not the scene's proportions.
        let setup = RadianceHints::fit(&accel, options, params)?;
        let mut setup = Setup { lattice: Lattice::new(&bounds, [cells; 3])?, ..setup };
        let reference = Reference::exact(&truth.indirect, &truth.surface);
        let (mut rmse, mut bias, mut worst, mut flip) = (0.0, 0.0, 0.0_f64, 0.0);
        for seed in 1..=SEEDS {
            setup.params.seed = seed;
            let found = cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup))?;
            let found = compare(&found.image, &reference)?;
            let error = found.luminance;
            flip += found.flip / f64::from(SEEDS);
            rmse += error.rel_rmse / f64::from(SEEDS);
            bias += error.bias / f64::from(SEEDS);
            worst = worst.max(error.rel_rmse);
        }
        let bias = 100.0 * bias;
        println!("{what:<36} rel_rmse {rmse:.3} (worst {worst:.3})  bias {bias:+.1} %  FLIP {flip:.3}");
        Ok::<(), Box<dyn Error>>(())
    };

    let params = Params::default();
    let one = Options { bounces: 1, visibility: Visibility::Off, ..Options::default() };
    let matched = truth(1, true, 8192)?;
    for samples in [12, 30, 60, 120, 200, 1000] {
        let options = Options { samples, ..one };
        measure(&format!("16³, order 3, {samples} samples"), 16, options, params, &matched)?;
    }
    for cells in [8, 32] {
        measure(&format!("{cells}³, order 3, 60 samples"), cells, one, params, &matched)?;
    }
    measure("32³, order 3, 1000 samples", 32, Options { samples: 1000, ..one }, params, &matched)?;
    measure("16³, order 2, 60 samples", 16, Options { order: Order::Two, ..one }, params, &matched)?;
    for (what, scale) in [("half resolution", Scale::Half), ("quarter resolution", Scale::Quarter)] {
        measure(what, 16, Options { scale, ..one }, params, &matched)?;
    }
    let lists = Options { sampling: Sampling::Importance, ..one };
    measure("16³, 60 samples, lists alone", 16, lists, params, &matched)?;
    let read = Params { reconstruct: Reconstruction::AsPrinted, ..params };
    measure("16³, lists alone, read as printed", 16, lists, read, &matched)?;
    let printed = Params { footprint: 0.0, jitter: 1.0, ..read };
    measure("16³, 60 samples, all as printed", 16, lists, printed, &matched)?;
    let disc = Options { sampling: Sampling::Disc, ..one };
    measure("the same, disc of 0.9", 16, disc, Params { disc: 0.9, ..printed }, &matched)?;

    let three = Options::default();
    let truth = truth(3, false, 2048)?;
    measure("3 bounces, by depth, enclosed", 16, three, params, &truth)?;
    let alone = Options { enclosure: Surround::Maps, ..three };
    measure("3 bounces, by depth, maps alone", 16, alone, params, &truth)?;
    let open = Options { visibility: Visibility::Off, ..three };
    measure("3 bounces, no visibility, enclosed", 16, open, params, &truth)
}
