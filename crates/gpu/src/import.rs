//! A renderer's own G-buffer, taken over.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3};
use indirect_core::{ClipView, Projection, View, octahedral};
use indirect_shaders::IMPORT;
use wgpu::{BindingResource, Queue, TextureView};

use crate::layout::ViewUniform;
use crate::{GBufferTarget, GpuError, Pass, PassTimer, Pipelines, buffers};

/// What the depth texture of a [`GBufferImport`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum DepthEncoding {
    /// NDC depth in `[0, 1]`, as the depth test leaves it; that of the far plane, 0 where the matrix reverses depth and 1 where
    /// not, is where nothing was drawn. `Depth32Float`, or a copy in any float format.
    #[default]
    Ndc,
    /// View depth, metres; 0 where nothing was drawn.
    View,
}

/// What the normal texture of a [`GBufferImport`] holds. A texel whose normal has no length is one that sees nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum NormalEncoding {
    /// The three components, of any length: `Rgba16Float`, `Rgba8Snorm`.
    #[default]
    Signed,
    /// The three components `n · ½ + ½`: `Rgb10a2Unorm`, `Rgba8Unorm`.
    Unorm,
    /// Two octahedral components in `[−1, 1]`: `Rg16Float`, `Rg16Snorm`. They cannot say that nothing is seen: depth must.
    Octahedral,
    /// Two octahedral components, from `[−1, 1]` to `[0, 1]`: `Rg16Unorm`, `Rg8Unorm`.
    OctahedralUnorm,
}

/// How a renderer encodes its G-buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GBufferFormat {
    /// What depth means.
    pub depth: DepthEncoding,
    /// What normals mean.
    pub normal: NormalEncoding,
    /// Normals are along the view's axes (right, up, backward) instead of the world's.
    pub view_space: bool,
    /// The albedo's components are encoded as sRGB in a texture whose format does not decode them. A format that ends in `Srgb`
    /// does.
    pub srgb: bool,
}

/// What one texel of a renderer's G-buffer says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImportedTexel {
    /// World position, metres.
    pub position: Vec3,
    /// View depth, metres.
    pub depth: f32,
    /// Unit normal.
    pub normal: Vec3,
    /// Lambertian albedo, linear, `[0, 1]`.
    pub albedo: Vec3,
}

impl GBufferFormat {
    /// What the texel `at` of an image of `size` texels says whose textures hold `depth`, `normal` and `albedo`; `None` where it
    /// sees nothing. The twin of `raster/import.wgsl`.
    #[must_use]
    pub fn texel(
        &self,
        clip: &ClipView,
        size: [u32; 2],
        at: [u32; 2],
        (depth, normal, albedo): (f32, Vec3, Vec3),
    ) -> Option<ImportedTexel> {
        let view = &clip.view;
        let depth = self.view_depth(clip, depth);
        let normal = self.world_normal(view, normal)?;
        if !(depth > 0.0 && depth < FARTHEST) {
            return None;
        }
        // The pixel at which the view, which has no jitter, sees the point.
        let image = Vec2::new(size[0] as f32, size[1] as f32);
        let shift = Vec2::new(clip.offset.x, -clip.offset.y) * 0.5 * image;
        let pixel = Vec2::new(at[0] as f32, at[1] as f32) + 0.5 - shift;
        let plane = view.plane_point(pixel, size);
        let scale = if matches!(view.projection, Projection::Orthographic { .. }) { 1.0 } else { depth };
        let lateral = (view.right * plane.x + view.up * plane.y) * scale;
        let albedo = albedo.clamp(Vec3::ZERO, Vec3::ONE);
        Some(ImportedTexel {
            position: view.origin + (view.forward * depth + lateral),
            depth,
            normal,
            albedo: if self.srgb { linear(albedo) } else { albedo },
        })
    }

    fn view_depth(&self, clip: &ClipView, z: f32) -> f32 {
        if self.depth == DepthEncoding::View {
            return z;
        }
        if z == background(clip) {
            return 0.0;
        }
        match clip.view.projection {
            Projection::Orthographic { .. } => (z - clip.shift) / clip.scale,
            Projection::Perspective { .. } => clip.scale / (z - clip.shift),
        }
    }

    fn world_normal(&self, view: &View, texel: Vec3) -> Option<Vec3> {
        use NormalEncoding::{Octahedral, OctahedralUnorm, Signed, Unorm};
        let n = match self.normal {
            Signed | Octahedral => texel,
            Unorm | OctahedralUnorm => texel * 2.0 - 1.0,
        };
        let n = match self.normal {
            Signed | Unorm => n,
            Octahedral | OctahedralUnorm => octahedral::decode(n.truncate().clamp(Vec2::NEG_ONE, Vec2::ONE)),
        };
        let squared = n.length_squared();
        if !(squared > 1e-6 && squared < 1e6) {
            return None;
        }
        let n = n / squared.sqrt();
        Some(if self.view_space { view.right * n.x + view.up * n.y - view.forward * n.z } else { n })
    }
}

/// What lies farther than this, metres, counts as nothing.
const FARTHEST: f32 = 1e30;

/// NDC depth where nothing was drawn.
const fn background(clip: &ClipView) -> f32 {
    if clip.reversed { 0.0 } else { 1.0 }
}

/// Linear components of an sRGB colour.
fn linear(c: Vec3) -> Vec3 {
    let component = |c: f32| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    Vec3::new(component(c.x), component(c.y), component(c.z))
}

