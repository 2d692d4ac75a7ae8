//! The form factors of `indirect_core` against the exact polygon and brute force.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use glam::{DVec3, Vec3};
use indirect_core::form_factor::{
    PATCH_FAR, point_to_disc, point_to_parallelogram, point_to_patch, point_to_point, point_to_polygon,
};
use indirect_core::math::orthonormal_basis;
use sh_math::gauss_legendre;

use super::random::Random;

/// The square `centre ± s ± t` in the order that makes it emit to the side `s × t` points to.
fn square(centre: Vec3, s: Vec3, t: Vec3) -> [Vec3; 4] {
    [centre - s - t, centre + s - t, centre + s + t, centre - s + t]
}

/// Halvings of a side: a receiver 1e-4 sides off the square's plane needs 2⁻¹⁶.
const DEPTH: u32 = 18;

/// `∫ cosθ_i cosθ_j / (π d²) dA` over the square by brute force: cells are halved until they are small against their
/// distance (nine times along the horizon), then summed by a 4×4 Gauss rule that respects the horizon point by point.
fn brute_force(n: DVec3, centre: DVec3, s: DVec3, t: DVec3, depth: u32) -> f64 {
    let diagonal = (s + t).length().max((s - t).length());
    if n.dot(centre) + n.dot(s).abs() + n.dot(t).abs() <= 0.0 {
        return 0.0;
    }
    let crosses = n.dot(centre) - n.dot(s).abs() - n.dot(t).abs() < 0.0;
    if depth > 0 && (2.0 * diagonal > centre.length() || (crosses && depth > DEPTH - 9)) {
        let (s, t) = (0.5 * s, 0.5 * t);
        return [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
            .into_iter()
            .map(|(a, b)| brute_force(n, centre + a * s + b * t, s, t, depth - 1))
            .sum();
    }
    let m = s.cross(t);
    let mut sum = 0.0;
    for i in 0..16 {
        let ((x, wx), (y, wy)) = (gauss_legendre(4, i % 4), gauss_legendre(4, i / 4));
        let v = centre + s * x + t * y;
        let d2 = v.length_squared();
        sum += wx * wy * (n.dot(v).max(0.0) * (-m.dot(v)).max(0.0)) / (PI * d2 * d2);
    }
    sum
}

pub(super) fn parallel_squares(page: &mut String) {
    line!(page, "\n## Form factors: a unit square parallel to the receiver\n");
    line!(
        page,
        "Relative error of each form of `indirect_core::form_factor` against the exact polygon. The square's sides lie along the offset and"
    );
    line!(
        page,
        "as `patch` assumes them: its 5 % are a claim about such squares alone. `parallelogram`, which is told the sides, keeps them at any"
    );
    line!(page, "spin and azimuth (tested, `known_sides_stay_within_5_percent_at_any_spin`).\n");
    line!(
        page,
        "| distance | offset | exact | point | disc | patch | parallelogram |\n|---|---|---|---|---|---|---|"
    );
    let (s, t) = orthonormal_basis(Vec3::NEG_Y);
    for d in [0.01_f32, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0] {
        for offset in [0.0, 0.5, 1.0] {
            let c = Vec3::Y * d + s * offset;
            let exact = point_to_polygon(Vec3::ZERO, Vec3::Y, &square(c, 0.5 * s, 0.5 * t));
            let error = |f: f32| 100.0 * (f / exact - 1.0);
            line!(
                page,
                "| {d} | {offset} | {exact:.5} | {:+.1} % | {:+.1} % | {:+.2} % | {:+.4} % |",
                error(point_to_point(Vec3::ZERO, Vec3::Y, c, Vec3::NEG_Y, 1.0)),
                error(point_to_disc(Vec3::ZERO, Vec3::Y, c, Vec3::NEG_Y, 1.0)),
                error(point_to_patch(Vec3::ZERO, Vec3::Y, c, Vec3::NEG_Y, 1.0)),
                error(point_to_parallelogram(Vec3::ZERO, Vec3::Y, c, 0.5 * s, 0.5 * t))
            );
        }
    }
}

pub(super) fn all_poses(page: &mut String) {
    const POSES: usize = 20_000;
    const BRUTE: usize = 200;
    line!(page, "\n## Form factors: all poses\n");
    line!(
        page,
        "{POSES} poses of a unit square at each distance of its centre: both normals, the direction and the square's spin uniform."
    );
    line!(
        page,
        "`bias` is the sum's error (the energy), `rms` is in units of the mean factor, `95 %` is the relative error that 95 % of the"
    );
    line!(
        page,
        "poses with more than a tenth of the mean factor do not exceed. `patch` assumes a spin of its own: what remains of its"
    );
    line!(
        page,
        "error within {PATCH_FAR} sides is that guess. `brute force` is the largest deviation of the exact polygon from adaptive quadrature"
    );
    line!(page, "over {BRUTE} of the poses.\n");
    line!(
        page,
        "| distance | brute force | point: bias | rms | 95 % | disc: bias | rms | 95 % | patch: bias | rms | 95 % | parallelogram: bias | rms | 95 % |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for distance in [0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0, 3.0, 4.0, 10.0, 30.0, 100.0] {
        let mut random = Random(4);
        let mut deviation = 0.0_f64;
        let mut cases = Vec::with_capacity(POSES);
        for k in 0..POSES {
            let (c, n, m) =
                (random.direction() * distance, random.direction().as_vec3(), random.direction().as_vec3());
            let (c, spin) = (c.as_vec3(), (TAU * random.next()) as f32);
            let (a, b) = orthonormal_basis(m);
            let (s, t) = (0.5 * (a * spin.cos() + b * spin.sin()), 0.5 * (b * spin.cos() - a * spin.sin()));
            let exact = f64::from(point_to_polygon(Vec3::ZERO, n, &square(c, s, t)));
            if k < BRUTE {
                let sum = if m.dot(c) < 0.0 {
                    brute_force(n.as_dvec3(), c.as_dvec3(), s.as_dvec3(), t.as_dvec3(), DEPTH)
                } else {
                    0.0
                };
                deviation = deviation.max((exact - sum).abs());
            }
            let forms = [
                point_to_point(Vec3::ZERO, n, c, m, 1.0),
                point_to_disc(Vec3::ZERO, n, c, m, 1.0),
                point_to_patch(Vec3::ZERO, n, c, m, 1.0),
                point_to_parallelogram(Vec3::ZERO, n, c, s, t),
            ];
            cases.push((exact, forms.map(f64::from)));
        }
        let mean = cases.iter().map(|c| c.0).sum::<f64>() / POSES as f64;
        let mut row = format!("| {distance} | {deviation:.0e} |");
        for form in 0..4 {
            let bias = cases.iter().map(|(e, f)| f[form] - e).sum::<f64>() / POSES as f64 / mean;
            let rms =
                (cases.iter().map(|(e, f)| (f[form] - e).powi(2)).sum::<f64>() / POSES as f64).sqrt() / mean;
            let mut relative: Vec<f64> = cases
                .iter()
                .filter(|(e, _)| *e > 0.1 * mean)
                .map(|(e, f)| (f[form] / e - 1.0).abs())
                .collect();
            relative.sort_by(f64::total_cmp);
            let p95 = relative[relative.len() * 95 / 100];
            let _ = write!(row, " {:+.3} % | {:.2} % | {:.2} % |", 100.0 * bias, 100.0 * rms, 100.0 * p95);
        }
        line!(page, "{row}");
    }
    line!(
        page,
        "\nWhich to use: `point_to_parallelogram` where a patch may come near and its sides are known, `point_to_patch` where they are not (the"
    );
    line!(
        page,
        "energy is right, a single pose is not; both cost about two to three discs), the point beyond {PATCH_FAR} sides. The disc bounds the"
    );
    line!(
        page,
        "singularity but takes energy away, up to three quarters of it close by. `rsm` and `image-space-radiosity` use it because their patches"
    );
    line!(
        page,
        "are texels of a map, or groups of them, far smaller than their distance, where all forms agree; what comes nearer than its own size"
    );
    line!(page, "stays bounded and is too dark.");
}
