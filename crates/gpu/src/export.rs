//! An image where a renderer wants it.

use indirect_shaders::EXPORT;
use wgpu::{BindingResource, Buffer, TextureFormat, TextureUsages, TextureView};

use crate::{GpuError, Pass, PassTimer, Pipelines, named, uniform_buffer};

/// Copies the image of a technique, `array<vec4<f32>>`, into a texture of the renderer, to be added to its direct light.
///
/// A renderer that reads storage buffers needs none of this: it binds the technique's image.
#[derive(Debug)]
pub struct ImageExport {
    pass: Pass,
}

impl ImageExport {
    /// From `image`, row-major, top row first, into all of `texture`: `Rgba16Float` with the usage `STORAGE_BINDING`. Alpha becomes
    /// 1; what is beyond the largest half float, 65504, becomes that.
    ///
    /// # Errors
    /// [`GpuError::Texture`] for a texture of another format or usage, [`GpuError::Size`] where the image has not as many texels.
    pub fn new(pipelines: &Pipelines, image: &Buffer, texture: &TextureView) -> Result<Self, GpuError> {
        let target = texture.texture();
        let size = [target.width(), target.height()];
        let fits = target.format() == TextureFormat::Rgba16Float
            && target.usage().contains(TextureUsages::STORAGE_BINDING);
        if !fits {
            let found = format!("{:?}, {:?}", target.format(), target.usage());
            return Err(GpuError::Texture {
                what: "export_texture",
                needed: "Rgba16Float, STORAGE_BINDING",
                found,
            });
        }
        let texels = u64::from(size[0]) * u64::from(size[1]);
        if image.size() != 16 * texels {
            let found = [(image.size() / 16) as u32, 1];
            return Err(GpuError::Size { what: "the image to export", needed: size, found });
        }
        let uniform = uniform_buffer(pipelines.device(), "export_size", &size);
        let names = [
            named("export_size", &uniform),
            named("image", image),
            ("export_texture", BindingResource::TextureView(texture)),
        ];
        let mut pass = Pass::new("export");
        pass.compute(pipelines, (&EXPORT, "export_texels"), texels, &[&names])?;
        Ok(Self { pass })
    }

    /// Encodes the pass.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, timer: &mut PassTimer) {
        self.pass.encode(encoder, timer, None);
    }
}
