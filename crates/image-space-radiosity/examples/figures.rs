//! The paper's figures 9, 12 and 13 and table 1 on a fixture, as text: what each threshold costs and what it brings.
//!
//!     cargo run --release -p image-space-radiosity --features gpu --example figures -- [FIXTURE] [SIDE]
//!
//! Errors are relative root mean squares against the gather of every texel at every pixel, or against the same with one of
//! the two approximations. Times are those of the CPU, without camera and maps, medians of three.

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use image_space_radiosity::{Bound, Lights, Method, Options, Params, Thresholds, cpu};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, View};
use indirect_scene::{LoadOptions, resolve};
use rsm::{Rsm, Selection};

const RESOLUTION: u32 = 256;
const EXACT: Thresholds = Thresholds { depth: 0.0, normal: 0.0 };

struct Stage {
    rsm: Rsm,
    camera: GBuffer,
    view: View,
}

impl Stage {
    /// A frame and the median time of its passes, milliseconds.
    fn run(
        &self,
        options: &Options,
        params: &Params,
    ) -> Result<(cpu::Output, f64), image_space_radiosity::Error> {
        let run = || cpu::indirect_from(self.rsm.clone(), &self.camera, &self.view, options, params);
        let time = |o: &cpu::Output| o.passes.iter().map(|p| p.ms).sum::<f64>();
        let output = run()?;
        let mut times = [time(&output), time(&run()?), time(&run()?)];
        times.sort_by(f64::total_cmp);
        Ok((output, times[1]))
    }

    /// `√mean((x − ref)²)/mean(ref)` over pixels that see a surface, percent.
    fn error(&self, found: &cpu::Output, expected: &cpu::Output) -> f64 {
        let (mut square, mut mean, mut count) = (0.0, 0.0, 0.0_f64);
        for i in (0..self.camera.len()).filter(|&i| self.camera.is_surface(i)) {
            let (x, r) = (found.image.pixels[i].as_dvec3(), expected.image.pixels[i].as_dvec3());
            square += (x - r).length_squared() / 3.0;
            mean += r.element_sum() / 3.0;
            count += 1.0;
        }
        100.0 * (square / count).sqrt() / (mean / count)
    }
}

fn cut(output: &cpu::Output) -> f64 {
    output.cuts.iter().map(|c| f64::from(*c)).sum::<f64>() / output.cuts.len().max(1) as f64
}

fn pass(output: &cpu::Output, name: &str) -> f64 {
    output.passes.iter().filter(|p| p.name == name).map(|p| p.ms).sum()
}

