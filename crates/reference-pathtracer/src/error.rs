use std::path::PathBuf;

use thiserror::Error as ThisError;

/// Why there is no estimate.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// An image without pixels, or with more than 2²⁸, which would take 53 GB.
    #[error("image size {}x{} must be between 1 and 2^28 pixels", size[0], size[1])]
    Size {
        /// Width and height asked for.
        size: [u32; 2],
    },
    /// Points and normals are not as many.
    #[error("{points} points, but {normals} normals")]
    Points {
        /// Number of points.
        points: usize,
        /// Number of normals.
        normals: usize,
    },
    /// Settings that contradict themselves.
    #[error("settings: {message}")]
    Settings {
        /// What is wrong.
        message: &'static str,
    },
    /// Estimates that do not belong together.
    #[error("estimates cannot be merged: {message}")]
    Merge {
        /// What differs or overlaps.
        message: &'static str,
    },
    /// Bytes that are not an estimate, or a damaged one.
    #[error("not a stored estimate: {message}")]
    Format {
        /// What is wrong.
        message: &'static str,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
