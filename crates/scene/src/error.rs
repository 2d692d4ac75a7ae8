use indirect_core::SceneError;
use thiserror::Error;

/// Why a file did not become a [`Scene`](indirect_core::Scene). Every message is one line that names the file, the element
/// at fault and, where there is one, the way out.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneLoadError {
    /// The file, or one it refers to, could not be read.
    #[error("{path}: cannot be read: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither a fixture's name nor the name of a glTF file.
    #[error("{path}: neither a glTF file (.gltf or .glb) nor a fixture ({fixtures})")]
    NotGltf {
        /// The argument.
        path: String,
        /// Names of the fixtures.
        fixtures: String,
    },
    /// The binary container or the JSON text is damaged.
    #[error("{path}: {problem}")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        problem: String,
    },
    /// The file needs an extension that this crate does not implement.
    #[error("{path}: extension `{extension}` is not supported: {remedy}")]
    Extension {
        /// The file.
        path: String,
        /// Name of the extension.
        extension: String,
        /// How to get rid of it.
        remedy: &'static str,
    },
    /// One element of the file is unusable.
    #[error("{path}: {element}: {problem}")]
    Element {
        /// The file.
        path: String,
        /// Kind, number and name of the element.
        element: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The scene would be larger than [`LoadOptions::max_triangles`](crate::LoadOptions::max_triangles).
    #[error("{path}: its instances add up to {triangles} triangles, more than the limit of {limit}")]
    TooLarge {
        /// The file.
        path: String,
        /// Number of triangles.
        triangles: u64,
        /// The limit.
        limit: u64,
    },
    /// Nothing to render.
    #[error("{path}: no triangles in its scene{hint}")]
    NoTriangles {
        /// The file.
        path: String,
        /// What was there instead, if anything.
        hint: String,
    },
    /// The finished scene breaks a rule of [`Scene::validate`](indirect_core::Scene::validate).
    #[error("{path}: {source}")]
    Invalid {
        /// The file.
        path: String,
        /// The rule.
        source: SceneError,
    },
}

/// Why a picture could not be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImageFileError {
    /// The file system refused.
    #[error("{path}: cannot be {action}: {source}")]
    Io {
        /// The file.
        path: String,
        /// `written` or `read`.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The image has no pixels, or more than the format can hold.
    #[error("an image of {}×{} pixels cannot be encoded", size[0], size[1])]
    Size {
        /// Width and height.
        size: [u32; 2],
    },
    /// The encoder or decoder refused.
    #[error("{path}: {problem}")]
    Codec {
        /// The file, or the format when there is no file.
        path: String,
        /// What is wrong.
        problem: String,
    },
}