fn hierarchical(coarsest: u32) -> Lights {
    Lights::Hierarchical { coarsest, finest: RESOLUTION }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "cornell_spot".to_owned());
    let side = arguments.next().map_or(Ok(512), |s| s.parse())?;
    let scene = resolve(&name, &LoadOptions::default())?.scene;
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let view = scene.cameras.first().ok_or("the scene has no camera")?.view([side; 2]);
    let camera = cast::gbuffer(&accel, &view, [side; 2]);
    let maps =
        |resolution| rsm::cpu::generate(&accel, &rsm::Options { resolution, selection: Selection::All });
    let pixels = (0..camera.len()).filter(|i| camera.is_surface(*i)).count();
    let stage = Stage { rsm: maps(RESOLUTION)?, camera, view };

    let every_pixel =
        |lights| Options { resolution: RESOLUTION, lights, method: Method::Gather, coarsest_block: 0 };
    let blocks = |lights| Options { coarsest_block: 6, ..every_pixel(lights) };
    let all = Lights::Flat(Selection::All);
    let flat = Lights::Flat(Selection::Grid { cells: 64 });
    let params = Params { blocks: EXACT, patches: EXACT, tau: 0.0, ..Params::default() };
    let defaults = Params::default().blocks;

    let (truth, _) = stage.run(&every_pixel(all), &params)?;
    let (regular, regular_ms) = stage.run(&every_pixel(flat), &params)?;
    println!("{name}, {side}²: {pixels} pixels, {} texels that reflect", truth.lights.len());
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
            let thresholds = Thresholds { depth, normal: defaults.normal };
            let (o, ms) = stage.run(&blocks(flat), &Params { blocks: thresholds, margin, bend, ..params })?;
            let (n, error) = (o.fragments.nodes.len(), stage.error(&o, &regular));
            println!(
                "{margin:>7} {bend:>7} {depth:>7} {n:>10} {error:>8.2} {ms:>8.1} {:>8.1}",
                regular_ms / ms
            );
        }
    }

    println!("\nFigure 13, light space: cuts against every texel, both at the default blocks");
    let eye = Params { blocks: defaults, ..params };
    let (multi, _) = stage.run(&blocks(all), &eye)?;
    let (o, _) = stage.run(&blocks(hierarchical(16)), &Params::default())?;
    let passes: Vec<String> = o.passes.iter().map(|p| format!("{} {:.1}", p.name, p.ms)).collect();
    println!("passes at the defaults, ms: {}", passes.join(", "));
    println!(
        "{:>13} {:>8} {:>8} {:>8} {:>8} {:>8} {:>12}",
        "bound", "tau", "lights", "RMS %", "ms", "faster", "both RMS %"
    );
    for bound in [Bound::Error, Bound::ContributionAsPrinted] {
        for tau in [1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 0.0] {
            let (o, ms) = stage.run(&blocks(hierarchical(16)), &Params { tau, bound, ..eye })?;
            let bound = if bound == Bound::Error { "error" } else { "contribution" };
            let (used, faster) = (cut(&o), regular_ms / ms);
            let (light, both) = (stage.error(&o, &multi), stage.error(&o, &truth));
            println!("{bound:>13} {tau:>8} {used:>8.0} {light:>8.2} {ms:>8.1} {faster:>8.1} {both:>12.2}");
        }
    }
    for finest in [32, 64, 128, 256] {
        let lights = Lights::Basic { coarsest: 16, finest };
        let (o, ms) = stage.run(&blocks(lights), &Params { patches: Params::default().patches, ..eye })?;
        let (light, both) = (stage.error(&o, &multi), stage.error(&o, &truth));
        let (used, faster) = (o.lights.len(), regular_ms / ms);
        println!("{:>13} {finest:>8} {used:>8} {light:>8.2} {ms:>8.1} {faster:>8.1} {both:>12.2}", "basic");
    }

    println!("\nPareto front over bend, tau and margin: no other setting is faster and more exact");
    println!("{:>7} {:>8} {:>7} {:>8} {:>8} {:>12}", "bend", "tau", "margin", "ms", "faster", "both RMS %");
    let mut tried = Vec::new();
    for bend in [0.1, 0.03, 0.01, 0.003, 0.001] {
        for tau in [0.3, 0.1, 0.03, 0.01, 3e-3] {
            for margin in [0.0, 3.0] {
                let params = Params { blocks: defaults, bend, tau, margin, ..Params::default() };
                let (o, ms) = stage.run(&blocks(hierarchical(16)), &params)?;
                tried.push((ms, stage.error(&o, &truth), bend, tau, margin));
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
        let stage = Stage { rsm: maps(resolution)?, camera: stage.camera.clone(), view: stage.view };
        for tau in [0.1, 0.03, 0.01] {
            let lights = Lights::Hierarchical { coarsest: 1, finest: resolution };
            let (o, _) = stage.run(&Options { resolution, ..blocks(lights) }, &Params { tau, ..eye })?;
            let texels = o.rsm.maps.iter().flat_map(|m| &m.texels);
            let texels = texels.filter(|t| t.reflected.element_sum() > 0.0).count();
            let (used, ms) = (cut(&o), pass(&o, "traverse"));
            let each = ms * 1e6 / (used * o.fragments.nodes.len() as f64);
            println!("{resolution:>10} {tau:>8} {texels:>8} {used:>8.0} {ms:>10.1} {each:>14.2}");
        }
    }

    println!("\nTable 1, 256 lights on the CPU: the pass that brings light to fragments");
    let grid = Lights::Flat(Selection::Grid { cells: 16 });
    let (reference, _) = stage.run(&every_pixel(grid), &params)?;
    let (gather, _) = stage.run(&blocks(grid), &eye)?;
    for (what, method, name) in [
        ("stencil gather", Method::Gather, "gather"),
        ("multiresolution splatting", Method::Splat, "splat"),
        ("bounded splats", Method::BoundedSplat, "splat"),
    ] {
        let (o, _) = stage.run(&Options { method, ..blocks(grid) }, &eye)?;
        let (ms, error) = (pass(&o, name), stage.error(&o, &reference));
        println!("{what:>26} {ms:>9.1} ms {:>7.1}× {error:>8.2} %", ms / pass(&gather, "gather"));
    }
    Ok(())
}
