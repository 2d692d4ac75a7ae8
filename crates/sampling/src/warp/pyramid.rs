//! Importance pyramids and the warp through them.

use alloc::vec::Vec;

use glam::Vec2;

/// What can be wrong with an importance map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum WarpError {
    /// A side is 0, or the pyramid has more texels than a `u32` can index.
    Size([u32; 2]),
    /// The number of values does not fit the size.
    Length {
        /// What the size asks for.
        expected: usize,
        /// What was given.
        found: usize,
    },
    /// No texel has positive importance, and [`Empty::Error`] was asked for.
    AllZero,
}

impl core::fmt::Display for WarpError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Size([w, h]) => write!(f, "importance map of {w}×{h} texels"),
            Self::Length { expected, found } => {
                write!(f, "{found} values where {expected} belong")
            }
            Self::AllZero => write!(f, "importance map without a positive value"),
        }
    }
}

impl core::error::Error for WarpError {}

/// What to do with a map of zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Empty {
    /// [`WarpError::AllZero`].
    Error,
    /// Draw uniformly.
    Uniform,
}

/// A point of the map and its density.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sample {
    /// Position in texels, `[0, width) × [0, height)`.
    pub point: Vec2,
    /// The texel that holds the point.
    pub texel: [u32; 2],
    /// Density per texel area, which is also the probability of the texel.
    pub pdf: f32,
}

/// Longest side of a map.
pub const MAX_SIDE: u32 = 1 << 16;

/// Points that [`Warp::sample_batch`] takes at a time.
const LANES: usize = 16;

/// The largest float below 1.
pub(crate) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// The level of the single texel at the top of the pyramid.
#[must_use]
#[inline]
pub const fn top_level(size: [u32; 2]) -> u32 {
    let longest = if size[0] > size[1] { size[0] } else { size[1] };
    u32::BITS - longest.saturating_sub(1).leading_zeros()
}

/// Size of a level: `⌈size/2^level⌉`, for sides up to [`MAX_SIDE`] and levels up to [`top_level`].
#[must_use]
#[inline]
pub const fn level_size(size: [u32; 2], level: u32) -> [u32; 2] {
    // A division would cost more than the rest of a step down the pyramid.
    let round_up = (1 << level) - 1;
    [(size[0] + round_up) >> level, (size[1] + round_up) >> level]
}

/// Number of values in all levels together, `None` for a side of 0 or above [`MAX_SIDE`], or for more than `u32::MAX`
/// values.
#[must_use]
pub const fn pyramid_len(size: [u32; 2]) -> Option<usize> {
    if size[0] == 0 || size[1] == 0 || size[0] > MAX_SIDE || size[1] > MAX_SIDE {
        return None;
    }
    let (mut len, mut level) = (0_u64, 0);
    while level <= top_level(size) {
        let [w, h] = level_size(size, level);
        len += w as u64 * h as u64;
        level += 1;
    }
    if len <= u32::MAX as u64 { Some(len as usize) } else { None }
}

/// An importance pyramid, built once and then warped through as often as needed.
#[derive(Debug, Clone, PartialEq)]
pub struct Pyramid {
    size: [u32; 2],
    levels: Vec<f32>,
}

impl Pyramid {
    /// Sums `importance`, row by row, into a pyramid. Values of any finite magnitude will do: maps with a maximum outside of
    /// `[2⁻⁶⁴, 2⁶⁴]` are scaled by a power of two.
    ///
    /// # Errors
    ///
    /// [`WarpError::Size`] and [`WarpError::Length`].
    pub fn build(size: [u32; 2], importance: &[f32]) -> Result<Self, WarpError> {
        let len = pyramid_len(size).ok_or(WarpError::Size(size))?;
        let texels = size[0] as usize * size[1] as usize;
        if importance.len() != texels {
            return Err(WarpError::Length { expected: texels, found: importance.len() });
        }
        let finite = |w: f32| if w > 0.0 && w < f32::INFINITY { w } else { 0.0 };
        let scale = balancing_scale(importance.iter().fold(0.0_f32, |m, &w| m.max(finite(w))));
        let mut levels = Vec::with_capacity(len);
        levels.extend(importance.iter().map(|&w| finite(w) * scale[0] * scale[1]));
        let mut fine = 0;
        for level in 0..top_level(size) {
            let ([w, h], [coarse_w, coarse_h]) = (level_size(size, level), level_size(size, level + 1));
            for y in 0..coarse_h {
                for x in 0..coarse_w {
                    let [a, b, c, d] = children(&|i| levels[i], fine, [w, h], [x, y]);
                    levels.push((a + b) + (c + d));
                }
            }
            fine += w as usize * h as usize;
        }
        Ok(Self { size, levels })
    }

