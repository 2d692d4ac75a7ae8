//! Structs as the shaders of `core/*.wgsl` lay them out.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use indirect_core::{Projection, View};

/// A [`Vec3`] that takes 16 bytes, as WGSL's `vec4<f32>` does.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Vec3Pad {
    /// The vector.
    pub xyz: [f32; 3],
    /// The fourth component.
    pub w: f32,
}

impl Vec3Pad {
    /// A vector and its fourth component.
    #[must_use]
    pub const fn new(v: Vec3, w: f32) -> Self {
        Self { xyz: v.to_array(), w }
    }

    /// The first three components.
    #[must_use]
    pub const fn vec3(self) -> Vec3 {
        Vec3::from_array(self.xyz)
    }
}

indirect_core::wgsl_struct! {
    /// A [`View`] onto an image of a given size: WGSL's `View` (`core/view.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct ViewUniform = "View" {
        /// [`View::origin`].
        pub origin: [f32; 3],
        /// [`View::near`].
        pub near: f32,
        /// [`View::right`].
        pub right: [f32; 3],
        /// 1 for parallel rays, 0 for rays from the origin.
        pub orthographic: u32,
        /// [`View::up`].
        pub up: [f32; 3],
        /// Clip z = view depth · `depth_scale` + `depth_offset`.
        pub depth_scale: f32,
        /// [`View::forward`].
        pub forward: [f32; 3],
        /// See `depth_scale`.
        pub depth_offset: f32,
        /// Half the image plane: tangents (perspective) or metres (orthographic).
        pub half_extent: [f32; 2],
        /// Width and height, texels.
        pub size: [u32; 2],
        /// Index of the view's first texel in buffers that hold several views.
        pub first_texel: u32,
        /// Unused.
        pub pad: u32,
        /// Where in the render targets its image begins, texels.
        pub tile: [u32; 2],
    }
}

impl ViewUniform {
    /// `view` onto an image of `size` texels, which begins at `first_texel` in the buffers that hold it.
    #[must_use]
    pub fn new(view: &View, size: [u32; 2], first_texel: u32) -> Self {
        let (near, far) = (view.near, view.far);
        // As `View::clip_from_world`: 1 at the near plane, 0 at the far one.
        let (half, orthographic, depth_scale, depth_offset) = match view.projection {
            Projection::Perspective { tan_half } if far.is_finite() => {
                (tan_half, 0, -near / (far - near), near * far / (far - near))
            }
            Projection::Perspective { tan_half } => (tan_half, 0, 0.0, near),
            Projection::Orthographic { half_size } => {
                let scale = 1.0 / (far - near);
                (half_size, 1, -scale, far * scale)
            }
        };
        Self {
            origin: view.origin.to_array(),
            near,
            right: view.right.to_array(),
            orthographic,
            up: view.up.to_array(),
            depth_scale,
            forward: view.forward.to_array(),
            depth_offset,
            half_extent: Vec2::to_array(&half),
            size,
            first_texel,
            pad: 0,
            tile: [0; 2],
        }
    }
}

indirect_core::wgsl_struct! {
    /// A texture and its place among the texels: WGSL's `TextureRef` (`core/texture.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct TextureUniform = "TextureRef" {
        /// Linear part of the transform of texture coordinates, by columns.
        pub transform: [f32; 4],
        /// Its translation.
        pub translation: [f32; 2],
        /// Width and height, texels.
        pub size: [u32; 2],
        /// Wrap mode of u and v: 0 repeat, 1 mirror, 2 clamp.
        pub wrap: [u32; 2],
        /// Index of the first texel, or [`NO_TEXTURE`].
        pub first_texel: u32,
        /// Unused.
        pub pad: u32,
    }
}

/// [`TextureUniform::first_texel`] where there is no texture.
pub const NO_TEXTURE: u32 = u32::MAX;

impl TextureUniform {
    /// No texture.
    pub const NONE: Self = Self {
        transform: [0.0; 4],
        translation: [0.0; 2],
        size: [0; 2],
        wrap: [0; 2],
        first_texel: NO_TEXTURE,
        pad: 0,
    };
}

indirect_core::wgsl_struct! {
    /// WGSL's `Material` (`core/scene.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct MaterialUniform = "Material" {
        /// Linear base colour.
        pub base_color: [f32; 3],
        /// `[0, 1]`.
        pub metallic: f32,
        /// Alpha factor.
        pub base_alpha: f32,
        /// Texels of less alpha are holes; negative where the material is opaque.
        pub alpha_cutoff: f32,
        /// Unused.
        pub pad: [u32; 2],
        /// Multiplies the base colour and alpha.
        pub base_color_texture: TextureUniform,
        /// Its blue channel multiplies `metallic`.
        pub metallic_roughness_texture: TextureUniform,
    }
}

indirect_core::wgsl_struct! {
    /// WGSL's `SceneInfo` (`core/scene.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
    pub struct SceneInfo = "SceneInfo" {
        /// Groups of four floats per vertex.
        pub vertex_stride: u32,
        /// Number of triangles.
        pub triangles: u32,
    }
}
