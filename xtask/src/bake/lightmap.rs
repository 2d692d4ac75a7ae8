//! Light maps over the second set of texture coordinates.

use glam::{Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::Image;
use indirect_scene::exr;
use reference_pathtracer::Settings;
use serde::Serialize;

use super::irradiance::{Made, irradiance};
use crate::cli::BakeArgs;
use crate::failure::{self, Failure, Outcome};
use crate::say;

/// Texels that charts grow by, so that filtering at their borders meets light of their own.
const PADDING: u32 = 4;

#[derive(Debug, Serialize)]
struct About<'a> {
    #[serde(flatten)]
    made: &'a Made,
    format: &'static str,
    size: [u32; 2],
    /// Texels that a surface covers, and those that two surfaces claim.
    covered: usize,
    overlapping: usize,
    unit: &'static str,
    file: &'static str,
}

pub(crate) fn run(
    accel: &Accel<'_>,
    uvs: &[Vec2],
    settings: &Settings,
    args: &BakeArgs,
    made: &Made,
) -> Outcome {
    let mesh = &accel.scene().mesh;
    if uvs.iter().all(|uv| uv.is_nan()) {
        let fix =
            "unwrap the scene into a second UV map where it was modelled, and export that as TEXCOORD_1";
        return Err(Failure::Input(format!(
            "{}: no mesh has a second set of texture coordinates: {fix}",
            args.scene
        )));
    }
    let size = args.size;
    let mut owners = vec![None; size as usize * size as usize];
    let mut overlapping = 0;
    for (triangle, corners) in (0_u32..).zip(&mesh.triangles) {
        let chart = corners.map(|v| uvs[v as usize] * size as f32);
        if chart.iter().any(|c| !c.is_finite()) {
            continue;
        }
        let low = chart[0].min(chart[1]).min(chart[2]).floor().max(Vec2::ZERO);
        let high = chart[0].max(chart[1]).max(chart[2]).ceil().min(Vec2::splat(size as f32));
        for y in low.y as u32..high.y as u32 {
            for x in low.x as u32..high.x as u32 {
                if let Some(weights) = barycentric(chart, Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) {
                    let owner = &mut owners[(y * size + x) as usize];
                    // Neighbours share the texels on their edge.
                    overlapping += usize::from(owner.is_some() && weights.min_element() > 1e-4);
                    *owner = Some((triangle, weights));
                }
            }
        }
    }
    let covered: Vec<_> = (0..owners.len()).filter(|i| owners[*i].is_some()).collect();
    if covered.is_empty() {
        let fix = "a larger --size, or texture coordinates within [0, 1]";
        return Err(Failure::Input(format!("{}: no texel of {size}×{size} is covered: {fix}", args.scene)));
    }
    let receivers: Vec<_> = covered
        .iter()
        .filter_map(|i| owners[*i])
        .map(|(triangle, weights): (u32, Vec3)| {
            let corners = mesh.triangles[triangle as usize];
            let blend = |of: &[Vec3]| (0..3).map(|k| of[corners[k] as usize] * weights[k]).sum::<Vec3>();
            (blend(&mesh.positions), blend(&mesh.normals))
        })
        .collect();
    let (found, noise) = irradiance(accel, &receivers, settings, args.component, "light map")?;
    let mut texels: Vec<Option<Vec3>> = vec![None; owners.len()];
    for (i, e) in covered.iter().zip(found) {
        texels[*i] = Some(e);
    }
    (0..PADDING).for_each(|_| texels = grow(&texels, size as usize));
    let image =
        Image { size: [size; 2], pixels: texels.into_iter().map(Option::unwrap_or_default).collect() };
    let path = args.out.join("lightmap.exr");
    exr::write_rgb(&path, &image).map_err(|e| Failure::Check(e.to_string()))?;
    let about = About {
        made,
        format: "light map over TEXCOORD_1",
        size: [size; 2],
        covered: covered.len(),
        overlapping,
        unit: "irradiance, W/m^2",
        file: "lightmap.exr",
    };
    failure::write_json(&args.out.join("lightmap.json"), &about)?;
    say(format!(
        "{}: {size}×{size} texels, {} covered, noise {:.2} %",
        path.display(),
        covered.len(),
        100.0 * noise
    ));
    if overlapping > 0 {
        say(format!("  {overlapping} texels belong to more than one surface: unwrap without overlaps"));
    }
    Ok(())
}

/// Weights of a triangle's corners at a point inside of it or on its edge.
fn barycentric([a, b, c]: [Vec2; 3], p: Vec2) -> Option<Vec3> {
    let area = (b - a).perp_dot(c - a);
    let v = (p - a).perp_dot(c - a) / area;
    let w = (b - a).perp_dot(p - a) / area;
    let weights = Vec3::new(1.0 - v - w, v, w);
    (weights.is_finite() && weights.min_element() >= 0.0).then_some(weights)
}

/// Charts grown by a texel: the mean of the neighbours that have something.
fn grow(texels: &[Option<Vec3>], size: usize) -> Vec<Option<Vec3>> {
    let near = |i: usize| {
        let (x, y) = (i % size, i / size);
        let (left, right) = (x.saturating_sub(1), (x + 1).min(size - 1));
        let (top, bottom) = (y.saturating_sub(1), (y + 1).min(size - 1));
        let found = (top..=bottom).flat_map(|y| (left..=right).filter_map(move |x| texels[y * size + x]));
        let (sum, count) = found.fold((Vec3::ZERO, 0.0), |(s, n), t| (s + t, n + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    (0..texels.len()).map(|i| texels[i].or_else(|| near(i))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_chart_are_those_of_its_triangle() {
        let chart = [Vec2::new(1.0, 1.0), Vec2::new(9.0, 2.0), Vec2::new(3.0, 8.0)];
        for (p, inside) in [((4.0, 3.0), true), ((1.0, 1.0), true), ((9.0, 8.0), false), ((0.9, 1.0), false)]
        {
            let p = Vec2::from(p);
            let found = barycentric(chart, p);
            assert_eq!(found.is_some(), inside, "{p}");
            if let Some(w) = found {
                let back = chart[0] * w.x + chart[1] * w.y + chart[2] * w.z;
                assert!((back - p).length() < 1e-5);
            }
        }
        assert!(barycentric([Vec2::ZERO; 3], Vec2::ZERO).is_none());
    }

    #[test]
    fn charts_grow_by_what_is_beside_them() {
        let mut texels = vec![None; 16];
        texels[5] = Some(Vec3::ONE);
        texels[6] = Some(Vec3::splat(3.0));
        let grown = grow(&texels, 4);
        assert_eq!(
            (grown[5], grown[1], grown[0], grown[3]),
            (Some(Vec3::ONE), Some(Vec3::splat(2.0)), Some(Vec3::ONE), Some(Vec3::splat(3.0)))
        );
        assert_eq!((grown[12], grown.iter().flatten().count()), (None, 12));
    }
}