indirect_core::wgsl_struct! {
    /// WGSL's `Import` (`raster/import.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[doc(hidden)]
    pub struct ImportUniform = "Import" {
        /// The view without jitter.
        pub view: ViewUniform,
        /// [`ClipView::offset`].
        pub offset: [f32; 2],
        /// [`ClipView::scale`].
        pub scale: f32,
        /// [`ClipView::shift`].
        pub shift: f32,
        /// NDC depth where nothing was drawn.
        pub background: f32,
        /// 0 NDC depth, 1 view depth.
        pub depth: u32,
        /// 0 components, 1 from `[0, 1]`, 2 octahedral, 3 octahedral from `[0, 1]`.
        pub normal: u32,
        /// 1 where normals are along the view's axes.
        pub view_space: u32,
        /// 1 where albedo is encoded as sRGB.
        pub srgb: u32,
        /// Fills the row.
        pub pad0: u32,
        /// Fills the row.
        pub pad1: u32,
        /// Fills the row.
        pub pad2: u32,
    }
}

impl ImportUniform {
    /// What the shader needs to know of a G-buffer of `size` texels.
    #[must_use]
    pub fn new(clip: &ClipView, size: [u32; 2], format: &GBufferFormat) -> Self {
        Self {
            view: ViewUniform::new(&clip.view, size, 0),
            offset: clip.offset.to_array(),
            scale: clip.scale,
            shift: clip.shift,
            background: background(clip),
            depth: match format.depth {
                DepthEncoding::Ndc => 0,
                DepthEncoding::View => 1,
            },
            normal: match format.normal {
                NormalEncoding::Signed => 0,
                NormalEncoding::Unorm => 1,
                NormalEncoding::Octahedral => 2,
                NormalEncoding::OctahedralUnorm => 3,
            },
            view_space: format.view_space.into(),
            srgb: format.srgb.into(),
            ..Self::zeroed()
        }
    }
}

buffers! {
    /// What a [`GBufferImport`] adds.
    struct ImportBuffers for () {
        /// Set by [`GBufferImport::prepare`].
        import_settings: ImportUniform;
    }
}

/// The textures of a renderer's G-buffer, all of one size, of formats that are not integers and have one sample per texel.
#[derive(Debug, Clone, Copy)]
pub struct GBufferTextures<'a> {
    /// Depth: red, or the depth aspect of a depth format.
    pub depth: &'a TextureView,
    /// Normals.
    pub normal: &'a TextureView,
    /// Lambertian albedo: base colour · (1 − metallic).
    pub albedo: &'a TextureView,
}

/// Fills a [`GBufferTarget`], that of a camera or of a light's map, from the textures that a renderer has anyway.
///
/// Made once for a set of textures; each frame [`Self::prepare`] sets the matrix and [`Self::encode`] adds one dispatch, before the
/// technique's passes and after the renderer's.
#[derive(Debug)]
pub struct GBufferImport {
    pass: Pass,
    buffers: ImportBuffers,
    format: GBufferFormat,
    size: [u32; 2],
}

impl GBufferImport {
    /// From `textures` into `target`.
    ///
    /// # Errors
    /// [`GpuError::Size`] where a texture is not of the target's size, [`GpuError::Texture`] where one cannot be read as floats.
    pub fn new(
        pipelines: &Pipelines,
        target: &GBufferTarget,
        textures: &GBufferTextures<'_>,
        format: GBufferFormat,
    ) -> Result<Self, GpuError> {
        let size = target.size();
        let named = [
            ("import_depth", textures.depth),
            ("import_normal", textures.normal),
            ("import_albedo", textures.albedo),
        ];
        for (name, view) in named {
            check(name, view, size)?;
        }
        let buffers = ImportBuffers::new(pipelines.device(), &())?;
        let textures = named.map(|(name, view)| (name, BindingResource::TextureView(view)));
        let mut pass = Pass::new("import");
        let texels = u64::from(size[0]) * u64::from(size[1]);
        let lists: [&[_]; 3] = [&buffers.named(), &textures, &target.results()];
        pass.compute(pipelines, (&IMPORT, "import_texels"), texels, &lists)?;
        Ok(Self { pass, buffers, format, size })
    }

    /// Sets the matrix that the textures were drawn with, jitter included, from the next submission on. Returns the view without the
    /// jitter: what techniques want to know of the camera.
    ///
    /// # Errors
    /// [`GpuError::ClipMatrix`] for a matrix that is none of a camera.
    pub fn prepare(&self, queue: &Queue, clip_from_world: &Mat4) -> Result<View, GpuError> {
        let clip = View::from_clip(clip_from_world)?;
        let uniform = ImportUniform::new(&clip, self.size, &self.format);
        queue.write_buffer(&self.buffers.import_settings, 0, bytemuck::bytes_of(&uniform));
        Ok(clip.view)
    }

    /// Encodes the pass.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, timer: &mut PassTimer) {
        self.pass.encode(encoder, timer, None);
    }
}

/// Whether a texture of the renderer can be read: of `size` texels, of floats, one sample each.
fn check(what: &'static str, view: &TextureView, size: [u32; 2]) -> Result<(), GpuError> {
    let texture = view.texture();
    let found = [texture.width(), texture.height()];
    if found != size {
        return Err(GpuError::Size { what, needed: size, found });
    }
    let format = texture.format();
    let aspect = format.has_depth_aspect().then_some(wgpu::TextureAspect::DepthOnly);
    let float = match format.sample_type(aspect, None) {
        Some(kind) => {
            matches!(kind, wgpu::TextureSampleType::Float { .. } | wgpu::TextureSampleType::Depth)
        }
        None => false,
    };
    if !float
        || texture.sample_count() != 1
        || !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING)
    {
        let found = format!("{format:?}, {} samples, {:?}", texture.sample_count(), texture.usage());
        return Err(GpuError::Texture { what, needed: "floats, 1 sample, TEXTURE_BINDING", found });
    }
    Ok(())
}
