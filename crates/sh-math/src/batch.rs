//! Many directions at once.

use core::fmt;

use crate::basis::basis;
use crate::real::Real;
use crate::sh::Sh;

/// Slices whose lengths do not belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BatchError {
    /// A slice has `found` elements where the number of directions asks for `expected`.
    Length {
        /// Elements needed.
        expected: usize,
        /// Elements found.
        found: usize,
    },
}

impl fmt::Display for BatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self::Length { expected, found } = self;
        write!(f, "a batch slice has {found} elements, {expected} are needed")
    }
}

impl core::error::Error for BatchError {}

fn check(expected: usize, found: usize) -> Result<(), BatchError> {
    if expected == found { Ok(()) } else { Err(BatchError::Length { expected, found }) }
}

/// [`basis`] at many unit directions, one row each.
///
/// Rows, not columns: the compiler vectorises over the coefficients of a direction. Separate arrays of x, y and z with one
/// output array per coefficient measured 1.5 to 4 times slower at `l ≤ 4` (the values do not fit the registers).
///
/// # Errors
/// [`BatchError::Length`] where the slices differ in length.
#[inline]
pub fn basis_batch<const N: usize, S: Real>(
    directions: &[[S; 3]],
    rows: &mut [[S; N]],
) -> Result<(), BatchError> {
    check(directions.len(), rows.len())?;
    for (row, d) in rows.iter_mut().zip(directions) {
        *row = basis(*d);
    }
    Ok(())
}

impl<const N: usize, S: Real> Sh<N, S> {
    /// [`Sh::evaluate`] at many unit directions.
    ///
    /// # Errors
    /// [`BatchError::Length`] where the slices differ in length.
    #[inline]
    pub fn evaluate_batch(&self, directions: &[[S; 3]], values: &mut [S]) -> Result<(), BatchError> {
        check(directions.len(), values.len())?;
        for (value, d) in values.iter_mut().zip(directions) {
            *value = self.evaluate(*d);
        }
        Ok(())
    }

    /// [`Sh::project_add`] of many samples: unit directions, and values times the solid angle each stands for.
    ///
    /// # Errors
    /// [`BatchError::Length`] where the slices differ in length.
    #[inline]
    pub fn project_batch(&mut self, directions: &[[S; 3]], weighted: &[S]) -> Result<(), BatchError> {
        check(directions.len(), weighted.len())?;
        for (weighted, d) in weighted.iter().zip(directions) {
            self.project_add(*d, *weighted);
        }
        Ok(())
    }
}
