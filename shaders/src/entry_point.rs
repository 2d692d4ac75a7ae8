/// What an entry point binds at one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Binding {
    /// `@group`.
    pub group: u32,
    /// `@binding`.
    pub binding: u32,
    /// Name of the variable.
    pub name: &'static str,
    /// What it is.
    pub kind: BindingKind,
}

/// What can be bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
    /// `texture_2d<f32>`, not filtered.
    TextureFloat,
    /// `texture_2d<u32>`.
    TextureUint,
    /// `texture_storage_2d<rgba16float, write>`.
    StorageTexture,
}

/// An entry point as naga reflects it; a test of this crate holds the table against the sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EntryPoint {
    /// Name of the [`Module`](crate::Module).
    pub module: &'static str,
    /// Name of the entry point.
    pub name: &'static str,
    /// Invocations of a workgroup; zeros for a vertex or fragment shader.
    pub workgroup_size: [u32; 3],
    /// All that it uses, by group and binding.
    pub bindings: &'static [Binding],
}
