//! Radiance that leaves a cell of the R-grid (§3.4.2, §3.4.3).

use core::f32::consts::FRAC_1_PI;

use glam::{UVec3, Vec3, Vec4};

use crate::layout::Faces;
use crate::pyramid::Pyramid;
use crate::voxels::face_shares;

/// Where a ray ends, as the R-grid sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Place of the boundary cell.
    pub place: u32,
    /// The cell.
    pub cell: UVec3,
    /// Normal of the surface, towards the ray's origin.
    pub normal: Vec3,
    /// Where the ray came from, in units of cells.
    pub origin: Vec3,
    /// Its direction.
    pub direction: Vec3,
    /// Area, perpendicular to it, that it stands for, in faces of a cell; 0: a point.
    pub area: f32,
    /// A number of what was met, other than 0: of a triangle or of a fine cell.
    pub mark: u32,
}

/// The R-grid and how it is read.
#[derive(Debug, Clone, Copy)]
pub struct Lookup<'a> {
    /// Its cells.
    pub pyramid: &'a Pyramid,
    /// What left them.
    pub faces: &'a [Faces],
    /// [`Params::least_area`](crate::Params::least_area).
    pub least_area: f32,
    /// Whether as printed.
    pub printed: bool,
}

/// Cosine at which a surface stands for the largest area that it stands for at all.
const LEAST_COSINE: f32 = 1e-3;

/// Keeps a quotient finite where nothing lies in a cell.
const LEAST: f32 = 1e-30;

impl Lookup<'_> {
    /// Radiance along the ray, W/(sr·m²).
    #[must_use]
    #[inline]
    pub fn radiance(&self, look: &Look) -> Vec3 {
        if self.printed { self.as_printed(look) } else { self.by_area(look) }
    }

    fn faces_at(&self, look: &Look, level: u32) -> &[Vec4; 6] {
        let place = if level == 0 { look.place } else { self.pyramid.ancestor(look.cell, level) };
        &self.faces[place as usize].faces
    }

    fn last(&self) -> u32 {
        self.pyramid.levels.len() as u32 - 1
    }

    /// Flux over area of the surfaces that face as the one that is seen.
    fn by_area(&self, look: &Look) -> Vec3 {
        let cosine = (-look.normal.dot(look.direction)).max(LEAST_COSINE);
        let (level, share) = self.level_of(look.area / cosine);
        let mut sum = self.by_area_at(look, level) * (1.0 - share);
        if share > 0.0 {
            sum += self.by_area_at(look, level + 1) * share;
        }
        sum * FRAC_1_PI
    }

    fn by_area_at(&self, look: &Look, level: u32) -> Vec3 {
        let sum = |level: u32| -> Vec4 {
            let weights = face_shares(look.normal);
            self.faces_at(look, level).iter().zip(weights).map(|(f, w)| *f * w).sum()
        };
        let side = self.pyramid.levels[level as usize].grid.cell;
        let least = self.least_area * side * side;
        let own = sum(level);
        // What a surface only touches has few photons: the level after stands for what its area lacks.
        let lacking = (least - own.w).max(0.0);
        let mut flux = own.truncate();
        if lacking > 0.0 {
            let next = sum((level + 1).min(self.last()));
            flux += next.truncate() * (lacking / next.w.max(least).max(LEAST));
        }
        flux / (own.w + lacking).max(LEAST)
    }

    /// The level whose faces have an area, in those of level 0, and the share of the next.
    fn level_of(&self, area: f32) -> (u32, f32) {
        let level = (0.5 * area.max(1.0).log2()).min(self.last() as f32);
        (level.floor() as u32, level.fract())
    }

    /// Radiance of the faces that are visible, with Gaussian weights on the angles between the ray and their centres. The paper does not
    /// say how wide: here half a cell, as it appears from the ray's origin.
    fn as_printed(&self, look: &Look) -> Vec3 {
        let centre = look.cell.as_vec3() + 0.5;
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (j, n) in FACE_NORMALS.into_iter().enumerate() {
            let to = centre + n * 0.5 - look.origin;
            let distance = to.length().max(LEAST);
            let v = to / distance;
            let cos_beta = -n.dot(v);
            if cos_beta <= 0.0 {
                continue;
            }
            // The chord stands for the angle: it keeps its digits where that is small.
            let alpha = (v - look.direction).length() * distance.max(0.5) * 2.0;
            let g = (-0.5 * alpha * alpha).exp().max(LEAST);
            let (level, share) = self.level_of(look.area / cos_beta);
            let at = |level: u32| {
                let f = self.faces_at(look, level)[j];
                f.truncate() / f.w.max(LEAST)
            };
            let mut l = at(level) * (1.0 - share);
            if share > 0.0 {
                l += at(level + 1) * share;
            }
            sum += l * (g * cos_beta);
            weights += g;
        }
        if weights > 0.0 { sum * (FRAC_1_PI / weights) } else { Vec3::ZERO }
    }
}

/// Outward normals of a cell's faces in the order of their fluxes.
const FACE_NORMALS: [Vec3; 6] = [Vec3::NEG_X, Vec3::X, Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z, Vec3::Z];

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{SH_GRID_FIELD, SH_GRID_FIELD_VOXELS, SH_GRID_FINAL};
    use testkit::layout::check_constant;

    #[test]
    fn constants_are_those_of_the_shaders() {
        for module in [&SH_GRID_FIELD, &SH_GRID_FIELD_VOXELS, &SH_GRID_FINAL] {
            check_constant(module, "LEAST_COSINE", LEAST_COSINE).unwrap();
            check_constant(module, "LEAST", LEAST).unwrap();
            check_constant(module, "FRAC_1_PI", FRAC_1_PI).unwrap();
        }
    }
}
