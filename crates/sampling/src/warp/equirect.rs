//! Environment images, drawn from by solid angle.

use core::f32::consts::TAU;

use alloc::vec::Vec;

use glam::{Vec2, Vec3};

use super::{Empty, Pyramid, WarpError};
use crate::math::{atan2, cos64, sin_cos, sqrt};

/// A direction and its density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionSample {
    /// Unit vector.
    pub direction: Vec3,
    /// The texel that it falls into.
    pub texel: [u32; 2],
    /// Density per steradian.
    pub density: f32,
}

/// Directions of an equirectangular image in proportion to its radiance: the light that a sky sends from each texel, radiance times solid
/// angle, is the texel's probability, and within a texel all solid angle is equally likely.
///
/// Row 0 is around +Y. The middle of a row looks along −Z, as a camera of glTF does, and its right half towards +X: the direction at `(u, v)` of
/// the unit square is `(sin φ sin θ, cos θ, −cos φ sin θ)` with `φ = 2π(u − ½)`, `θ = πv`.
///
/// ```
/// use glam::{Vec2, Vec3};
/// use indirect_sampling::warp::Equirect;
///
/// // A dark sky with one bright texel, above the horizon straight ahead.
/// let mut sky = vec![0.1; 64 * 32];
/// sky[8 * 64 + 32] = 1000.0;
/// let sky = Equirect::new([64, 32], &sky)?;
/// let sample = sky.sample(Vec2::new(0.3, 0.6));
/// assert_eq!(sample.texel, [32, 8]);
/// assert!(sample.direction.dot(Vec3::new(0.0, 1.0, -1.0).normalize()) > 0.99);
/// // Half of nothing is behind: the density there is that of the dark sky.
/// assert!(sample.density > 1e3 * sky.density(Vec3::Z));
/// # Ok::<(), indirect_sampling::warp::WarpError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Equirect {
    pyramid: Pyramid,
    /// Cosines of the borders between rows, one more than there are rows.
    borders: Vec<f32>,
}

impl Equirect {
    /// From the luminance of each texel, row by row. What is negative, infinite or not a number counts as 0; an image of zeros is drawn from
    /// uniformly over the sphere.
    ///
    /// # Errors
    /// [`WarpError::Size`], [`WarpError::Length`].
    pub fn new(size: [u32; 2], radiance: &[f32]) -> Result<Self, WarpError> {
        let [width, height] = size;
        let borders: Vec<f32> = (0..=height)
            .map(|row| cos64(core::f64::consts::PI * f64::from(row) / f64::from(height.max(1))) as f32)
            .collect();
        let dark = !radiance.iter().any(|l| l.is_finite() && *l > 0.0);
        let weigh = |(i, l): (usize, &f32)| {
            let row = i / width.max(1) as usize;
            let band = borders.get(row).zip(borders.get(row + 1)).map_or(0.0, |(top, bottom)| top - bottom);
            if dark { band } else { l * band }
        };
        let importance: Vec<f32> = radiance.iter().enumerate().map(weigh).collect();
        Ok(Self { pyramid: Pyramid::build(size, &importance)?, borders })
    }

