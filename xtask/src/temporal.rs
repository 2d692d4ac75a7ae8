//! `temporal`: how indirect light changes from frame to frame while lights and objects move.

use std::f32::consts::TAU;

use glam::Vec3;
use indirect_accel::cast;
use indirect_core::{Aabb, Camera, Image, LightKind, Mesh, NO_TRIANGLE, Scene, math};
use indirect_gpu::wgpu::Limits;
use serde::Serialize;

use crate::cli::{Moving, TemporalArgs};
use crate::failure::{self, Failure, Outcome};
use crate::gpu::{self, Device, Gpu};
use crate::stage::{Source, Stage};
use crate::technique::{self, Backend, Renderer, Technique, Values};
use crate::{progress, say, setup, warn};

/// What all runs are held against: every texel of the maps is a light, so nothing is drawn and nothing can jump.
const REFERENCE: &str = "rsm-gather resolution=64 select=all";

/// Radius of the circle on which things move, in units of the scene's diagonal.
const RADIUS: f32 = 0.04;

/// Tangent of the cone on which the direction of a distant light moves.
const TILT: f32 = 0.1;

/// A technique with settings: `NAME KEY=VALUE …`.
struct Run {
    text: String,
    technique: Box<dyn Technique>,
    values: Values,
}

impl Run {
    fn parse(text: &str) -> Outcome<Self> {
        let mut words = text.split_whitespace();
        let technique = technique::find(words.next().unwrap_or_default())?;
        let pairs: Vec<_> = words.map(str::to_owned).collect();
        let values = technique.parse(&pairs)?;
        Ok(Self { text: text.to_owned(), technique, values })
    }
}