    /// Takes levels made elsewhere, for example by a GPU, in the layout of the [module page](super). Values that do not count as
    /// importance become 0.
    ///
    /// # Errors
    ///
    /// [`WarpError::Size`] and [`WarpError::Length`].
    pub fn from_levels(size: [u32; 2], mut levels: Vec<f32>) -> Result<Self, WarpError> {
        let expected = pyramid_len(size).ok_or(WarpError::Size(size))?;
        if levels.len() != expected {
            return Err(WarpError::Length { expected, found: levels.len() });
        }
        levels.iter_mut().for_each(|w| *w = clean(*w));
        Ok(Self { size, levels })
    }

    /// Size of level 0.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.size
    }

    /// All levels, finest first.
    #[must_use]
    pub fn levels(&self) -> &[f32] {
        &self.levels
    }

    /// The warp through this pyramid.
    ///
    /// # Errors
    ///
    /// [`WarpError::AllZero`] if `empty` says so.
    pub fn warp(&self, empty: Empty) -> Result<Warp<impl Fn(usize) -> f32 + Copy + '_>, WarpError> {
        Warp::of_clean(self.size, |i| self.levels[i], empty)
    }
}

/// Two powers of two whose product brings `max` into `[1, 2)` if it lies far from there; one alone may overflow.
fn balancing_scale(max: f32) -> [f32; 2] {
    const FAR: f32 = 18_446_744_073_709_551_616.0; // 2^64
    if max == 0.0 || (1.0 / FAR..=FAR).contains(&max) {
        return [1.0; 2];
    }
    // 2^-126 is the least exponent that the bits of a normal number show; subnormals are short of [1, 2) by at most 2^23.
    let exponent = (max.to_bits() >> 23).cast_signed().max(1) - 127;
    let power = |e: i32| f32::from_bits((127 + e).cast_unsigned() << 23);
    [power(-exponent / 2), power(-exponent - -exponent / 2)]
}

/// Values that do not count as importance are read as 0; the limit keeps a sum of four finite.
#[inline]
fn clean(w: f32) -> f32 {
    if w > 0.0 && w < f32::MAX / 8.0 { w } else { 0.0 }
}

/// The children of texel `parent`: left and right of the upper row, then of the lower row. `offset` and `size` are those
/// of the children's level.
#[inline]
fn children(weight: &impl Fn(usize) -> f32, offset: usize, [w, h]: [u32; 2], parent: [u32; 2]) -> [f32; 4] {
    let (x, y) = (2 * parent[0], 2 * parent[1]);
    let (right, below) = (x + 1 < w, y + 1 < h);
    let at = offset + y as usize * w as usize + x as usize;
    let read = |present: bool, i: usize| if present { weight(i) } else { 0.0 };
    [
        read(true, at),
        read(right, at + 1),
        read(below, at + w as usize),
        read(right && below, at + w as usize + 1),
    ]
}

/// `a` or `b`, without a branch: half of them would be mispredicted, at the price of all else in a step.
#[inline]
fn pick(second: bool, a: f32, b: f32) -> f32 {
    let mask = u32::from(second).wrapping_neg();
    f32::from_bits((a.to_bits() & !mask) | (b.to_bits() & mask))
}

/// Chooses the first or second part of `[0, 1)`, which are in the proportion `a : b`, and stretches it to `[0, 1)`.
/// A part of size 0 is never chosen: `u ≤ 1 − 2⁻²⁴` keeps the rounded `u·(a + b)` below `a + b` where that is a normal
/// number; `b > 0` decides where it is not, as the product of subnormals may round up to the sum.
#[inline]
fn split(u: f32, a: f32, b: f32) -> (bool, f32) {
    let t = u * (a + b);
    let second = (t >= a) & (b > 0.0);
    let (begin, part) = (pick(second, 0.0, a), pick(second, a, b));
    let rest = (t - begin) / part;
    (second, if rest < BELOW_ONE { rest } else { BELOW_ONE })
}

/// The inverse of [`split`].
#[inline]
fn join(second: bool, u: f32, a: f32, b: f32) -> f32 {
    (if second { a + u * b } else { u * a }) / (a + b)
}

