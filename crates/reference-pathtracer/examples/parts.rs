//! Computes one reference on many machines: each renders a part of the samples, any one of them joins the files.
//!
//! ```text
//! parts render SCENE K N PART.ref [--spp S] [--size WxH] [--bounces B] [--seed SEED]
//! parts merge OUT.exr|OUT.ref PART.ref... [--image full|direct|indirect]
//! ```
//!
//! `render` takes part `K` of `N`, counted from 0, of `S` samples per pixel (256; rounded up so that the parts are equal). `SCENE` is a
//! fixture's name or a glTF file, seen through its first camera in `W`x`H` pixels (640x360). `B` is the number of indirect
//! bounces or `inf` (the default).
//!
//! `merge` refuses parts of different input and parts given twice, and names the samples that it has, so that a missing part
//! shows. To an `.exr` it writes the radiance; to a `.ref` all sums, so that the result can be merged again.
//!
//! All parts of a reference need the same `N` and options. With a batch scheduler, an array job of 32:
//!
//! ```sh
//! sbatch --array=0-31 --wrap 'parts render hall.glb $SLURM_ARRAY_TASK_ID 32 part$SLURM_ARRAY_TASK_ID.ref --spp 8192'
//! parts merge hall.exr part*.ref                  # afterwards
//! ```
//!
//! In a CI matrix, with an artifact per job and a last job that needs them all:
//!
//! ```yaml
//! strategy: { matrix: { part: [0, 1, 2, 3] } }
//! run: cargo run --release -p reference-pathtracer --example parts -- render atrium ${{ matrix.part }} 4 part${{ matrix.part }}.ref
//! ```
#![allow(clippy::print_stdout, reason = "a command-line tool")]

use std::path::Path;
use std::process::ExitCode;
use std::str::FromStr;

use indirect_accel::{Accel, BuildPreset};
use indirect_scene::{LoadOptions, exr, resolve};
use reference_pathtracer::{Bounces, Error, Estimate, Samples, Settings};

const USAGE: &str =
    "usage: parts render SCENE K N PART.ref [--spp S] [--size WxH] [--bounces B] [--seed SEED]
       parts merge OUT.exr|OUT.ref PART.ref... [--image full|direct|indirect]";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(message) => {
            println!("{message}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<String, String> {
    let (mut words, mut options) = (Vec::new(), Vec::new());
    let mut rest = arguments.iter().map(String::as_str);
    while let Some(word) = rest.next() {
        match word.strip_prefix("--") {
            Some(name) => options.push((name, rest.next().ok_or(format!("--{name} needs a value"))?)),
            None => words.push(word),
        }
    }
    match words[..] {
        ["render", scene, k, n, out] => {
            render(scene, parse("K", k)?, parse("N", n)?, Path::new(out), &options)
        }
        ["merge", out, ref parts @ ..] if !parts.is_empty() => merge(Path::new(out), parts, &options),
        _ => Err(USAGE.to_owned()),
    }
}

fn parse<T: FromStr>(what: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{what}: `{text}` is not a number in range"))
}

/// `spp` samples per pixel, rounded up to as many batches for each of `parts`: at least 8 in all, for the variance, and of
/// a power of two.
fn samples(spp: u32, parts: u32) -> Samples {
    let batch = 1 << (spp / parts.max(8)).max(1).ilog2();
    Samples { batch, first: 0, batches: spp.div_ceil(batch).max(8).next_multiple_of(parts) }
}

fn render(scene: &str, k: u32, n: u32, out: &Path, options: &[(&str, &str)]) -> Result<String, String> {
    let (mut spp, mut size, mut settings) = (256, [640, 360], Settings::default());
    for &(name, value) in options {
        match name {
            "spp" => spp = parse("--spp", value)?,
            "seed" => settings.seed = parse("--seed", value)?,
            "bounces" if value == "inf" => settings.bounces = Bounces::Infinite,
            "bounces" => settings.bounces = Bounces::Count(parse("--bounces", value)?),
            "size" => {
                let (w, h) = value.split_once('x').ok_or(format!("--size: `{value}` is not WxH"))?;
                size = [parse("--size", w)?, parse("--size", h)?];
            }
            _ => return Err(format!("unknown option --{name}\n{USAGE}")),
        }
    }
    if k >= n || n > 1 << 16 || spp > 1 << 24 {
        return Err(format!("part {k} of {n} with {spp} samples: K < N ≤ 2^16 and S ≤ 2^24 are needed"));
    }
    settings.samples = samples(spp, n).part(k, n);
    let loaded = resolve(scene, &LoadOptions::default()).map_err(|e| e.to_string())?;
    loaded.warnings.iter().for_each(|w| eprintln!("{scene}: {w}"));
    let camera = loaded.scene.cameras.first().ok_or(format!("{scene} has no camera"))?;
    let view = camera.view(size);
    let accel = Accel::build(&loaded.scene, BuildPreset::Best);
    let estimate = reference_pathtracer::render(&accel, &view, size, &settings).map_err(|e| e.to_string())?;
    estimate.save(out).map_err(|e| e.to_string())?;
    Ok(format!("{}: {}", out.display(), describe(&estimate)))
}

