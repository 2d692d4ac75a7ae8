//! What shaders bind, by the names that WGSL gives it.

use indirect_shaders::{Binding, BindingKind, EntryPoint};
use wgpu::{
    BindGroup, BindGroupEntry, BindGroupLayout, BindGroupLayoutEntry, BindingResource, BindingType,
    BufferBindingType, Device, ShaderStages, StorageTextureAccess, TextureFormat, TextureSampleType,
    TextureViewDimension,
};

use crate::GpuError;

/// What a shader's variable of this name is bound to.
pub type Named<'a> = (&'static str, BindingResource<'a>);

/// A whole buffer under the name that WGSL gives it.
#[must_use]
pub fn named<'a>(name: &'static str, buffer: &'a wgpu::Buffer) -> Named<'a> {
    (name, buffer.as_entire_binding())
}

/// The layout of one bind group, from what entry points bind there. Layouts of the same content are interchangeable: a bind
/// group made for one pipeline fits any other that declares the same.
#[must_use]
pub fn bind_group_layout(
    device: &Device,
    group: u32,
    entry_points: &[&EntryPoint],
    visibility: ShaderStages,
) -> BindGroupLayout {
    let mut entries: Vec<BindGroupLayoutEntry> = Vec::new();
    for b in entry_points.iter().flat_map(|e| e.bindings).filter(|b| b.group == group) {
        if entries.iter().all(|e| e.binding != b.binding) {
            let (binding, ty, count) = (b.binding, binding_type(b.kind), None);
            entries.push(BindGroupLayoutEntry { binding, visibility, ty, count });
        }
    }
    entries.sort_unstable_by_key(|e| e.binding);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

fn binding_type(kind: BindingKind) -> BindingType {
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = |sample_type| {
        let view_dimension = TextureViewDimension::D2;
        BindingType::Texture { sample_type, view_dimension, multisampled: false }
    };
    match kind {
        BindingKind::Uniform => buffer(BufferBindingType::Uniform),
        BindingKind::Read => buffer(BufferBindingType::Storage { read_only: true }),
        BindingKind::ReadWrite => buffer(BufferBindingType::Storage { read_only: false }),
        BindingKind::TextureFloat => texture(TextureSampleType::Float { filterable: false }),
        BindingKind::TextureUint => texture(TextureSampleType::Uint),
        BindingKind::StorageTexture => BindingType::StorageTexture {
            access: StorageTextureAccess::WriteOnly,
            format: TextureFormat::Rgba16Float,
            view_dimension: TextureViewDimension::D2,
        },
    }
}

/// A bind group from resources by the names that WGSL gives them; of two of one name that of the later list counts, and what
/// is not bound is passed over.
///
/// # Errors
/// [`GpuError::Unbound`] for a name that no list has.
pub fn bind_group<'a>(
    device: &Device,
    layout: &BindGroupLayout,
    label: &str,
    bindings: impl Iterator<Item = &'a Binding>,
    lists: &[&[Named<'_>]],
) -> Result<BindGroup, GpuError> {
    let entries = bindings.map(|b| match find(lists, b.name) {
        Some(resource) => Ok(BindGroupEntry { binding: b.binding, resource: resource.clone() }),
        None => Err(GpuError::Unbound { kernel: label.to_owned(), name: b.name }),
    });
    let entries = entries.collect::<Result<Vec<_>, _>>()?;
    Ok(device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries }))
}

/// The resource of a name.
pub(crate) fn find<'a>(lists: &[&'a [Named<'a>]], name: &str) -> Option<&'a BindingResource<'a>> {
    lists.iter().rev().find_map(|l| l.iter().rev().find(|b| b.0 == name)).map(|(_, resource)| resource)
}
