//! The paper's figures 9, 12 and 13 and table 1 on a fixture, as text: what each threshold costs and what it brings.
//!
//!     cargo run --release -p image-space-radiosity --features gpu --example figures -- [FIXTURE] [SIDE] [visibility]
//!
//! Errors are relative root mean squares against the gather of every texel at every pixel, or against the same with one of
//! the two approximations; of visibility, which can be had alone, against the path tracer. Times are those of the CPU, without camera and maps, medians of three.

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use image_space_radiosity::{
    Bound, ImageSpaceRadiosity, Lights, Method, Options, Output, Params, Select, Setup, Visibility,
    cpu::Frame,
};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, Image, PassTime, View};
use indirect_scene::{LoadOptions, resolve};
use indirect_technique::cpu::{Fit, run_without};
use reference_pathtracer::{Bounces, Components, Samples, Settings, render};
use rsm::{MAP_PASSES, Rsm};

const RESOLUTION: u32 = 256;

struct Stage<'a> {
    accel: &'a Accel<'a>,
    rsm: Rsm,
    camera: GBuffer,
    view: View,
}

/// A frame and the times of its passes, of one of three runs the one of the median.
struct Run {
    output: Output,
    passes: Vec<PassTime>,
    ms: f64,
}

impl Run {
    fn pass(&self, name: &str) -> f64 {
        self.passes.iter().filter(|p| p.name == name).map(|p| p.ms).sum::<f64>() + 0.0
    }

    /// Lights per fragment.
    fn cut(&self) -> f64 {
        let cuts = &self.output.cuts;
        cuts.iter().map(|c| f64::from(*c)).sum::<f64>() / cuts.len().max(1) as f64
    }

    fn fragments(&self) -> usize {
        self.output.fragments.nodes.len()
    }
}

impl Stage<'_> {
    /// A frame without the maps.
    fn run(&self, options: Options, params: Params) -> Run {
        self.run_with(&Setup { options, params, ..Setup::default() })
    }

    fn run_with(&self, setup: &Setup) -> Run {
        let frame = Frame::new(self.accel, &self.view, &self.camera, setup);
        let run = || {
            let mut output = Output { rsm: self.rsm.clone(), ..Output::default() };
            let passes =
                run_without::<ImageSpaceRadiosity>(&frame, &mut output, |pass| MAP_PASSES.contains(&pass));
            Run { ms: passes.iter().map(|p| p.ms).sum(), output, passes }
        };
        let mut runs = [run(), run(), run()];
        runs.sort_by(|a, b| a.ms.total_cmp(&b.ms));
        let [_, median, _] = runs;
        median
    }

    /// `√mean((x − ref)²)/mean(ref)` over pixels that see a surface, percent.
    fn error(&self, found: &Run, expected: &Run) -> f64 {
        self.error_of(found, &expected.output.image)
    }

    fn error_of(&self, found: &Run, expected: &Image) -> f64 {
        let (mut square, mut mean, mut count) = (0.0, 0.0, 0.0_f64);
        for i in (0..self.camera.len()).filter(|&i| self.camera.is_surface(i)) {
            let (x, r) = (found.output.image.pixels[i].as_dvec3(), expected.pixels[i].as_dvec3());
            square += (x - r).length_squared() / 3.0;
            mean += r.element_sum() / 3.0;
            count += 1.0;
        }
        100.0 * (square / count).sqrt() / (mean / count)
    }
}