    /// Width and height, texels.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.pyramid.size()
    }

    /// Solid angle of each texel of row `row`, sr; 0 beyond the last.
    #[must_use]
    pub fn solid_angle(&self, row: u32) -> f32 {
        let at = |i: u32| self.borders.get(i as usize).copied();
        let band = at(row).zip(at(row + 1)).map_or(0.0, |(top, bottom)| top - bottom);
        band * TAU / self.size()[0] as f32
    }

    /// A direction from a uniform point of the unit square.
    #[must_use]
    pub fn sample(&self, u: Vec2) -> DirectionSample {
        let Ok(warp) = self.pyramid.warp(Empty::Uniform) else {
            // The pyramid was built, so that it has a warp.
            return DirectionSample { direction: Vec3::Y, texel: [0, 0], density: 0.0 };
        };
        let s = warp.sample(u);
        let [column, row] = s.texel;
        // Solid angle grows with the cosine, not with the angle.
        let (top, bottom) = (self.borders[row as usize], self.borders[row as usize + 1]);
        let cos = top + (bottom - top) * (s.point.y - row as f32);
        let sin = sqrt(((1.0 - cos) * (1.0 + cos)).max(0.0));
        let phi = TAU * (s.point.x / self.size()[0] as f32 - 0.5);
        let (x, z) = sin_cos(phi);
        let direction = Vec3::new(x * sin, cos, -z * sin);
        DirectionSample { direction, texel: [column, row], density: s.pdf / self.solid_angle(row) }
    }

    /// The texel that a direction of any length falls into; that of +Y for none.
    #[must_use]
    pub fn texel(&self, direction: Vec3) -> [u32; 2] {
        let [width, height] = self.size();
        let cos = direction.y / direction.length();
        let column = ((atan2(direction.x, -direction.z) / TAU + 0.5) * width as f32) as u32;
        // Borders fall from 1 to −1.
        let row = self.borders.partition_point(|border| *border > cos).saturating_sub(1) as u32;
        [column.min(width - 1), row.min(height - 1)]
    }

    /// Density per steradian with which [`Self::sample`] yields a direction of any length.
    #[must_use]
    pub fn density(&self, direction: Vec3) -> f32 {
        let [column, row] = self.texel(direction);
        let Ok(warp) = self.pyramid.warp(Empty::Uniform) else { return 0.0 };
        warp.pdf(Vec2::new(column as f32 + 0.5, row as f32 + 0.5)) / self.solid_angle(row)
    }
}

#[cfg(test)]
mod tests {
    use core::f32::consts::PI;

    use super::*;
    use crate::sobol;

    fn skies() -> Vec<Equirect> {
        let noise = |i: u32| crate::rng::unit_f32(crate::rng::pcg_hash(i));
        let sky = |size: [u32; 2], f: &dyn Fn(u32) -> f32| {
            let radiance: Vec<f32> = (0..size[0] * size[1]).map(f).collect();
            Equirect::new(size, &radiance).unwrap()
        };
        vec![
            sky([1, 1], &|_| 2.0),
            sky([64, 32], &|_| 0.7),
            sky([33, 17], &|i| noise(i) * noise(i + 7)),
            sky([16, 9], &|i| if i == 40 { 1e4 } else { 0.0 }),
            sky([8, 8], &|_| 0.0),
            sky([8, 8], &|i| [f32::NAN, -1.0, f32::INFINITY, 1.0][i as usize % 4]),
        ]
    }

    #[test]
    fn densities_are_those_of_the_samples_and_integrate_to_one() {
        for sky in skies() {
            let [width, height] = sky.size();
            let mut sphere = 0.0;
            let mut mass = 0.0;
            for row in 0..height {
                for column in 0..width {
                    let phi = TAU * ((column as f32 + 0.5) / width as f32 - 0.5);
                    let cos = 0.5 * (sky.borders[row as usize] + sky.borders[row as usize + 1]);
                    let sin = sqrt(1.0 - cos * cos);
                    let (x, z) = sin_cos(phi);
                    let d = Vec3::new(x * sin, cos, -z * sin) * 3.0;
                    assert_eq!(sky.texel(d), [column, row]);
                    sphere += f64::from(sky.solid_angle(row));
                    mass += f64::from(sky.density(d) * sky.solid_angle(row));
                }
            }
            // f32 sums of up to 2048 texels.
            assert!(
                (sphere - f64::from(4.0 * PI)).abs() < 1e-4 && (mass - 1.0).abs() < 1e-4,
                "{sphere} {mass}"
            );
            for i in 0..4096 {
                let s = sky.sample(sobol::sample_2d(i, 5));
                assert!((s.direction.length() - 1.0).abs() < 1e-6 && s.density > 0.0);
                let (found, near) = (sky.density(s.direction), sky.texel(s.direction));
                // A direction on a border may round into the neighbour.
                assert!(near != s.texel || (found - s.density).abs() <= 1e-4 * s.density, "{s:?} {found}");
            }
        }
    }

