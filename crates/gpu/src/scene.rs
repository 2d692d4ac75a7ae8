use bytemuck::Zeroable;
use indirect_core::{AlphaMode, Scene, Texture, TextureRef, Wrap};
use indirect_shaders::{Binding, RESOLVE};
use wgpu::{BindGroup, BindGroupLayout, Buffer, Device, ShaderStages};

use crate::layout::{MaterialUniform, NO_TEXTURE, SceneInfo, TextureUniform, Vec3Pad};
use crate::{GpuError, bind_group, bind_group_layout, named, storage_buffer, uniform_buffer};

/// A scene's triangles, materials and texels in GPU buffers: bind group 0 of every module with `core/scene.wgsl`.
///
/// Only what albedo and alpha tests need is there: no vertex colours, and no texels, where the scene has none; never the
/// textures of emission or roughness.
#[derive(Debug, Clone)]
pub struct SceneBuffers {
    vertices: Buffer,
    triangles: Buffer,
    materials: Buffer,
    texels: Buffer,
    info: Buffer,
    group: BindGroup,
    triangle_count: u32,
    masked: bool,
}

/// The layout of a scene's bind group, the same in every stage.
#[must_use]
pub fn scene_layout(device: &Device) -> BindGroupLayout {
    let entry = RESOLVE.entry_point("resolve");
    bind_group_layout(device, 0, entry.as_slice(), ShaderStages::all())
}

fn scene_bindings() -> impl Iterator<Item = &'static Binding> {
    RESOLVE.entry_point("resolve").map_or(&[][..], |e| e.bindings).iter().filter(|b| b.group == 0)
}

/// Which textures a scene's albedo needs, and where each begins among the texels.
struct TexelPlan {
    first: Vec<u64>,
    total: u64,
}

const UNUSED: u64 = u64::MAX;

impl TexelPlan {
    fn of(scene: &Scene) -> Self {
        let mut plan = Self { first: vec![UNUSED; scene.textures.len()], total: 0 };
        for material in &scene.materials {
            let metallic = material.metallic_roughness_texture.filter(|_| material.metallic > 0.0);
            for t in [material.base_color_texture, metallic].into_iter().flatten() {
                let i = t.texture as usize;
                if let (Some(first @ &mut UNUSED), Some(texture)) =
                    (plan.first.get_mut(i), scene.textures.get(i))
                {
                    *first = plan.total;
                    plan.total += texture.texels.len() as u64;
                }
            }
        }
        plan
    }

    fn locate(&self, scene: &Scene, t: TextureRef) -> TextureUniform {
        let i = t.texture as usize;
        let Texture { size, wrap, .. } = &scene.textures[i];
        let m = t.uv_transform;
        TextureUniform {
            transform: m.matrix2.to_cols_array(),
            translation: m.translation.to_array(),
            size: *size,
            wrap: wrap.map(|w| match w {
                Wrap::Repeat => 0,
                Wrap::Mirror => 1,
                Wrap::Clamp => 2,
            }),
            // Texels beyond the 32-bit index do not fit any binding: the upload fails before this is used.
            first_texel: u32::try_from(self.first[i]).unwrap_or(NO_TEXTURE),
            pad: 0,
        }
    }
}

const fn vertex_stride(scene: &Scene) -> u32 {
    if scene.mesh.colors.is_empty() { 2 } else { 3 }
}

impl SceneBuffers {
    /// Bytes of the largest storage buffer that `scene` needs; where that is more than the default limit of 128 MiB, the
    /// device must be asked for it.
    #[must_use]
    pub fn largest_binding(scene: &Scene) -> u64 {
        let vertices = scene.mesh.positions.len() as u64 * u64::from(vertex_stride(scene)) * 16;
        let triangles = scene.mesh.triangles.len() as u64 * 16;
        let materials = (scene.materials.len() * size_of::<MaterialUniform>()) as u64;
        vertices.max(triangles).max(materials).max(TexelPlan::of(scene).total * 8)
    }

