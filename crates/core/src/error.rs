use thiserror::Error;

/// Why a [`Scene`](crate::Scene) is not usable. Each variant names the element at fault.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The attribute arrays of a mesh differ in length.
    #[error("mesh attribute `{attribute}` has {found} entries, {expected} vertices need as many")]
    AttributeLength {
        /// Name of the attribute.
        attribute: &'static str,
        /// Number of vertices.
        expected: usize,
        /// Number of entries found.
        found: usize,
    },
    /// A triangle names a vertex, or a material a texture, that does not exist.
    #[error("{what} {index} names {target} {value}, but there are only {count}")]
    IndexOutOfRange {
        /// Kind of the element that holds the index.
        what: &'static str,
        /// Its number.
        index: usize,
        /// Kind of the element it names.
        target: &'static str,
        /// The index it holds.
        value: usize,
        /// How many such elements exist.
        count: usize,
    },
    /// A number that must be finite, or within a range, is not.
    #[error("{what} {index}: {field} is {value}, it must be {requirement}")]
    BadValue {
        /// Kind of the element at fault.
        what: &'static str,
        /// Its number.
        index: usize,
        /// Name of the field.
        field: &'static str,
        /// The value, printed.
        value: String,
        /// What the field requires.
        requirement: &'static str,
    },
}
