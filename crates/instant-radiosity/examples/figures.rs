//! The figures of the README: error against the path tracer, cost, temporal behaviour; on the CPU.
//!
//!     cargo run --release -p instant-radiosity --example figures -- [error|limit|cost|bounces|time|flicker|many]… [FILE.glb]
//!
//! Without a word all of them. Errors are relative RMS errors of the luminance over what the camera sees.

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;
use std::time::Instant;

use glam::{Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::settings::Settings as _;
use indirect_core::{GBuffer, Image, LightKind, Scene, View, math::luminance};
use indirect_metrics::{Reference, compare};
use indirect_sampling::sobol;
use indirect_scene::fixtures;
use indirect_technique::cpu::{Fit, run};
use instant_radiosity::cpu::{Frame, Maps, bounce_irsm, bounce_points, bounce_rays};
use instant_radiosity::layout::PointChoice;
use instant_radiosity::{InstantRadiosity, Options, Output, Params, Setup};
use reference_pathtracer::{Bounces, Components, Samples, Settings, render};
use rsm::Vpl;

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

type Part = fn(&Stage<'_>) -> Outcome;

/// A scene, its camera, and what it sees.
struct Stage<'a> {
    accel: Accel<'a>,
    view: View,
    camera: GBuffer,
    seen: Vec<bool>,
}

impl<'a> Stage<'a> {
    fn new(scene: &'a Scene, size: [u32; 2]) -> Self {
        let accel = Accel::build(scene, BuildPreset::Best);
        let view = scene.cameras[0].view(size);
        let camera = cast::gbuffer(&accel, &view, size);
        let seen = (0..camera.len()).map(|i| camera.is_surface(i)).collect();
        Self { accel, view, camera, seen }
    }

    fn truth(&self, bounces: Bounces, samples: u32) -> Outcome<Image> {
        let settings = Settings {
            components: Components::Indirect,
            bounces,
            samples: Samples::count(samples),
            seed: 9,
            ..Settings::default()
        };
        Ok(render(&self.accel, &self.view, self.camera.size, &settings)?.indirect)
    }

    fn setup(&self, pairs: &str) -> Outcome<Setup> {
        let (mut options, mut params) = (Options::default(), Params::default());
        for (key, value) in pairs.split_whitespace().filter_map(|p| p.split_once('=')) {
            if Options::key(key).is_some() { options.set(key, value) } else { params.set(key, value) }?;
        }
        Ok(InstantRadiosity::fit(&self.accel, options, params)?)
    }

    /// The output after so many frames and the median time of one, ms.
    fn frames(&self, setup: &Setup, count: u32) -> (Output, f64) {
        let frame = Frame::new(&self.accel, &self.view, &self.camera, setup);
        let mut output = Output::default();
        let mut times: Vec<f64> = (0..count)
            .map(|_| {
                let start = Instant::now();
                run::<InstantRadiosity>(&frame, &mut output);
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        (output, times[times.len() / 2])
    }

    /// `rel_rmse` and `bias`, %, and FLIP.
    fn judge(&self, image: &Image, truth: &Image) -> Outcome<[f64; 3]> {
        let found = compare(image, &Reference::exact(truth, &self.seen))?;
        Ok([found.luminance.rel_rmse * 100.0, found.luminance.bias * 100.0, found.flip])
    }

    /// Whether a pixel lies within two texels of another surface that touches it: a corner.
    fn corners(&self) -> Vec<bool> {
        let [width, height] = self.camera.size;
        let meets = |i: u32| {
            let (x, y) = (i % width, i / width);
            let (p, n) = (self.camera.position[i as usize], self.camera.normal[i as usize]);
            let near = |qx: u32, qy: u32| {
                let q = (qy * width + qx) as usize;
                let step = self.camera.depth[i as usize] * 0.03;
                self.camera.is_surface(q)
                    && self.camera.normal[q].dot(n) < 0.7
                    && self.camera.position[q].distance(p) < step
            };
            let range = |c: u32, n: u32| c.saturating_sub(2)..(c + 3).min(n);
            range(y, height).any(|qy| range(x, width).any(|qx| near(qx, qy)))
        };
        (0..width * height).map(|i| self.seen[i as usize] && meets(i)).collect()
    }
}

/// Error against the truth by settings, one frame and 32.
fn error(stage: &Stage<'_>) -> Outcome {
    println!(
        "error against all indirect light: settings, rel_rmse % / bias % / FLIP after 1 and 32 frames, ms a frame"
    );
    let truth = stage.truth(Bounces::Infinite, 512)?;
    for pairs in [
        "",
        "vpls=256",
        "vpls=4096",
        "vpls=256 interleave=4",
        "vpls=1024 interleave=4",
        "paths=1",
        "shadow-rays=2",
        "shadow-rays=0",
        "compensate=off",
        "tail=off",
        "bounces=8",
        "bounces=2",
        "sequence=halton",
        "visibility=off",
        "visibility=maps",
        "visibility=maps bounce=points",
        "bounce=points",
        "bounce=brightest",
    ] {
        let setup = stage.setup(pairs)?;
        let (first, _) = stage.frames(&setup, 1);
        let (last, ms) = stage.frames(&setup, 32);
        let [a, b] = [stage.judge(&first.image, &truth)?, stage.judge(&last.image, &truth)?];
        println!(
            "  {:<28} {:>5.1} {:>+5.1} {:.3}   {:>5.1} {:>+5.1} {:.3}   {ms:>6.1}",
            if pairs.is_empty() { "defaults" } else { pairs },
            a[0],
            a[1],
            a[2],
            b[0],
            b[1],
            b[2]
        );
    }
    Ok(())
}

/// The limit of many lights with exact visibility, against the reference of equal bounces: means of frames of 256 lights.
fn limit(stage: &Stage<'_>) -> Outcome {
    println!("towards many lights, two bounces, all asked at every pixel, against the matched reference:");
    println!("  lights, rel_rmse %, bias %, bias % within two texels of an edge");
    let truth = stage.truth(Bounces::Count(2), 8192)?;
    let corners = stage.corners();
    let light_at = |image: &Image, mask: &[bool]| -> f64 {
        image.pixels.iter().zip(mask).filter(|(_, m)| **m).map(|(p, _)| f64::from(luminance(*p))).sum()
    };
    let mut setup = stage.setup("vpls=256 interleave=1 bounces=2 tail=off history=off resolution=512")?;
    let mut sum = Image::new(stage.camera.size);
    let mut points = Vec::new();
    for frames in 1..=256_u32 {
        setup.params.seed = frames;
        let found = stage.frames(&setup, 1).0.image;
        sum.pixels.iter_mut().zip(&found.pixels).for_each(|(s, p)| *s += *p);
        if frames.is_power_of_two() && frames.ilog2() % 2 == 0 {
            let mean =
                Image { size: sum.size, pixels: sum.pixels.iter().map(|p| *p / frames as f32).collect() };
            let [rms, bias, _] = stage.judge(&mean, &truth)?;
            let corner = (light_at(&mean, &corners) / light_at(&truth, &corners) - 1.0) * 100.0;
            println!("  {:>6} {rms:>6.2} {bias:>+6.2} {corner:>+6.2}", 256 * frames);
            points.push((f64::from(frames).ln(), rms.ln()));
        }
    }
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    println!("  exponent {slope:.2}");
    Ok(())
}

/// Tables 5.1 and 5.2: time by lights and by texels of their maps, with and without the past.
fn cost(stage: &Stage<'_>) -> Outcome {
    println!("table 5.1: lights of one bounce, ms without and with the past, gather alone");
    for vpls in [64, 256, 1024] {
        let time = |history: &str| -> Outcome<f64> {
            Ok(stage
                .frames(
                    &stage
                        .setup(&format!("vpls={vpls} bounces=1 visibility=maps compensate=off {history}"))?,
                    9,
                )
                .1)
        };
        let (off, on) = (time("history=off")?, time("history=on")?);
        println!("  {vpls:>5} {off:>7.1} {on:>7.1}   × {:.2}", on / off);
    }
    println!("table 5.2: texels along each side of a light's map, 256 lights");
    for tile in [16, 32, 64, 128] {
        let pairs = format!("bounces=1 visibility=maps compensate=off tile={tile}");
        println!("  {tile:>5} {:>7.1}", stage.frames(&stage.setup(&pairs)?, 9).1);
    }
    println!("interleaving, 1024 lights of one bounce, ms of gather and merge, against interleave=1");
    let mut whole = 0.0;
    for n in [1, 2, 4, 8] {
        let setup = stage.setup(&format!("vpls=1024 bounces=1 interleave={n} shadow-rays=0 history=off"))?;
        let frame = Frame::new(&stage.accel, &stage.view, &stage.camera, &setup);
        let mut times: Vec<f64> = (0..3)
            .map(|_| {
                let passes = run::<InstantRadiosity>(&frame, &mut Output::default());
                passes.iter().filter(|p| ["gather", "merge"].contains(&p.name)).map(|p| p.ms).sum()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        if n == 1 {
            whole = times[1];
        }
        println!("  {n} {:>8.1}   × {:.1}", times[1], whole / times[1]);
    }
    Ok(())
}

/// Table 5.3: time of the bounces alone, without shadow maps, by the thesis's points and by imperfect reflective shadow maps; and what
/// flux they bring.
fn bounces(stage: &Stage<'_>) -> Outcome {
    println!(
        "table 5.3: 256 lights, 65536 points: bounces, ms by IRSM, by points, by rays, IRSM/points; flux of the last bounce in units of rays'"
    );
    let setup = stage.setup("vpls=256 interleave=4 bounces=6 bounce=points visibility=maps tail=off")?;
    let fitted = &setup.fitted;
    let (first, _) = stage.frames(&setup, 1);
    let start = &first.vpls[..256];
    let draws: Vec<Vec2> = (0..256).map(|i| sobol::sample_2d(i, 3)).collect();
    let maps = setup.options.shadow_maps();
    let atlas_of = |vpls: &[Vpl]| imperfect_shadow_maps::cpu::build(vpls, &fitted.points, &maps);
    // 65536 points shared out among 256 lights.
    let choice = PointChoice { each: 256, ..PointChoice::default() };
    let run = |way: usize| -> (Vec<f64>, Vec<f64>) {
        let (mut vpls, mut ms, mut flux) = (start.to_vec(), Vec::new(), Vec::new());
        for bounce in 0..5 {
            let atlas = atlas_of(&vpls);
            let mut times: Vec<(f64, Vec<Vpl>)> = (0..5)
                .map(|_| {
                    let clock = Instant::now();
                    let next = match way {
                        0 => bounce_irsm(fitted, &vpls, &atlas, &draws),
                        1 => bounce_points(
                            &Maps(&atlas),
                            fitted,
                            &vpls,
                            PointChoice { seed: bounce, ..choice },
                        ),
                        _ => bounce_rays(&stage.accel, fitted, &vpls, &draws),
                    };
                    (clock.elapsed().as_secs_f64() * 1e3, next)
                })
                .collect();
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (time, next) = times.swap_remove(2);
            ms.push(ms.last().copied().unwrap_or(0.0) + time);
            flux.push(next.iter().map(|v| f64::from(luminance(v.flux))).sum());
            vpls = next;
        }
        (ms, flux)
    };
    let [irsm, points, rays] = [0, 1, 2].map(run);
    for k in 0..5 {
        println!(
            "  {} {:>7.2} {:>7.2} {:>7.2}   × {:>4.1}   flux {:.2} {:.2}",
            k + 2,
            irsm.0[k],
            points.0[k],
            rays.0[k],
            irsm.0[k] / points.0[k],
            irsm.1[k] / rays.1[k],
            points.1[k] / rays.1[k]
        );
    }
    Ok(())
}

/// Many lights: interleaved against cuts, one frame without history.
fn many(stage: &Stage<'_>) -> Outcome {
    println!(
        "many lights, 3 bounces, one frame: lights of a bounce, gather: rel_rmse % / bias %, ms of a frame; of making lights, tree, gather, paths"
    );
    let truth = stage.truth(Bounces::Infinite, 512)?;
    for gather in ["interleaved", "cuts"] {
        for vpls in [1024, 4096, 16_384, 65_536] {
            let pairs = format!("vpls={vpls} bounces=3 history=off gather={gather}");
            let setup = stage.setup(&pairs)?;
            let frame = Frame::new(&stage.accel, &stage.view, &stage.camera, &setup);
            let mut runs: Vec<_> = (0..3)
                .map(|_| {
                    let (mut output, start) = (Output::default(), Instant::now());
                    let passes = run::<InstantRadiosity>(&frame, &mut output);
                    (start.elapsed().as_secs_f64() * 1e3, passes, output)
                })
                .collect();
            runs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (ms, passes, output) = runs.swap_remove(1);
            let [rms, bias, _] = stage.judge(&output.image, &truth)?;
            let of = |names: &[&str]| -> f64 {
                passes.iter().filter(|p| names.contains(&p.name)).map(|p| p.ms).sum()
            };
            println!(
                "  {vpls:>6} {gather:<12} {rms:>5.1} {bias:>+5.1}   {ms:>7.1}   {:>6.1} {:>6.1} {:>6.1} {:>6.1}",
                of(&["vpls", "emit", "bounce", "summary"]),
                of(&["tree"]),
                of(&["gather"]),
                of(&["compensate"])
            );
        }
    }
    Ok(())
}

/// Behaviour over time: what history gains, and how it follows.
fn time(stage: &Stage<'_>) -> Outcome {
    println!(
        "history: settings, rel_rmse % after 32 frames, frames to 90 % of a step ×2, % left 3 frames after the light went off"
    );
    let truth = stage.truth(Bounces::Infinite, 1024)?;
    let sum = |i: &Image| i.pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
    for pairs in [
        "confidence=0.5",
        "confidence=0.8",
        "confidence=0.9",
        "confidence=0.95",
        "changed=4",
        "changed=10",
        "outliers=2",
        "outliers=2 changed=4",
        "outliers=1.5 changed=4",
        "outliers=0",
    ] {
        let setup = stage.setup(pairs)?;
        let (still, _) = stage.frames(&setup, 32);
        let error = stage.judge(&still.image, &truth)?[0];
        // The same frames with another power of all lights.
        let after = |factor: f32, frames: u32| -> Vec<f64> {
            let mut scene = stage.accel.scene().clone();
            scene.lights.iter_mut().for_each(|l| l.power *= factor);
            let accel = Accel::build(&scene, BuildPreset::Best);
            let frame = Frame::new(&accel, &stage.view, &stage.camera, &setup);
            let mut output = still.clone();
            (0..frames)
                .map(|_| {
                    run::<InstantRadiosity>(&frame, &mut output);
                    sum(&output.image)
                })
                .collect()
        };
        let start = sum(&still.image);
        let steps = after(2.0, 40);
        let lag = steps.iter().position(|s| *s >= 1.9 * start).map_or("> 40".into(), |k| (k + 1).to_string());
        let left = after(0.0, 3)[2] / start * 100.0;
        println!("  {pairs:<22} {error:>6.1} {lag:>6} {left:>6.1}");
    }
    let (reused, _) = stage.frames(&stage.setup("vpls=256")?, 32);
    println!("  256 lights, 32 frames: {:.1} %", stage.judge(&reused.image, &truth)?[0]);
    for vpls in [256, 1024, 4096] {
        let (one, _) = stage.frames(&stage.setup(&format!("vpls={vpls} history=off"))?, 1);
        println!("  {vpls} lights without history: {:.1} %", stage.judge(&one.image, &truth)?[0]);
    }
    Ok(())
}

/// A spot light on a circle: how unevenly pixels change, with and without the past, and how far behind the image is.
fn flicker(stage: &Stage<'_>) -> Outcome {
    const FRAMES: u32 = 48;
    println!(
        "the light moves on a circle of 4 % of the scene in {FRAMES} frames: second difference of a pixel over its mean %, rel_rmse % against"
    );
    println!("  4096 lights of the same frame (mean over frames), by settings");
    let scene = stage.accel.scene();
    let radius = 0.04 * stage.accel.unit();
    let at = |frame: u32| -> Scene {
        let (sin, cos) = (core::f32::consts::TAU * frame as f32 / FRAMES as f32).sin_cos();
        let mut scene = scene.clone();
        for light in &mut scene.lights {
            if let LightKind::Point { position } | LightKind::Spot { position, .. } = &mut light.kind {
                *position += Vec3::new(cos, 0.0, sin) * radius;
            }
        }
        scene
    };
    let stages: Vec<Scene> = (0..FRAMES).map(at).collect();
    let images = |pairs: &str, anew: bool| -> Outcome<Vec<Image>> {
        let mut setup = stage.setup(pairs)?;
        let mut output = Output::default();
        let mut images = Vec::new();
        // The first round settles the past.
        for frame in 0..FRAMES + 16 {
            let scene = &stages[(frame % FRAMES) as usize];
            let accel = Accel::build(scene, BuildPreset::Fast);
            if anew {
                setup.params.seed = frame;
            }
            run::<InstantRadiosity>(&Frame::new(&accel, &stage.view, &stage.camera, &setup), &mut output);
            if frame >= 16 {
                images.push(output.image.clone());
            }
        }
        Ok(images)
    };
    let truth = images("vpls=4096 history=off shadow-rays=16", false)?;
    let light = |i: &Image, k: usize| f64::from(luminance(i.pixels[k]));
    let measure = |images: &[Image]| -> (f64, f64) {
        let (mut second, mut count) = (0.0, 0.0);
        let unit: f64 =
            truth.iter().map(|i| (0..i.pixels.len()).map(|k| light(i, k)).sum::<f64>()).sum::<f64>()
                / (truth.len() * truth[0].pixels.len()) as f64;
        for three in images.windows(3) {
            for k in 0..three[0].pixels.len() {
                second += (light(&three[0], k) - 2.0 * light(&three[1], k) + light(&three[2], k)).abs();
                count += 1.0;
            }
        }
        let squares: f64 = images
            .iter()
            .zip(&truth)
            .map(|(i, t)| (0..t.pixels.len()).map(|k| (light(i, k) - light(t, k)).powi(2)).sum::<f64>())
            .sum();
        let pixels = (images.len() * truth[0].pixels.len()) as f64;
        (second / count / unit * 100.0, (squares / pixels).sqrt() / unit * 100.0)
    };
    for (pairs, anew) in [
        ("vpls=256 interleave=4 history=off", true),
        ("vpls=256 interleave=4 confidence=0.5", false),
        ("vpls=256 interleave=4 confidence=0.8", false),
        ("vpls=256 interleave=4", false),
        ("vpls=256 interleave=4 confidence=0.95", false),
        ("history=off", true),
        ("history=off", false),
        ("", false),
    ] {
        let (second, error) = measure(&images(pairs, anew)?);
        println!(
            "  {:<40} {second:>6.2} {error:>6.1}",
            format!("{pairs}{}", if anew { ", other lights each frame" } else { "" })
        );
    }
    Ok(())
}

fn main() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let wants = |word: &str| !words.iter().any(|w| !w.contains('.')) || words.iter().any(|w| w == word);
    // A glTF file instead of the Cornell box, where one is named.
    let scene = match words.iter().find(|w| w.ends_with(".glb") || w.ends_with(".gltf")) {
        Some(file) => indirect_scene::load(std::path::Path::new(file), &Default::default())?.scene,
        None => fixtures::build("cornell_spot").ok_or("no such fixture")?,
    };
    let aspect = scene.cameras.first().ok_or("the scene has no camera")?.aspect.unwrap_or(1.0);
    let stage = Stage::new(&scene, [192, (192.0 / aspect).round() as u32]);
    let parts: [(&str, Part); 7] = [
        ("error", error),
        ("limit", limit),
        ("cost", cost),
        ("bounces", bounces),
        ("time", time),
        ("flicker", flicker),
        ("many", many),
    ];
    for (word, part) in parts {
        if wants(word) {
            part(&stage)?;
        }
    }
    Ok(())
}
