//! What becomes of the photons of each fixture, and how long they take, as text.
//!
//!     cargo run --release -p photon-tracing --example figures
//!
//! 65 536 photons and eight reflections: photons stored for each emitted, and where the flux goes, percent of its luminance; `flies` is left after
//! the last reflection. Times are the least of seven on all cores, milliseconds.

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;
use std::time::Instant;

use glam::DVec3;
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::luminance;
use photon_tracing::cpu::{emit, photon_map};
use photon_tracing::{Params, Sources};

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "{:20}{:>8}{:>10}{:>9}{:>7}{:>8}{:>8}",
        "", "stored", "absorbed", "escapes", "flies", "emit", "all"
    );
    for name in indirect_scene::fixtures::NAMES {
        let scene = indirect_scene::fixtures::build(name).ok_or("no such fixture")?;
        let accel = Accel::build(&scene, BuildPreset::Best);
        let (sources, params) = (Sources::new(&scene), Params::default());
        let (stored, tally) = photon_map(&accel, &sources, &params, 8);
        let light = |flux: DVec3| f64::from(luminance(flux.as_vec3()));
        let percent = |flux| 100.0 * light(flux) / light(tally.emitted.flux);
        println!(
            "{name:20}{:>8.2}{:>10.1}{:>9.1}{:>7.2}{:>8.1}{:>8.1}",
            stored.len() as f64 / f64::from(params.photons),
            percent(tally.absorbed.flux),
            percent(tally.escaped.flux),
            percent(tally.flying.flux),
            least(|| drop(emit(&sources, &params))),
            least(|| drop(photon_map(&accel, &sources, &params, 8))),
        );
    }
    Ok(())
}

/// Least time of seven runs, milliseconds.
fn least(run: impl Fn()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        run();
        1e3 * start.elapsed().as_secs_f64()
    };
    (0..7).map(time).fold(f64::INFINITY, f64::min)
}