    /// Creates the buffers and fills them.
    ///
    /// # Errors
    /// [`GpuError::Scene`] where the scene is not valid, [`GpuError::Limit`] where it is too large for the device.
    pub fn upload(device: &Device, scene: &Scene) -> Result<Self, GpuError> {
        scene.validate()?;
        let mesh = &scene.mesh;
        let stride = vertex_stride(scene);
        let mut vertices = Vec::with_capacity(mesh.positions.len() * stride as usize);
        for (i, (position, normal)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
            let uv = mesh.uvs.get(i).copied().unwrap_or_default();
            vertices.push(Vec3Pad::new(*position, uv.x));
            vertices.push(Vec3Pad::new(*normal, uv.y));
            vertices.extend(mesh.colors.get(i).map(|color| Vec3Pad::new(*color, 0.0)));
        }
        let triangles: Vec<[u32; 4]> =
            mesh.triangles.iter().zip(&mesh.materials).map(|([a, b, c], m)| [*a, *b, *c, *m]).collect();
        let plan = TexelPlan::of(scene);
        let materials: Vec<_> = scene
            .materials
            .iter()
            .map(|m| MaterialUniform {
                base_color: m.base_color.to_array(),
                metallic: m.metallic,
                base_alpha: m.base_alpha,
                alpha_cutoff: match m.alpha_mode {
                    AlphaMode::Opaque => -1.0,
                    AlphaMode::Mask { cutoff } => cutoff,
                },
                base_color_texture: m
                    .base_color_texture
                    .map_or(TextureUniform::NONE, |t| plan.locate(scene, t)),
                metallic_roughness_texture: m
                    .metallic_roughness_texture
                    .filter(|_| m.metallic > 0.0)
                    .map_or(TextureUniform::NONE, |t| plan.locate(scene, t)),
                ..MaterialUniform::zeroed()
            })
            .collect();
        let mut order: Vec<_> =
            plan.first.iter().zip(&scene.textures).filter(|(first, _)| **first != UNUSED).collect();
        order.sort_by_key(|(first, _)| **first);
        let texels: Vec<[u16; 4]> = order.iter().flat_map(|(_, t)| &t.texels).copied().collect();
        let info = SceneInfo { vertex_stride: stride, triangles: triangles.len() as u32 };
        let triangle_count = info.triangles;
        let vertices = storage_buffer(device, "scene vertices", &vertices)?;
        let triangles = storage_buffer(device, "scene triangles", &triangles)?;
        let materials = storage_buffer(device, "scene materials", &materials)?;
        let texels = storage_buffer(device, "scene texels", &texels)?;
        let info = uniform_buffer(device, "scene info", &info);
        let names = [
            named("scene_vertices", &vertices),
            named("scene_triangles", &triangles),
            named("scene_materials", &materials),
            named("scene_texels", &texels),
            named("scene_info", &info),
        ];
        let group = bind_group(device, &scene_layout(device), "scene", scene_bindings(), &[&names])?;
        Ok(Self {
            vertices,
            triangles,
            materials,
            texels,
            info,
            group,
            triangle_count,
            masked: mesh
                .materials
                .iter()
                .any(|m| scene.materials[*m as usize].alpha_mode != AlphaMode::Opaque),
        })
    }

    /// Bind group 0 of every module with `core/scene.wgsl`; its layout is [`scene_layout`].
    #[must_use]
    pub const fn group(&self) -> &BindGroup {
        &self.group
    }

    /// Number of triangles.
    #[must_use]
    pub const fn triangles(&self) -> u32 {
        self.triangle_count
    }

    /// Whether any triangle has an alpha test.
    #[must_use]
    pub const fn is_masked(&self) -> bool {
        self.masked
    }

    /// GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        [&self.vertices, &self.triangles, &self.materials, &self.texels, &self.info]
            .map(Buffer::size)
            .iter()
            .sum()
    }
}
