use bytemuck::Zeroable;
use core::ops::Range;

use indirect_core::{AlphaMode, Mesh, Scene, Texture, TextureRef, Wrap};
use indirect_shaders::{Binding, RESOLVE};
use wgpu::{BindGroup, BindGroupLayout, Buffer, Device, Queue, ShaderStages};

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
    vertex_count: u32,
    vertex_stride: u32,
    masked: bool,
}

/// The layout of a scene's bind group, the same in every stage.
#[must_use]
pub fn scene_layout(device: &Device) -> BindGroupLayout {
    let entry = RESOLVE.entry_point("resolve");
    bind_group_layout(device, 0, entry.as_slice(), ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE)
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

fn vertex_data(mesh: &Mesh, vertices: Range<usize>) -> Vec<Vec3Pad> {
    let mut data = Vec::with_capacity(vertices.len() * 3);
    for i in vertices {
        let uv = mesh.uvs.get(i).copied().unwrap_or_default();
        data.push(Vec3Pad::new(mesh.positions[i], uv.x));
        data.push(Vec3Pad::new(mesh.normals[i], uv.y));
        data.extend(mesh.colors.get(i).map(|color| Vec3Pad::new(*color, 0.0)));
    }
    data
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
        let vertices = vertex_data(mesh, 0..mesh.positions.len());
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
            vertex_count: mesh.positions.len() as u32,
            vertex_stride: stride,
            masked: mesh
                .materials
                .iter()
                .any(|m| scene.materials[*m as usize].alpha_mode != AlphaMode::Opaque),
        })
    }

    /// Overwrites `vertices` with what `mesh` has there now, from the next submission on: for objects whose vertices move among
    /// themselves. The mesh is the one that was uploaded, moved. See [`MovingObjects`](crate::MovingObjects) for those that move
    /// as a whole.
    ///
    /// # Errors
    /// [`GpuError::Vertices`] for vertices that the mesh or the scene does not have.
    pub fn update(&self, queue: &Queue, mesh: &Mesh, vertices: Range<u32>) -> Result<(), GpuError> {
        let Range { start, end } = vertices;
        let count = self.vertex_count;
        let same = mesh.positions.len() == count as usize && mesh.normals.len() == count as usize;
        if !same || start > end || end > count || mesh.colors.is_empty() == (self.vertex_stride == 3) {
            return Err(GpuError::Vertices { range: vertices, count });
        }
        let data = vertex_data(mesh, start as usize..end as usize);
        let at = u64::from(start) * u64::from(self.vertex_stride) * size_of::<Vec3Pad>() as u64;
        queue.write_buffer(&self.vertices, at, bytemuck::cast_slice(&data));
        Ok(())
    }

    /// The vertices, `array<vec4<f32>>`, [`Self::vertex_stride`] to a vertex: position, normal and, where the scene has them, colour;
    /// the fourth components of the first two are the texture coordinates.
    #[must_use]
    pub const fn vertex_buffer(&self) -> &Buffer {
        &self.vertices
    }

    /// Groups of four floats per vertex.
    #[must_use]
    pub const fn vertex_stride(&self) -> u32 {
        self.vertex_stride
    }

    /// Number of vertices.
    #[must_use]
    pub const fn vertices(&self) -> u32 {
        self.vertex_count
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