/// What shadow maps cost and bring, against one bounce with visibility of the path tracer at 1024 samples per pixel.
fn visibility(stage: &Stage<'_>) -> Result<(), Box<dyn Error>> {
    let settings = Settings {
        components: Components::Indirect,
        bounces: Bounces::Count(1),
        samples: Samples::count(1024),
        ..Settings::default()
    };
    let truth = render(stage.accel, &stage.view, stage.camera.size, &settings)?;
    let noise = 100.0 * truth.noise()[1];
    println!("\nVisibility, against one bounce of the path tracer, whose own noise is {noise:.1} %");
    let truth = truth.indirect;
    println!(
        "{:>13} {:>10} {:>12} {:>5} {:>8} {:>8} {:>8} {:>11} {:>12}",
        "lights", "visibility", "shadow-cells", "tile", "RMS %", "mean %", "ms", "shadows ms", "traverse ms"
    );
    let off = Options::default();
    let on = Options { visibility: Visibility::Maps, ..off };
    let small = Options { tile: 32, points_per_map: 2048, ..on };
    let cells = |shadow_cells| Options { shadow_cells, ..on };
    let basic = |options| Options { lights: Lights::Basic, ..options };
    for options in [off, small, cells(4), cells(8), on, cells(32), basic(off), basic(on)] {
        let setup = ImageSpaceRadiosity::fit(stage.accel, options, Params::default())?;
        let run = stage.run_with(&setup);
        let mean = |image: &Image| f64::from(image.mean().element_sum());
        let off = 100.0 * (mean(&run.output.image) / mean(&truth) - 1.0);
        let (word, cells, tile) = (options.visibility.word(), options.shadow_cells, options.tile);
        let (rms, ms, lights) = (stage.error_of(&run, &truth), run.ms, options.lights.word());
        let [shadows, gather] = ["shadows", "traverse"].map(|pass| run.pass(pass));
        println!(
            "{lights:>13} {word:>10} {cells:>12} {tile:>5} {rms:>8.1} {off:>+8.1} {ms:>8.1} {shadows:>11.1} {gather:>12.1}"
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "cornell_spot".to_owned());
    let side = arguments.next().map_or(Ok(512), |s| s.parse())?;
    let scene = resolve(&name, &LoadOptions::default())?.scene;
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let view = scene.cameras.first().ok_or("the scene has no camera")?.view([side; 2]);
    let camera = cast::gbuffer(&accel, &view, [side; 2]);
    let pixels = (0..camera.len()).filter(|i| camera.is_surface(*i)).count();
    let stage = Stage { accel: &accel, rsm: rsm::cpu::generate(&accel, RESOLUTION)?, camera, view };
    if std::env::args().nth(3).as_deref() == Some("visibility") {
        return visibility(&stage);
    }

    let blocks = |lights| Options { lights, ..Options::default() };
    let cells = |cells| Options { cells, ..blocks(Lights::Flat) };
    let all = Options { select: Select::All, ..blocks(Lights::Flat) };
    let every_pixel = |options| Options { block: 0, ..options };
    let hierarchical = blocks(Lights::Hierarchical);
    // Blocks and patches at their thresholds, or at none.
    let defaults = Params::default();
    let eye = Params { patch_depth: 0.0, patch_normal: 0.0, tau: 0.0, ..defaults };
    let params = Params { depth: 0.0, normal: 0.0, ..eye };

    let truth = stage.run(every_pixel(all), params);
    let regular = stage.run(every_pixel(cells(64)), params);
    let regular_ms = regular.ms;
    println!("{name}, {side}²: {pixels} pixels, {} texels that reflect", truth.output.lights.len());
    println!(
        "flat gather of 64² cells at every pixel: {regular_ms:.0} ms, {:.1} % from that of every texel",
        stage.error(&regular, &truth)
    );

    println!("\nFigure 9, eye space: blocks of up to 64² pixels against every pixel, 64² cells of light");
    println!(
        "{:>7} {:>7} {:>7} {:>10} {:>8} {:>8} {:>8}",
        "margin", "bend", "depth", "fragments", "RMS %", "ms", "faster"
    );
    for (margin, bend) in
        [(0.0, 1e9), (3.0, 1e9), (3.0, 0.1), (3.0, 0.03), (3.0, 0.01), (3.0, 0.003), (0.0, 0.01)]
    {
        for depth in [0.0, 0.02, 0.05, 0.1, 0.4] {
            let run = stage.run(cells(64), Params { depth, margin, bend, ..eye });
            let (n, ms, error) = (run.fragments(), run.ms, stage.error(&run, &regular));
            println!(
                "{margin:>7} {bend:>7} {depth:>7} {n:>10} {error:>8.2} {ms:>8.1} {:>8.1}",
                regular_ms / ms
            );
        }
    }

    println!("\nFigure 13, light space: cuts against every texel, both at the default blocks");
    let multi = stage.run(all, eye);
    let run = stage.run(hierarchical, defaults);
    let passes: Vec<String> = run.passes.iter().map(|p| format!("{} {:.1}", p.name, p.ms)).collect();
    println!("passes at the defaults, ms: {}", passes.join(", "));
    println!(
        "{:>13} {:>8} {:>8} {:>8} {:>8} {:>8} {:>12}",
        "bound", "tau", "lights", "RMS %", "ms", "faster", "both RMS %"
    );
    for &bound in Bound::ALL {
        for tau in [1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 0.0] {
            let run = stage.run(hierarchical, Params { tau, bound, ..eye });
            let (bound, ms, used, faster) = (bound.word(), run.ms, run.cut(), regular_ms / run.ms);
            let (light, both) = (stage.error(&run, &multi), stage.error(&run, &truth));
            println!("{bound:>13} {tau:>8} {used:>8.0} {light:>8.2} {ms:>8.1} {faster:>8.1} {both:>12.2}");
        }
    }
    for finest in [32, 64, 128, 256] {
        let run = stage.run(Options { finest, ..blocks(Lights::Basic) }, defaults);
        let (light, both) = (stage.error(&run, &multi), stage.error(&run, &truth));
        let (used, ms, faster) = (run.output.lights.len(), run.ms, regular_ms / run.ms);
        println!("{:>13} {finest:>8} {used:>8} {light:>8.2} {ms:>8.1} {faster:>8.1} {both:>12.2}", "basic");
    }

    println!("\nPareto front over bend, tau and margin: no other setting is faster and more exact");
    println!("{:>7} {:>8} {:>7} {:>8} {:>8} {:>12}", "bend", "tau", "margin", "ms", "faster", "both RMS %");
    let mut tried = Vec::new();
    for bend in [0.1, 0.03, 0.01, 0.003, 0.001] {
        for tau in [0.3, 0.1, 0.03, 0.01, 3e-3] {
            for margin in [0.0, 3.0] {
                let run = stage.run(hierarchical, Params { bend, tau, margin, ..defaults });
                tried.push((run.ms, stage.error(&run, &truth), bend, tau, margin));
            }
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    for (ms, error, bend, tau, margin) in tried {
        if error < least {
            least = error;
            println!("{bend:>7} {tau:>8} {margin:>7} {ms:>8.1} {:>8.1} {error:>12.2}", regular_ms / ms);
        }
    }

    println!("\nFigure 12, cost of a cut against the map's resolution, default blocks");
    println!(
        "{:>10} {:>8} {:>8} {:>8} {:>10} {:>14}",
        "resolution", "tau", "texels", "lights", "cut ms", "ns per light"
    );
    for resolution in [32, 64, 128, 256] {
        let rsm = rsm::cpu::generate(&accel, resolution)?;
        let stage = Stage { rsm, camera: stage.camera.clone(), ..stage };
        for tau in [0.1, 0.03, 0.01] {
            let run = stage.run(Options { resolution, coarsest: 1, ..hierarchical }, Params { tau, ..eye });
            let texels = run.output.rsm.maps.iter().flat_map(|m| &m.texels);
            let texels = texels.filter(|t| t.reflected.element_sum() > 0.0).count();
            let (used, ms) = (run.cut(), run.pass("traverse"));
            let each = ms * 1e6 / (used * run.fragments() as f64);
            println!("{resolution:>10} {tau:>8} {texels:>8} {used:>8.0} {ms:>10.1} {each:>14.2}");
        }
    }

    visibility(&stage)?;

    println!("\nTable 1, 256 lights on the CPU: the pass that brings light to fragments");
    let reference = stage.run(every_pixel(cells(16)), params);
    let gather = stage.run(cells(16), eye);
    for (what, method, name) in [
        ("stencil gather", Method::Gather, "gather"),
        ("multiresolution splatting", Method::Splat, "splat"),
        ("bounded splats", Method::BoundedSplat, "splat"),
    ] {
        let run = stage.run(Options { method, ..cells(16) }, eye);
        let (ms, error) = (run.pass(name), stage.error(&run, &reference));
        println!("{what:>26} {ms:>9.1} ms {:>7.1}× {error:>8.2} %", ms / gather.pass("gather"));
    }
    Ok(())
}