    #[test]
    fn texels_are_drawn_as_often_as_they_send_light() {
        for sky in skies() {
            let [width, height] = sky.size();
            let n = 1 << 16;
            let mut counts = vec![0_u32; (width * height) as usize];
            // Cosines within texels: uniform solid angle has the mean of a texel's borders.
            let mut off_centre = 0.0;
            for i in 0..n {
                let s = sky.sample(sobol::sample_2d(i, 9));
                let [column, row] = s.texel;
                counts[(row * width + column) as usize] += 1;
                let (top, bottom) = (sky.borders[row as usize], sky.borders[row as usize + 1]);
                off_centre += f64::from((s.direction.y - bottom) / (top - bottom) - 0.5);
            }
            // Uniform numbers of [0, 1) have the deviation √(1/12); stratified points do better than 4 of it.
            assert!(off_centre.abs() / f64::from(n) < 4.0 * (1.0 / 12.0_f64).sqrt() / f64::from(n).sqrt());
            for row in 0..height {
                for column in 0..width {
                    let i = (row * width + column) as usize;
                    let [x, y] = [column as f32 + 0.5, row as f32 + 0.5];
                    let warp = sky.pyramid.warp(Empty::Uniform).unwrap();
                    let expected = f64::from(warp.pdf(Vec2::new(x, y))) * f64::from(n);
                    // Four standard deviations of a count, and one.
                    let most = 4.0 * expected.sqrt() + 1.0;
                    assert!(
                        (f64::from(counts[i]) - expected).abs() <= most,
                        "{i}: {} for {expected}",
                        counts[i]
                    );
                }
            }
        }
    }

    #[test]
    fn the_middle_looks_ahead_and_the_right_half_to_the_right() {
        let sky = Equirect::new([8, 4], &[1.0; 32]).unwrap();
        assert_eq!(sky.texel(Vec3::Y)[1], 0);
        assert_eq!(sky.texel(Vec3::NEG_Y)[1], 3);
        assert_eq!(sky.texel(Vec3::new(0.1, 0.1, -1.0)), [4, 1]);
        assert_eq!(sky.texel(Vec3::new(1.0, -0.1, -0.1)), [5, 2]);
        assert_eq!(sky.texel(Vec3::new(-0.1, 0.1, 1.0))[0], 0);
        assert!(sky.texel(Vec3::ZERO)[0] < 8);
        assert!(matches!(Equirect::new([0, 4], &[]), Err(WarpError::Size(_))));
        assert!(matches!(Equirect::new([2, 2], &[1.0; 3]), Err(WarpError::Length { expected: 4, found: 3 })));
    }

    #[test]
    fn a_sun_has_less_variance_than_directions_drawn_uniformly() {
        let mut radiance = vec![1.0_f32; 64 * 32];
        radiance[10 * 64 + 20] = 1e4;
        let sky = Equirect::new([64, 32], &radiance).unwrap();
        let value = |d: Vec3| {
            let [column, row] = sky.texel(d);
            radiance[(row * 64 + column) as usize]
        };
        // ∫ L max(0, y) dω by both, 1024 points each; the truth texel by texel.
        let truth: f64 = (0..64 * 32_u32)
            .map(|i| {
                let (top, bottom) = (sky.borders[(i / 64) as usize], sky.borders[(i / 64) as usize + 1]);
                let cos = f64::from((0.5 * (top + bottom)).max(0.0));
                f64::from(radiance[i as usize]) * cos * f64::from(sky.solid_angle(i / 64))
            })
            .sum();
        let squared = |sample: &dyn Fn(Vec2) -> f64| {
            let estimate = |seed| (0..64).map(|i| sample(sobol::sample_2d(i, seed))).sum::<f64>() / 64.0;
            (0..64).map(|seed| (estimate(seed) - truth).powi(2)).sum::<f64>() / 64.0
        };
        let drawn = squared(&|u| {
            let s = sky.sample(u);
            f64::from(value(s.direction) * s.direction.y.max(0.0) / s.density)
        });
        let uniform = squared(&|u| {
            let d = crate::mapping::sphere_uniform(u);
            f64::from(value(d) * d.y.max(0.0) * 4.0 * PI)
        });
        assert!(drawn < 0.01 * uniform && drawn.sqrt() < 0.02 * truth, "{drawn} {uniform} {truth}");
    }
}