/// The point at the place `u` within a texel, also where the sum of both would round up to the next texel.
#[inline]
pub(crate) fn point(texel: [u32; 2], u: Vec2) -> Vec2 {
    let place = |texel: u32, u: f32| (texel as f32 + u).min(((texel + 1) as f32).next_down());
    Vec2::new(place(texel[0], u.x), place(texel[1], u.y))
}

/// A warp through a pyramid that lives elsewhere: `weight(i)` is the importance of element `i` of the buffer of all levels.
#[derive(Debug, Clone, Copy)]
pub struct Warp<F> {
    size: [u32; 2],
    top: u32,
    root: usize,
    weight: F,
}

impl Warp<()> {
    /// A warp through a pyramid over a map of `size` texels, in the layout of the [module page](super). `weight` is called
    /// with indices below [`pyramid_len`].
    ///
    /// # Errors
    ///
    /// [`WarpError::Size`], and [`WarpError::AllZero`] if `empty` says so.
    pub fn new<W: Fn(usize) -> f32>(
        size: [u32; 2],
        weight: W,
        empty: Empty,
    ) -> Result<Warp<impl Fn(usize) -> f32>, WarpError> {
        Warp::of_clean(size, move |i| clean(weight(i)), empty)
    }
}

impl<F: Fn(usize) -> f32> Warp<F> {
    /// A warp through weights that [`clean`] would not change.
    fn of_clean(size: [u32; 2], weight: F, empty: Empty) -> Result<Self, WarpError> {
        let root = pyramid_len(size).ok_or(WarpError::Size(size))? - 1;
        if empty == Empty::Error && weight(root) == 0.0 {
            return Err(WarpError::AllZero);
        }
        Ok(Self { size, top: top_level(size), root, weight })
    }

    /// The point of the map that `u` in `[0, 1)²` goes to.
    #[must_use]
    #[inline]
    pub fn sample(&self, u: Vec2) -> Sample {
        self.descend_one(self.top, self.root, [0, 0], u)
    }

    /// [`Warp::sample`] within one texel `node` of a level: a point of the texels of level 0 beneath it, whose density
    /// [`Sample::pdf`] is that *given* the node. `None` for a level or a node that there is not.
    #[must_use]
    pub fn sample_within(&self, level: u32, node: [u32; 2], u: Vec2) -> Option<Sample> {
        if level > self.top {
            return None;
        }
        let size = level_size(self.size, level);
        if node[0] >= size[0] || node[1] >= size[1] {
            return None;
        }
        let begin = (0..level).map(|l| level_size(self.size, l)).map(|[w, h]| w as usize * h as usize).sum();
        Some(self.descend_one(level, begin, node, u))
    }

    /// [`Warp::sample`] of many points, the same bits: `samples[i]` for `u[i]`.
    ///
    /// A step down the pyramid waits for the one before it. Several points at a time walk down together, so that their
    /// waits overlap: 1.6 times as fast over 64², 3.4 times over 512²
    /// (`cargo bench -p indirect-sampling`).
    ///
    /// # Errors
    ///
    /// [`WarpError::Length`] where the slices differ in length.
    pub fn sample_batch(&self, u: &[Vec2], samples: &mut [Sample]) -> Result<(), WarpError> {
        if u.len() != samples.len() {
            return Err(WarpError::Length { expected: u.len(), found: samples.len() });
        }
        let (groups, rest) = u.as_chunks::<LANES>();
        let (sample_groups, sample_rest) = samples.as_chunks_mut::<LANES>();
        for (u, samples) in groups.iter().zip(sample_groups) {
            self.descend(self.top, self.root, [0, 0], u, samples);
        }
        for (u, sample) in rest.iter().zip(sample_rest) {
            *sample = self.sample(*u);
        }
        Ok(())
    }

    /// Walks down from a texel of `level`, which begins at `offset`.
    #[inline]
    fn descend_one(&self, level: u32, offset: usize, texel: [u32; 2], u: Vec2) -> Sample {
        let mut sample = [Sample::default()];
        self.descend(level, offset, texel, &[u], &mut sample);
        sample[0]
    }

