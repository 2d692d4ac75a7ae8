//! Alias table and inverted distribution function over an image: the usual alternatives to [`warp`](crate::warp), with the
//! same result type.
//!
//! | | build | sample | neighbours stay neighbours | inverse |
//! |---|---|---|---|---|
//! | [`AliasTable`] | O(n) | O(1) | no: half of the points jump to an alias | no |
//! | [`RowCdf`] | O(n) | O(log n) | within a row; rows are ordered by their sums | not offered |
//! | [`warp`](crate::warp) | O(n), a GPU's mip pyramid | O(log n) | yes, in both axes | yes |
//!
//! ```
//! use glam::Vec2;
//! use indirect_sampling::discrete::AliasTable;
//!
//! # fn main() -> Result<(), indirect_sampling::warp::WarpError> {
//! let table = AliasTable::build([2, 1], &[1.0, 3.0])?;
//! let sample = table.sample(Vec2::new(0.9, 0.5));
//! assert_eq!((sample.texel, sample.pdf), ([1, 0], 0.75));
//! # Ok(())
//! # }
//! ```

use alloc::{vec, vec::Vec};

use glam::Vec2;

use crate::warp::{BELOW_ONE, MAX_SIDE, Sample, WarpError, point};

/// Checks sizes and returns the importance as f64, what does not count as 0, with its sum.
fn weights(size: [u32; 2], importance: &[f32]) -> Result<(Vec<f64>, f64), WarpError> {
    if size.iter().any(|n| !(1..=MAX_SIDE).contains(n)) {
        return Err(WarpError::Size(size));
    }
    let expected = size[0] as usize * size[1] as usize;
    if importance.len() != expected {
        return Err(WarpError::Length { expected, found: importance.len() });
    }
    let finite = |&w: &f32| if w > 0.0 && w < f32::INFINITY { f64::from(w) } else { 0.0 };
    let weights: Vec<f64> = importance.iter().map(finite).collect();
    let sum = weights.iter().sum();
    if sum > 0.0 { Ok((weights, sum)) } else { Err(WarpError::AllZero) }
}

/// Walker's alias method over the texels of an image (Vose 1991).
#[derive(Debug, Clone)]
pub struct AliasTable {
    size: [u32; 2],
    /// Per texel: the share of its column that it keeps, and the texel that has the rest.
    columns: Vec<(f32, u32)>,
    pdfs: Vec<f32>,
}

impl AliasTable {
    /// Builds the table.
    ///
    /// # Errors
    ///
    /// [`WarpError`]
    pub fn build(size: [u32; 2], importance: &[f32]) -> Result<Self, WarpError> {
        let (weights, sum) = weights(size, importance)?;
        let count = weights.len() as f64;
        let mut shares: Vec<f64> = weights.iter().map(|w| w / sum * count).collect();
        let mut columns: Vec<(f32, u32)> = (0..).map(|i| (1.0, i)).take(weights.len()).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..weights.len() as u32).partition(|&i| shares[i as usize] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            columns[s as usize] = (shares[s as usize] as f32, l);
            shares[l as usize] -= 1.0 - shares[s as usize];
            if shares[l as usize] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // What rounding left over keeps its column, unless it has no importance at all.
        if let Some(&heaviest) = large.last().or(small.last()) {
            for i in small.iter().chain(&large).filter(|&&i| weights[i as usize] == 0.0) {
                columns[*i as usize] = (0.0, heaviest);
            }
        }
        let pdfs = weights.iter().map(|w| (w / sum) as f32).collect();
        Ok(Self { size, columns, pdfs })
    }

    /// The point of the image that `u` in `[0, 1)²` goes to: `u` picks a column by its place in the image, and its place
    /// within the column's x decides between texel and alias.
    #[must_use]
    #[inline]
    pub fn sample(&self, u: Vec2) -> Sample {
        let [w, h] = self.size;
        let scaled = u.clamp(Vec2::ZERO, Vec2::splat(BELOW_ONE)) * Vec2::new(w as f32, h as f32);
        let [x, y] = [(scaled.x as u32).min(w - 1), (scaled.y as u32).min(h - 1)];
        let (fx, fy) = (scaled.x - x as f32, (scaled.y - y as f32).min(BELOW_ONE));
        let column = y * w + x;
        let (kept, alias) = self.columns[column as usize];
        let (i, fx) = if fx < kept { (column, fx / kept) } else { (alias, (fx - kept) / (1.0 - kept)) };
        let texel = [i % w, i / w];
        Sample { point: point(texel, Vec2::new(fx.min(BELOW_ONE), fy)), texel, pdf: self.pdfs[i as usize] }
    }
}

/// Inversion of the distribution function: of the rows by `u.y`, then of the texels within the row by `u.x`.
#[derive(Debug, Clone)]
pub struct RowCdf {
    size: [u32; 2],
    /// Upper ends of the rows' shares, then per row upper ends of the texels' shares; the last of each is 1.
    rows: Vec<f32>,
    texels: Vec<f32>,
}

impl RowCdf {
    /// Sums the image.
    ///
    /// # Errors
    ///
    /// [`WarpError`]
    pub fn build(size: [u32; 2], importance: &[f32]) -> Result<Self, WarpError> {
        let (weights, _) = weights(size, importance)?;
        let width = size[0] as usize;
        let cumulative = |weights: &mut dyn Iterator<Item = f64>| {
            let sums: Vec<f64> = weights
                .scan(0.0, |sum, w| {
                    *sum += w;
                    Some(*sum)
                })
                .collect();
            let total = sums.last().copied().unwrap_or(0.0);
            // Trailing zeros repeat the total, so that they too end at exactly 1 and are never chosen.
            sums.into_iter()
                .map(move |s| if total > 0.0 { (s / total) as f32 } else { 1.0 })
                .collect::<Vec<f32>>()
        };
        let rows = cumulative(&mut weights.chunks(width).map(|row| row.iter().sum()));
        let mut texels = vec![];
        for row in weights.chunks(width) {
            texels.extend(cumulative(&mut row.iter().copied()));
        }
        Ok(Self { size, rows, texels })
    }

    /// The point of the image that `u` in `[0, 1)²` goes to.
    #[must_use]
    #[inline]
    pub fn sample(&self, u: Vec2) -> Sample {
        let width = self.size[0] as usize;
        let (y, v, rows) = invert(&self.rows, u.y.clamp(0.0, BELOW_ONE));
        let (x, u, columns) = invert(&self.texels[y * width..(y + 1) * width], u.x.clamp(0.0, BELOW_ONE));
        let texel = [x as u32, y as u32];
        Sample { point: point(texel, Vec2::new(u, v)), texel, pdf: rows * columns }
    }
}

/// The step that `u` falls on, its place within, and the height of the step.
#[inline]
fn invert(ends: &[f32], u: f32) -> (usize, f32, f32) {
    let i = ends.partition_point(|end| *end <= u);
    let begin = if i == 0 { 0.0 } else { ends[i - 1] };
    let height = ends[i] - begin;
    (i, ((u - begin) / height).min(BELOW_ONE), height)
}
