use glam::{UVec3, Vec3};
use indirect_core::Aabb;
use indirect_core::settings::BadOption;

use crate::layout::{VOLUMES, Volume};

/// Most volumes of a [`Lattice`]: they share one uniform buffer.
pub const MAX_VOLUMES: usize = VOLUMES;

/// Most hints of a [`Lattice`].
pub const MAX_HINTS: u32 = 1 << 22;

/// Where the hints, which are irradiance probes, lie: one or more boxes, each divided into cells with a hint at the centre
/// of each.
///
/// Boxes may overlap and may be nested. Where they do they are blended: the earlier one has priority, with a weight that
/// falls to 0 over the outermost cell of its box; the remaining weight goes to the next, and what is left to the last, whose
/// border values are extended outside of it. The weights add up to 1 everywhere and are continuous, so no seam shows: list
/// fine boxes before coarse ones, and let boxes that meet at a portal overlap by a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    volumes: Vec<Volume>,
    hints: u32,
}

impl Lattice {
    /// One box with `resolution` cells along each axis.
    ///
    /// A box that is flat along an axis (a floor and nothing else) is thickened along it, by as much as the edge of a cell
    /// is long along the others, to either side: hints on a surface would see nothing of it.
    ///
    /// # Errors
    /// [`BadOption`] for bounds that are not finite or empty, or a resolution of 0 or beyond [`MAX_HINTS`] hints.
    pub fn new(bounds: &Aabb, resolution: [u32; 3]) -> Result<Self, BadOption> {
        Self::of([(*bounds, resolution)])
    }

    /// One box whose cells are as near to cubes as at most `hints` of them can be: the scene's extents and a budget choose
    /// the resolution.
    ///
    /// # Errors
    /// As [`Lattice::new`].
    pub fn fit(bounds: &Aabb, hints: u32) -> Result<Self, BadOption> {
        check_bounds(bounds)?;
        if !(1..=MAX_HINTS).contains(&hints) {
            return Err(BadOption::new("hints", hints, "in 1..=4194304"));
        }
        let extent = bounds.extent();
        let cells =
            |edge: f32| extent.to_array().map(|e| ((e / edge).round().max(1.0)).min(hints as f32) as u32);
        let count = |r: [u32; 3]| r.iter().fold(1_u64, |n, r| n * u64::from(*r));
        // Bisection over the edge of a cell; one of the largest extent always fits.
        let (mut fine, mut coarse) = (extent.max_element() / hints as f32, extent.max_element());
        for _ in 0..48 {
            let middle = (fine * coarse).sqrt();
            if count(cells(middle)) <= u64::from(hints) { coarse = middle } else { fine = middle }
        }
        Self::new(bounds, cells(coarse))
    }

    /// Several boxes, each with its cells along each axis, those with precedence first.
    ///
    /// # Errors
    /// As [`Lattice::new`], and for no box or more than [`MAX_VOLUMES`].
    pub fn of(boxes: impl IntoIterator<Item = (Aabb, [u32; 3])>) -> Result<Self, BadOption> {
        let (mut volumes, mut hints) = (Vec::new(), 0_u64);
        for (bounds, resolution) in boxes {
            check_bounds(&bounds)?;
            if resolution.contains(&0) {
                return Err(BadOption::new(
                    "resolution",
                    format_args!("{resolution:?}"),
                    "at least 1 along each axis",
                ));
            }
            volumes.push(volume(&bounds, resolution, hints as u32));
            hints += resolution.iter().fold(1_u64, |n, r| n.saturating_mul(u64::from(*r)));
            if hints > u64::from(MAX_HINTS) {
                return Err(BadOption::new(
                    "resolution",
                    format_args!("{hints} hints"),
                    "at most 4194304 hints",
                ));
            }
        }
        if volumes.is_empty() || volumes.len() > MAX_VOLUMES {
            return Err(BadOption::new("volumes", volumes.len(), "in 1..=16"));
        }
        let boxes: Vec<Aabb> = volumes.iter().map(Volume::bounds).collect();
        for (volume, own) in volumes.iter_mut().zip(&boxes) {
            let contains = |b: &Aabb| b.min.cmple(own.min).all() && b.max.cmpge(own.max).all();
            // It contains itself.
            volume.room = boxes.iter().rposition(contains).unwrap_or_default() as u32;
        }
        Ok(Self { volumes, hints: hints as u32 })
    }

    /// The box at whose border later bounces of hint `i` begin. The border of a box within a larger
    /// one counts as open, not as walls.
    #[cfg(feature = "cpu")]
    pub(crate) fn room(&self, i: u32) -> &Volume {
        &self.volumes[self.place(i).0.room as usize]
    }

    /// The boxes, those with precedence first.
    #[must_use]
    pub fn volumes(&self) -> &[Volume] {
        &self.volumes
    }

    /// Number of hints of all boxes.
    #[must_use]
    pub const fn hints(&self) -> u32 {
        self.hints
    }

    /// The box that hint `i` belongs to, and the coordinates of its cell.
    #[must_use]
    pub(crate) fn place(&self, i: u32) -> (&Volume, UVec3) {
        let mut volume = &self.volumes[0];
        for v in &self.volumes[1..] {
            if i >= v.first {
                volume = v;
            }
        }
        let (local, r) = (i - volume.first, volume.resolution);
        (volume, UVec3::new(local % r.x, local / r.x % r.y, local / (r.x * r.y)))
    }

    /// World position of hint `i`.
    ///
    /// # Panics
    /// Where there is no such hint.
    #[must_use]
    pub fn position(&self, i: u32) -> Vec3 {
        assert!(i < self.hints, "hint {i} of {}", self.hints);
        let (volume, place) = self.place(i);
        volume.origin + volume.cell * (place.as_vec3() + 0.5)
    }
}

fn check_bounds(bounds: &Aabb) -> Result<(), BadOption> {
    let extent = bounds.extent();
    if bounds.min.is_finite()
        && extent.is_finite()
        && extent.min_element() >= 0.0
        && extent.max_element() > 0.0
    {
        return Ok(());
    }
    Err(BadOption::new("bounds", format_args!("{} to {}", bounds.min, bounds.max), "finite and not a point"))
}

fn volume(bounds: &Aabb, resolution: [u32; 3], first: u32) -> Volume {
    /// Share of the longest edge below which a box is flat.
    const FLAT: f32 = 1e-3;
    let (mut origin, mut extent) = (bounds.min, bounds.extent());
    let resolution = UVec3::from(resolution);
    let flat = extent.to_array().map(|e| e < FLAT * extent.max_element());
    let edge = (0..3).filter(|a| !flat[*a]).map(|a| extent[a] / resolution[a] as f32).fold(0.0, f32::max);
    for axis in (0..3).filter(|a| flat[*a]) {
        // At least two layers, one to either side.
        let grown = edge * resolution[axis].max(2) as f32;
        origin[axis] -= 0.5 * (grown - extent[axis]);
        extent[axis] = grown;
    }
    Volume { origin, first, cell: extent / resolution.as_vec3(), room: 0, resolution, pad1: 0 }
}
