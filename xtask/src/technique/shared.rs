//! What the techniques that start from reflective shadow maps tell the harness alike.

use std::fmt::Display;
use std::time::Instant;

use glam::Vec3;
use indirect_core::{GBuffer, Image, SceneProfile};
use indirect_gpu::wgpu::Buffer;
use indirect_gpu::{Context, PassTimer, Vec3Pad};

use super::{Data, Notes, Pass, Twin};
use crate::failure::{Failure, Outcome};
use crate::stage::Stage;

/// Which lights and materials of a scene reach the maps.
pub(super) fn light_notes(profile: &SceneProfile) -> Notes {
    let mut notes = Notes::default();
    let maps = [
        (profile.directional_lights, "directional", "one orthographic map each"),
        (profile.spot_lights, "spot", "one perspective map each, five beyond 60°"),
        (profile.point_lights, "point", "six cube faces each"),
    ];
    for (count, kind, how) in maps.into_iter().filter(|(count, ..)| *count > 0) {
        notes.modelled.push(format!("first bounce of {count} {kind} light{}: {how}", plural(count)));
    }
    if profile.punctual_lights() == 0 {
        notes.skipped.push(
            "EVERYTHING: there is no punctual light, and emissive surfaces have no shadow map: the indirect light \
             is black"
                .into(),
        );
    } else if profile.emissive_triangles > 0 {
        notes.skipped.push(format!(
            "indirect light of {} emissive triangle{}: a shadow map needs a punctual light",
            profile.emissive_triangles,
            plural(profile.emissive_triangles)
        ));
    }
    if profile.textured {
        notes.modelled.push("textured albedo, at camera and at light texels".into());
    }
    if profile.alpha_masked {
        notes.modelled.push("alpha masks, in camera and light views".into());
    }
    if profile.glossy_triangles > 0 {
        notes.skipped.push(format!(
            "gloss of {} triangle{}: all surfaces reflect diffusely",
            profile.glossy_triangles,
            plural(profile.glossy_triangles)
        ));
    }
    notes
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// The most maps that a scene may need: a point light has six; a wide spot light may have five.
pub(super) fn most_maps(profile: &SceneProfile) -> u64 {
    (profile.directional_lights + 6 * (profile.spot_lights + profile.point_lights)) as u64
}

/// Bytes of the largest buffer of maps of this resolution: a pyramid, a third larger than its map.
pub(super) fn largest_rsm_buffer(resolution: u32) -> u64 {
    u64::from(resolution).pow(2) * size_of::<rsm::layout::Node>() as u64 * 4 / 3
}

/// Bytes of a buffer of four numbers per pixel.
pub(super) fn image_buffer(size: [u32; 2]) -> u64 {
    u64::from(size[0]) * u64::from(size[1]) * 16
}

pub(super) fn failure(stage: &Stage<'_>, technique: &str, error: &dyn Display) -> Failure {
    Failure::Input(format!("{}: {technique}: {error}", stage.file))
}

pub(super) fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Bytes of a G-buffer on the CPU: triangle and depth, position, normal, albedo.
pub(super) fn camera_bytes(camera: &GBuffer) -> usize {
    camera.len() * (4 + 4 + 3 * 12)
}

/// What the camera sees, from both backends.
pub(super) fn camera_twins(cpu: &GBuffer, gpu: &GBuffer) -> Vec<Twin> {
    let same: Vec<bool> = cpu.triangle.iter().zip(&gpu.triangle).map(|(c, g)| c == g).collect();
    let vectors = |v: &[Vec3]| Data::Floats(v.iter().flat_map(|v| v.to_array()).collect(), 3);
    let twin = |buffer: &str, cpu, gpu| Twin {
        pass: "camera".into(),
        buffer: buffer.into(),
        cpu,
        gpu,
        same_triangle: Some(same.clone()),
    };
    vec![
        twin("depth", Data::Floats(cpu.depth.clone(), 1), Data::Floats(gpu.depth.clone(), 1)),
        twin("position", vectors(&cpu.position), vectors(&gpu.position)),
        twin("normal", vectors(&cpu.normal), vectors(&gpu.normal)),
        twin("albedo", vectors(&cpu.albedo), vectors(&gpu.albedo)),
    ]
}

/// The buffers of the reflective shadow maps and what follows from them.
pub(super) fn rsm_twins(found: &[rsm::gpu::Twin]) -> Vec<Twin> {
    // The triangles of a map tell which of its texels are silhouettes.
    let triangles = |map: Option<usize>| {
        found.iter().find_map(|t| match (&t.cpu, &t.gpu) {
            (rsm::gpu::Data::U32(c), rsm::gpu::Data::U32(g)) if t.pass == "surface" && t.map == map => {
                Some(c.iter().zip(g).map(|(c, g)| c == g).collect::<Vec<_>>())
            }
            _ => None,
        })
    };
    let data = |d: &rsm::gpu::Data| match d {
        rsm::gpu::Data::F32 { values, components } => Data::Floats(values.clone(), *components),
        rsm::gpu::Data::U32(values) => Data::Ints(values.clone()),
    };
    let compared = found.iter().filter(|t| !(t.pass == "surface" && t.buffer == "triangle"));
    compared
        .map(|t| {
            let map = t.map.map_or_else(String::new, |m| format!("map {m} "));
            Twin {
                pass: t.pass.to_owned(),
                buffer: format!("{map}{}", t.buffer),
                cpu: data(&t.cpu),
                gpu: data(&t.gpu),
                same_triangle: if t.pass == "surface" { triangles(t.map) } else { None },
            }
        })
        .collect()
}

/// An image that the GPU holds row by row.
pub(super) fn read_image(context: &Context, buffer: &Buffer, size: [u32; 2]) -> Outcome<Image> {
    let image =
        context.read::<Vec3Pad>(buffer).map_err(|e| Failure::Check(format!("{}: {e}", context.info.name)))?;
    Ok(Image { size, pixels: image.iter().map(|v| v.vec3()).collect() })
}

/// The camera's passes as one, then the technique's; passes of the same name, one for each map, together.
pub(super) fn passes(stage: &Stage<'_>, mut camera: PassTimer, mut rest: PassTimer) -> Outcome<Vec<Pass>> {
    let finish =
        |timer: &mut PassTimer| timer.finish().map_err(|e| Failure::Check(format!("{}: {e}", stage.file)));
    let camera_ms = finish(&mut camera)?.iter().map(|p| p.ms).sum();
    let mut passes = vec![Pass { name: "camera".into(), ms: camera_ms }];
    for p in finish(&mut rest)? {
        match passes.iter_mut().find(|q| q.name == p.name) {
            Some(q) => q.ms += p.ms,
            None => passes.push(Pass { name: p.name, ms: p.ms }),
        }
    }
    Ok(passes)
}