fn merge(out: &Path, parts: &[&str], options: &[(&str, &str)]) -> Result<String, String> {
    let mut which = "full";
    for &(name, value) in options {
        match name {
            "image" if ["full", "direct", "indirect"].contains(&value) => which = value,
            _ => return Err(format!("unknown option --{name} {value}\n{USAGE}")),
        }
    }
    let load = |part: &str| {
        Estimate::load(Path::new(part)).map_err(|e| match e {
            // It names the file itself.
            Error::Io { .. } => e.to_string(),
            _ => format!("{part}: {e}"),
        })
    };
    let mut all = load(parts[0])?;
    for part in &parts[1..] {
        all = all.merge(&load(part)?).map_err(|e| format!("{part}: {e}"))?;
    }
    if out.extension().is_some_and(|e| e == "ref") {
        all.save(out).map_err(|e| e.to_string())?;
    } else {
        let image = match which {
            "direct" => all.direct.clone(),
            "indirect" => all.indirect.clone(),
            _ => all.full(),
        };
        exr::write_rgb(out, &image).map_err(|e| e.to_string())?;
    }
    Ok(format!("{}: {}", out.display(), describe(&all)))
}

/// The samples, and how sure they are.
fn describe(estimate: &Estimate) -> String {
    let range = |s: &Samples| format!("{}..{}", s.first, s.first + s.batches);
    let ranges: Vec<_> = estimate.samples().iter().map(range).collect();
    let [direct, indirect] = estimate.mean();
    let [_, noise] = estimate.noise();
    format!(
        "{} samples per pixel, batches {}; mean luminance direct {:.5} ± {:.5}, indirect {:.5} ± {:.5}; noise of the indirect image {:.2} %",
        estimate.spp,
        ranges.join(" and "),
        direct.value,
        direct.error,
        indirect.value,
        indirect.error,
        noise * 100.0
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_equal_and_cover_what_was_asked_for() {
        for (spp, parts) in [(256, 1), (256, 4), (100, 7), (1, 3), (0, 1), (1 << 24, 1 << 16)] {
            let all = samples(spp, parts);
            assert!(all.spp() >= u64::from(spp) && all.batches >= parts, "{spp} {parts} {all:?}");
            let shares = (0..parts).map(|k| all.part(k, parts).batches);
            assert!(shares.clone().all(|n| n == all.batches / parts), "{spp} {parts} {all:?}");
        }
    }

    #[test]
    fn parts_render_and_merge() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let call = |line: &str| {
            let word = |w: &str| if w.contains('.') { path(w) } else { w.to_owned() };
            run(&line.split(' ').map(word).collect::<Vec<_>>())
        };
        for k in 0..3 {
            call(&format!("render cornell_area {k} 3 {k}.ref --spp 24 --size 16x12 --bounces 2")).unwrap();
        }
        let message = call("merge a.ref 0.ref 2.ref").unwrap();
        assert!(message.contains("16 samples per pixel, batches 0..4 and 8..12"), "{message}");
        let message = call("merge all.exr a.ref 1.ref --image indirect").unwrap();
        assert!(message.contains("24 samples per pixel, batches 0..12;"), "{message}");
        assert_eq!(exr::read_rgb(Path::new(&path("all.exr"))).unwrap().size, [16, 12]);
        for (line, part) in [
            ("merge b.exr 0.ref 0.ref", "overlap"),
            ("merge b.exr none.ref", "none.ref"),
            ("render cornell_area 3 3 c.ref", "K < N"),
            ("render cornell_area 0 1 c.ref --size 0x4", "image size"),
            ("render cornell 0 1 c.ref", "neither a glTF file"),
            ("render cornell_area x 1 c.ref", "not a number"),
            ("merge b.exr", "usage"),
        ] {
            let error = call(line).unwrap_err();
            assert!(error.contains(part), "{line}: {error}");
        }
    }
}