    /// Walks down from a texel of `level`, which begins at `offset`, with `L` points at a time.
    #[inline]
    fn descend<const L: usize>(
        &self,
        level: u32,
        mut offset: usize,
        [x, y]: [u32; 2],
        u: &[Vec2; L],
        samples: &mut [Sample; L],
    ) {
        let unit = |u: f32| if u > 0.0 { u.min(BELOW_ONE) } else { 0.0 };
        let (mut ux, mut uy) = (u.map(|u| unit(u.x)), u.map(|u| unit(u.y)));
        let (mut x, mut y, mut pdf) = ([x; L], [y; L], [1.0; L]);
        for level in (0..level).rev() {
            let [w, h] = level_size(self.size, level);
            offset -= w as usize * h as usize;
            // Loads first, a column of numbers per child: what follows is then done for several points by one instruction.
            let mut groups = [[0.0; L]; 4];
            for i in 0..L {
                let group = self.group(level, offset, [w, h], [x[i], y[i]]);
                for (column, weight) in groups.iter_mut().zip(group) {
                    column[i] = weight;
                }
            }
            let [a, b, c, d] = groups;
            for i in 0..L {
                let (upper, lower) = (a[i] + b[i], c[i] + d[i]);
                let (below, v) = split(uy[i], upper, lower);
                let left_part = pick(below, a[i], c[i]);
                let right_part = pick(below, b[i], d[i]);
                let (right, u) = split(ux[i], left_part, right_part);
                pdf[i] *= pick(right, left_part, right_part) / (upper + lower);
                (x[i], y[i]) = (2 * x[i] + u32::from(right), 2 * y[i] + u32::from(below));
                (ux[i], uy[i]) = (u, v);
            }
        }
        for (i, sample) in samples.iter_mut().enumerate() {
            let texel = [x[i], y[i]];
            *sample = Sample { point: point(texel, Vec2::new(ux[i], uy[i])), texel, pdf: pdf[i] };
        }
    }

    /// Density at a point of the map, per texel area; 0 outside.
    #[must_use]
    pub fn pdf(&self, point: Vec2) -> f32 {
        let Some([x, y]) = self.texel(point) else { return 0.0 };
        let mut pdf = 1.0;
        let mut offset = self.root;
        for level in (0..self.top).rev() {
            let size = level_size(self.size, level);
            offset -= size[0] as usize * size[1] as usize;
            let group = self.group(level, offset, size, [x >> (level + 1), y >> (level + 1)]);
            let chosen = group[((y >> level & 1) << 1 | (x >> level & 1)) as usize];
            pdf *= chosen / ((group[0] + group[1]) + (group[2] + group[3]));
        }
        pdf
    }

    /// The `u` that [`Warp::sample`] maps to `point`, `None` where the density is 0.
    #[must_use]
    pub fn invert(&self, point: Vec2) -> Option<Vec2> {
        let [x, y] = self.texel(point)?;
        let (mut ux, mut uy) = (point.x - x as f32, point.y - y as f32);
        let mut offset = 0;
        for level in 0..self.top {
            let size = level_size(self.size, level);
            let group = self.group(level, offset, size, [x >> (level + 1), y >> (level + 1)]);
            let (right, below) = (x >> level & 1 == 1, y >> level & 1 == 1);
            let row = if below { [group[2], group[3]] } else { [group[0], group[1]] };
            if row[usize::from(right)] == 0.0 {
                return None;
            }
            ux = join(right, ux, row[0], row[1]);
            uy = join(below, uy, group[0] + group[1], group[2] + group[3]);
            offset += size[0] as usize * size[1] as usize;
        }
        Some(Vec2::new(ux, uy).clamp(Vec2::ZERO, Vec2::ONE))
    }

    fn texel(&self, point: Vec2) -> Option<[u32; 2]> {
        let [w, h] = self.size;
        let inside = point.x >= 0.0 && point.y >= 0.0 && point.x < w as f32 && point.y < h as f32;
        inside.then_some([point.x as u32, point.y as u32])
    }

    /// The children of `parent`, or the areas that they cover where all of them are 0.
    #[inline]
    fn group(&self, level: u32, offset: usize, size: [u32; 2], parent: [u32; 2]) -> [f32; 4] {
        let group = children(&self.weight, offset, size, parent);
        if (group[0] + group[1]) + (group[2] + group[3]) > 0.0 { group } else { self.areas(level, parent) }
    }

    /// How many texels of level 0 each child of `parent` covers.
    #[cold]
    fn areas(&self, level: u32, parent: [u32; 2]) -> [f32; 4] {
        let covered = |axis: usize, child: u32| {
            let end = |i: u32| (u64::from(i) << level).min(u64::from(self.size[axis])) as f32;
            end(child + 1) - end(child)
        };
        let columns = [covered(0, 2 * parent[0]), covered(0, 2 * parent[0] + 1)];
        let rows = [covered(1, 2 * parent[1]), covered(1, 2 * parent[1] + 1)];
        [columns[0] * rows[0], columns[1] * rows[0], columns[0] * rows[1], columns[1] * rows[1]]
    }
}
