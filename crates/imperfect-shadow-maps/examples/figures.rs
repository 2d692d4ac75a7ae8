//! Errors, times and bytes of imperfect shadow maps on a fixture, as text.
//!
//!     cargo run --release -p imperfect-shadow-maps --example figures -- [FIXTURE]
//!
//! Pairs of VPLs and random surface points that face each other are asked for and compared with a ray. `leak` are those that the
//! ray finds blocked and the map visible, `shade` the reverse, percent of all pairs, mean of four seeds; `points` are the errors of
//! the query without the receiver's normal. Times are those of 256 maps on the CPU, the least of seven, milliseconds.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example's output")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::time::Instant;

use common::{Stage, Wrong};
use imperfect_shadow_maps::{Options, Placement, cpu, place};

const SEEDS: [u32; 4] = [1, 2, 3, 4];

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "cornell_spot".to_owned());
    let scene = indirect_scene::fixtures::build(&name).ok_or("no such fixture")?;
    let stages = SEEDS.map(|seed| Stage::with(&scene, 256, seed));
    let pairs: usize = stages.iter().map(|s| s.pairs.len()).sum();
    let lit: usize = stages.iter().flat_map(|s| &s.pairs).filter(|p| p.visible).count();
    println!(
        "{name}: {} triangles, 256 VPLs, {pairs} pairs, {:.0} % visible",
        scene.mesh.triangles.len(),
        100.0 * lit as f64 / pairs.max(1) as f64
    );
    println!(
        "{:34}{:>7}{:>7}{:>7}{:>9}{:>8}{:>7}{:>7}{:>9}",
        "", "leak", "shade", "sum", "points", "splat", "pull", "push", "KiB"
    );
    let d = Options::default();
    row(&stages, "defaults", d);
    for points_per_map in [256, 512, 1024, 4096, 8192] {
        row(&stages, &format!("points-per-map={points_per_map}"), Options { points_per_map, ..d });
    }
    for tile in [8, 16, 64, 128] {
        row(&stages, &format!("tile={tile}"), Options { tile, ..d });
    }
    for overlap in [0.5, 1.0, 4.0] {
        row(&stages, &format!("overlap={overlap}"), Options { overlap, ..d });
    }
    for bias in [0.0, 0.5, 1.0, 2.0] {
        row(&stages, &format!("bias={bias}"), Options { bias, ..d });
    }
    for overlap in [1.0, 2.0] {
        for pull_push in [1, 2, 3] {
            let label = format!("pull-push={pull_push} overlap={overlap}");
            row(&stages, &label, Options { pull_push, overlap, ..d });
        }
    }
    for overlap in [1.0, 2.0] {
        let label = format!("placement=random overlap={overlap}");
        row(&stages, &label, Options { placement: Placement::Random, overlap, ..d });
    }
    for tile in [16, 32, 64, 256] {
        let o = Options { tile, ..d };
        let atlases: Vec<_> = stages.iter().map(|s| cpu::cast(&s.accel, &s.vpls, &o)).collect();
        let (surface, point) = errors(&stages, &atlases);
        print_errors(&format!("one ray per texel, tile={tile}"), surface, point);
        println!();
    }
    // What the bounds of tests/quality.rs come from.
    let found: Vec<Wrong> = (1..=8).map(|seed| Stage::new(&scene, seed).built(d, seed)).collect();
    let spread = |of: fn(&Wrong) -> f64| {
        let mean = found.iter().map(of).sum::<f64>() / 8.0;
        let square = found.iter().map(|w| (of(w) - mean).powi(2)).sum::<f64>() / 7.0;
        format!("{mean:.2} ± {:.2}", square.sqrt())
    };
    println!("defaults, 8 seeds: leak {}, shade {}", spread(|w| w.leak), spread(|w| w.shade));
    let o = d;
    let clock = Instant::now();
    let points = place(&scene, o.points, &[], o.placement, 1);
    let placed = clock.elapsed();
    let clock = Instant::now();
    let resolved = cpu::resolve(&scene, &points);
    println!(
        "{} points: placed in {:.1} ms, resolved in {:.1} ms, {} KiB",
        resolved.len(),
        1e3 * placed.as_secs_f64(),
        1e3 * clock.elapsed().as_secs_f64(),
        size_of_val(&resolved[..]) / 1024
    );
    let atlas = cpu::build(&stages[0].vpls, &resolved, &o);
    let pairs = &stages[0].pairs;
    let clock = Instant::now();
    let lit = pairs.iter().filter(|p| atlas.visible_surface(p.vpl, p.receiver, p.normal)).count();
    let ns = 1e9 * clock.elapsed().as_secs_f64() / pairs.len() as f64;
    println!("{ns:.1} ns per query of a random pair on one thread ({lit} lit)");
    Ok(())
}

/// Mean errors with and without the receivers' normals.
fn errors(stages: &[Stage<'_>], atlases: &[cpu::Atlas]) -> (Wrong, Wrong) {
    let mean = |all: Vec<Wrong>| {
        let n = all.len() as f64;
        let of = |of: fn(&Wrong) -> f64| all.iter().map(of).sum::<f64>() / n;
        Wrong { leak: of(|w| w.leak), shade: of(|w| w.shade) }
    };
    let each = || stages.iter().zip(atlases);
    let surface = each().map(|(s, a)| s.wrong(a)).collect();
    let point = each().map(|(s, a)| Wrong::of(&s.pairs, |p| a.visible(p.vpl, p.receiver))).collect();
    (mean(surface), mean(point))
}

fn print_errors(label: &str, surface: Wrong, point: Wrong) {
    let sum = surface.sum();
    print!("{label:34}{:7.2}{:7.2}{sum:7.2}{:9.2}", surface.leak, surface.shade, point.sum());
}

fn row(stages: &[Stage<'_>], label: &str, o: Options) {
    let mut atlases = Vec::new();
    let mut least = [f64::INFINITY; 3];
    for (stage, seed) in stages.iter().zip(SEEDS) {
        let points = stage.points(&o, seed);
        let mut atlas = cpu::Atlas::default();
        for _ in 0..7 {
            let mut time = |i: usize, f: &mut dyn FnMut()| {
                let clock = Instant::now();
                f();
                least[i] = least[i].min(1e3 * clock.elapsed().as_secs_f64());
            };
            time(0, &mut || atlas = cpu::splat(&stage.vpls, &points, &o));
            time(1, &mut || cpu::pull(&mut atlas));
            time(2, &mut || cpu::push(&mut atlas));
        }
        atlases.push(atlas);
    }
    let (surface, point) = errors(stages, &atlases);
    print_errors(label, surface, point);
    let [splat, pull, push] = least;
    println!("{splat:8.2}{pull:7.2}{push:7.2}{:9}", atlases[0].bytes() / 1024);
}