/// What became of a run. Means over frames and over the pixels that see the same triangle before and after.
#[derive(Debug, Serialize)]
struct Row {
    run: String,
    backend: Backend,
    /// Change of luminance from frame to frame, absolute, in units of the reference's mean.
    change: f64,
    /// `change` in units of the reference's.
    relative_change: f64,
    /// Change that is not the reference's: `|Δx − Δref|` in the same units.
    flicker: f64,
    /// `rel_rmse` against the reference of the same frame: bias, noise and what lags behind.
    rel_rmse: f64,
    /// Median.
    frame_ms: f64,
    /// `change` of every frame but the first.
    frames: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct Temporal {
    scene: String,
    size: [u32; 2],
    frames: u32,
    moving: Vec<Moving>,
    adapter: Option<String>,
    /// First the reference.
    runs: Vec<Row>,
}

/// A run on its way through the frames.
struct Track {
    run: Run,
    backend: Backend,
    renderer: Box<dyn Renderer>,
    images: Vec<Image>,
    ms: Vec<f64>,
}

pub(crate) fn run(args: &TemporalArgs) -> Outcome {
    let texts = match args.runs.as_slice() {
        [] => technique::real_time().iter().map(|t| t.name().to_owned()).collect(),
        runs => runs.to_vec(),
    };
    let texts = std::iter::once(REFERENCE.to_owned()).chain(texts);
    let runs = texts.map(|t| Run::parse(&t)).collect::<Outcome<Vec<_>>>()?;
    let mut source = Source::load(&args.scene)?;
    source.warnings.iter().for_each(warn);
    let camera = source.camera(args.camera.as_deref())?.clone();
    let size = Source::size(&camera, args.width);
    let motion = Motion::new(&source.scene, &camera, &args.moving)
        .map_err(|why| Failure::Input(format!("{}: {why}", args.scene)))?;
    let adapter = if args.cpu_only { None } else { gpu::describe() };
    if adapter.is_none() && !args.cpu_only {
        warn(format!("{}: the frames are rendered on the CPU", setup::NO_ADAPTER));
    }
    let mut device = match adapter {
        Some(_) => {
            let stage = Stage::new(&source, &camera, size, None);
            let mut limits = gpu::with_scene(&Limits::default(), &source.scene);
            for run in &runs {
                limits = gpu::larger(&limits, &run.technique.required_limits(&stage, &run.values)?);
            }
            Some(Device::open(&limits)?)
        }
        None => None,
    };
    let rest = std::mem::take(&mut source.scene);
    let bar = progress::bar(u64::from(args.frames), "frames");
    let (mut tracks, mut pending, mut seen) = (Vec::new(), Some(runs), Vec::new());
    for frame in 0..args.frames {
        source.scene = motion.at(&rest, frame as f32 / args.frames as f32);
        let gpu = device.take().map(|d| Gpu::upload(d, &source.scene)).transpose()?;
        let stage = Stage::new(&source, &camera, size, gpu);
        for run in pending.take().into_iter().flatten() {
            let backend = if stage.gpu.is_some() { Backend::Gpu } else { Backend::Cpu };
            let renderer = run.technique.prepare(&stage, &run.values, 0, backend)?;
            tracks.push(Track { run, backend, renderer, images: Vec::new(), ms: Vec::new() });
        }
        for track in &mut tracks {
            track.ms.push(track.renderer.frame(&stage)?);
            track.images.push(track.renderer.image()?);
        }
        seen.push(cast::gbuffer(&stage.accel, &stage.view, size).triangle);
        device = stage.gpu.map(|g| g.device);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let runs = judge(tracks, &seen);
    print(args, size, &runs);
    let result = Temporal {
        scene: args.scene.clone(),
        size,
        frames: args.frames,
        moving: args.moving.clone(),
        adapter,
        runs,
    };
    args.json.as_ref().map_or(Ok(()), |path| failure::write_json(path, &result))
}

/// Compares all tracks with the first.
fn judge(tracks: Vec<Track>, seen: &[Vec<u32>]) -> Vec<Row> {
    let luminances = |images: &[Image]| -> Vec<Vec<f64>> {
        let of = |i: &Image| i.pixels.iter().map(|p| f64::from(math::luminance(*p))).collect();
        images.iter().map(of).collect()
    };
    let reference = tracks.first().map(|t| luminances(&t.images)).unwrap_or_default();
    let surfaces = |t: &[u32]| t.iter().filter(|t| **t != NO_TRIANGLE).count().max(1);
    let count: usize = seen.iter().map(|s| surfaces(s)).sum();
    let mean = reference.iter().flatten().sum::<f64>() / count as f64;
    let unit = if mean > 0.0 { mean } else { 1.0 };
    let mut results: Vec<Row> = Vec::new();
    for mut track in tracks {
        let x = luminances(&track.images);
        let (mut frames, mut flicker) = (Vec::new(), Vec::new());
        for t in 1..x.len() {
            let stays = |i: &usize| seen[t][*i] != NO_TRIANGLE && seen[t][*i] == seen[t - 1][*i];
            let (mut changes, mut excess, mut pixels) = (0.0, 0.0, 0_usize);
            for i in (0..x[t].len()).filter(stays) {
                let change = x[t][i] - x[t - 1][i];
                changes += change.abs();
                excess += (change - (reference[t][i] - reference[t - 1][i])).abs();
                pixels += 1;
            }
            frames.push(changes / pixels.max(1) as f64 / unit);
            flicker.push(excess / pixels.max(1) as f64 / unit);
        }
        let square = |(a, b): (&f64, &f64)| (a - b) * (a - b);
        let squares: f64 = x.iter().flatten().zip(reference.iter().flatten()).map(square).sum();
        track.ms.sort_by(f64::total_cmp);
        let average = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let change = average(&frames);
        let of_reference = results.first().map_or(change, |r| r.change);
        results.push(Row {
            run: track.run.text,
            backend: track.backend,
            change,
            relative_change: if of_reference > 0.0 { change / of_reference } else { 0.0 },
            flicker: average(&flicker),
            rel_rmse: (squares / count as f64).sqrt() / unit,
            frame_ms: track.ms[(track.ms.len() - 1) / 2],
            frames,
        });
    }
    results
}

fn print(args: &TemporalArgs, size: [u32; 2], runs: &[Row]) {
    let moving: Vec<_> = args.moving.iter().map(|m| m.name()).collect();
    say(format!(
        "{}: {} frames of {}×{}, moving: {}; the first run is the reference",
        args.scene,
        args.frames,
        size[0],
        size[1],
        moving.join(", ")
    ));
    say("  change  × reference   flicker  rel_rmse        ms  run");
    for r in runs {
        say(format!(
            "{:>7.3}% {:>12.2} {:>8.3}% {:>8.2}% {:>9.2}  {} ({})",
            r.change * 100.0,
            r.relative_change,
            r.flicker * 100.0,
            r.rel_rmse * 100.0,
            r.frame_ms,
            r.run,
            r.backend.name()
        ));
    }
}

/// Circles, level for an upright camera, on which lights and one object move.
struct Motion {
    right: Vec3,
    forward: Vec3,
    radius: f32,
    lights: bool,
    /// Vertices of the object.
    vertices: Vec<u32>,
}

impl Motion {
    fn new(scene: &Scene, camera: &Camera, moving: &[Moving]) -> Result<Self, String> {
        let bounds = Aabb::of(scene.mesh.positions.iter().copied()).ok_or("there is no geometry")?;
        let right = camera.forward.cross(camera.up).normalize_or(Vec3::X);
        let forward = camera.up.cross(right).normalize_or(Vec3::Z);
        let lights = moving.contains(&Moving::Light);
        if lights && scene.lights.is_empty() {
            return Err("--move light: there is no punctual light".into());
        }
        let vertices = if moving.contains(&Moving::Object) {
            object(&scene.mesh, &bounds).ok_or(
                "--move object: no part of the mesh that hangs together is smaller than half of the scene",
            )?
        } else {
            Vec::new()
        };
        Ok(Self { right, forward, radius: RADIUS * bounds.diagonal(), lights, vertices })
    }

    /// The scene at a phase of `[0, 1]`.
    fn at(&self, scene: &Scene, phase: f32) -> Scene {
        let (sin, cos) = (TAU * phase).sin_cos();
        let circle = self.right * cos + self.forward * sin;
        let mut scene = scene.clone();
        for light in scene.lights.iter_mut().filter(|_| self.lights) {
            match &mut light.kind {
                LightKind::Point { position } | LightKind::Spot { position, .. } => {
                    *position += circle * self.radius
                }
                LightKind::Directional { direction } => {
                    *direction = (*direction + circle * TILT).normalize_or(*direction);
                }
            }
        }
        for &v in &self.vertices {
            scene.mesh.positions[v as usize] += circle * self.radius;
        }
        scene
    }
}

/// Vertices of the part of a mesh with the largest area among those that hang together by the places of their vertices and
/// are smaller than half of the scene along every axis.
fn object(mesh: &Mesh, bounds: &Aabb) -> Option<Vec<u32>> {
    let mut parents: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn root(parents: &mut [u32], mut v: u32) -> u32 {
        while parents[v as usize] != v {
            parents[v as usize] = parents[parents[v as usize] as usize];
            v = parents[v as usize];
        }
        v
    }
    let mut places = std::collections::HashMap::new();
    for (v, p) in (0..).zip(&mesh.positions) {
        let first = *places.entry(p.to_array().map(f32::to_bits)).or_insert(v);
        parents[v as usize] = first;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| root(&mut parents, v));
        parents[b as usize] = a;
        let c = root(&mut parents, c);
        parents[c as usize] = a;
    }
    let mut areas = std::collections::BTreeMap::new();
    for (t, triangle) in (0..).zip(&mesh.triangles) {
        *areas.entry(root(&mut parents, triangle[0])).or_insert(0.0) += mesh.area(t);
    }
    let parts = (0..parents.len() as u32).map(|v| root(&mut parents, v)).collect::<Vec<_>>();
    let members = |part: u32| (0..).zip(&parts).filter(move |(_, p)| **p == part).map(|(v, _)| v);
    let small = |part: u32| {
        let of = Aabb::of(members(part).map(|v: u32| mesh.positions[v as usize]));
        of.is_some_and(|b| b.extent().cmple(0.5 * bounds.extent()).all())
    };
    // Largest first: few are looked at.
    let mut order: Vec<_> = areas.into_iter().collect();
    order.sort_by(|a, b| f32::total_cmp(&b.1, &a.1));
    order.iter().map(|(part, _)| *part).find(|part| small(*part)).map(|part| members(part).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cornell() -> Scene {
        indirect_scene::fixtures::build("cornell_spot").unwrap()
    }

    #[test]
    fn the_short_block_is_the_object() {
        let scene = cornell();
        let bounds = Aabb::of(scene.mesh.positions.iter().copied()).unwrap();
        let vertices = object(&scene.mesh, &bounds).unwrap();
        // Five faces; its top is at 165 mm.
        assert_eq!(vertices.len(), 20);
        let heights = vertices.iter().map(|v| scene.mesh.positions[*v as usize].y);
        assert_eq!(heights.fold(0.0, f32::max), 0.165);
    }

    #[test]
    fn only_what_is_asked_for_moves() {
        let scene = cornell();
        let moved = |what: &[Moving]| {
            let motion = Motion::new(&scene, &scene.cameras[0], what).unwrap();
            motion.at(&scene, 0.3)
        };
        let light = moved(&[Moving::Light]);
        assert_eq!(light.mesh, scene.mesh);
        assert_ne!(light.lights, scene.lights);
        let object = moved(&[Moving::Object]);
        assert_eq!(object.lights, scene.lights);
        let differing =
            object.mesh.positions.iter().zip(&scene.mesh.positions).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 20);
        assert!(Motion::new(&Scene::default(), &scene.cameras[0], &[Moving::Light]).is_err());
    }
}
