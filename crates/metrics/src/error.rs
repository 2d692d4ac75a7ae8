use thiserror::Error;

/// Why two images cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// An image, or the surface mask, does not have the reference's size.
    #[error("{what} has {found} pixels ({width}×{height}), the reference has {expected}")]
    SizeMismatch {
        /// Which input.
        what: &'static str,
        /// Its pixel count.
        found: usize,
        /// Its width as it states it.
        width: u32,
        /// Its height as it states it.
        height: u32,
        /// Pixel count of the reference.
        expected: usize,
    },
    /// The reference has no pixels.
    #[error("the reference has no pixels")]
    Empty,
    /// A value is NaN or infinite.
    #[error("{what}: pixel ({x}, {y}) is not finite")]
    NonFinite {
        /// Which image.
        what: &'static str,
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// The reference sees no surface, so that there is nothing to average over.
    #[error("the reference sees no surface in any pixel")]
    NoSurface,
    /// The reference is black wherever it sees a surface: relative errors are undefined.
    #[error("the reference is black: relative errors are undefined")]
    BlackReference,
    /// A parameter is outside its range.
    #[error("{parameter} is {value}, it must be {requirement}")]
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// The value, printed.
        value: String,
        /// What it must be.
        requirement: &'static str,
    },
}
