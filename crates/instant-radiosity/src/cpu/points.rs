//! `bounce` among points of the scene: each virtual light lights its own points, one of which becomes the next (thesis §3.6).

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;
use imperfect_shadow_maps::Point;
use indirect_core::{form_factor::bounded, math::luminance};
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;
use rsm::Vpl;

use super::bounce::footprint;
use super::shadow::Shadow;
use crate::layout::PointChoice;
use crate::setup::Fitted;

/// The next bounce of `sources`, one for each; [`Vpl::default`], whose flux is 0, where no point is lit. `shadow` is asked by the number of
/// the source.
///
/// Each of the `M` points of a light stands for `A/M` of the scene's surface and reflects `ρ Φ k A/M`, `k` the bounded kernel. One of them
/// is drawn in proportion to the luminance of that, in one pass (weighted reservoir sampling, Chao 1982), and carries what all of them
/// reflect together: the energy is right in the mean (`docs/errata.md`, thesis §3.6).
#[must_use]
pub fn bounce_points<S: Shadow>(
    shadow: &S,
    fitted: &Fitted,
    sources: &[Vpl],
    choice: PointChoice,
) -> Vec<Vpl> {
    let of = |(j, s): (usize, &Vpl)| among_points(shadow, fitted, sources, (j as u32, s), choice);
    sources.par_iter().enumerate().with_min_len(8).map(of).collect()
}

fn among_points<S: Shadow>(
    shadow: &S,
    fitted: &Fitted,
    sources: &[Vpl],
    (j, source): (u32, &Vpl),
    choice: PointChoice,
) -> Vpl {
    let count = fitted.points.len() as u32;
    if source.flux == Vec3::ZERO || count == 0 {
        return Vpl::default();
    }
    let (each, brightest) = (choice.each.min(count), choice.brightest == 1);
    let first = hash_combine(choice.seed, j) % count;
    let share = count as f32 / each as f32;
    let (mut total, mut most) = (0.0, 0.0);
    let mut chosen = Vpl::default();
    for i in 0..each {
        let point = &fitted.points[((first + i) % count) as usize];
        let Some((reflected, normal)) = lit(source, point, share) else { continue };
        let weight = luminance(reflected);
        let number = unit_f32(hash_combine(first, i ^ choice.seed));
        let mut wins = weight > number * (total + weight);
        if brightest {
            // Only what would be chosen is asked whether it is seen.
            wins = weight > most;
            if !wins {
                continue;
            }
        }
        if !shadow.visible(j, source, point.position, normal) {
            continue;
        }
        // All that is lit counts, whether it is chosen or not.
        total += weight;
        if wins {
            most = weight;
            chosen = Vpl::new(point.position, normal, reflected, 0.0);
        }
    }
    if most <= 0.0 {
        return Vpl::default();
    }
    if !brightest {
        chosen.flux *= total / most;
    }
    chosen.area = footprint(sources, chosen.position, chosen.normal, fitted.area);
    chosen
}

/// What a point reflects of a light, W, for `share` times its own area, and its normal on the side of the light.
fn lit(source: &Vpl, point: &Point, share: f32) -> Option<(Vec3, Vec3)> {
    let v = source.position - point.position;
    let d2 = v.dot(v);
    let normal = if point.normal.dot(v) < 0.0 { -point.normal } else { point.normal };
    let cosines = normal.dot(v) * (-source.normal.dot(v)).max(0.0);
    let kernel = cosines * FRAC_1_PI / (d2 * d2);
    // False for NaN too.
    if !(kernel > 0.0 && kernel < f32::MAX) {
        return None;
    }
    let received = point.area * share * bounded(kernel, source.area);
    (received > 0.0).then_some((source.flux * point.albedo * received, normal))
}
