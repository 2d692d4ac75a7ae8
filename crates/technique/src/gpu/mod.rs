//! Frames on the GPU. The caller owns device, queue and encoder; nothing here submits or blocks but [`run_both`], which is for
//! tools.

mod both;
pub(crate) mod exchange;

use indirect_core::settings::BadOption;
use indirect_core::{Light, MapView, View};
use indirect_gpu::wgpu::{Buffer, CommandEncoder, Device, Limits, Queue};
use indirect_gpu::{GBufferTarget, GpuError, Named, Pass, PassTimer, Pipelines, Plan, SceneBuffers};

pub use both::{Backend, camera_twins, run_both, run_both_after, twins};
pub use exchange::{Data, Exchange, Twin};

pub use crate::technique::Build;

use crate::Technique;

/// A technique that runs on the GPU.
pub trait GpuTechnique: Technique<Error: From<GpuError>> {
    /// The maps of the lights, `rsm::gpu::Maps`; `()` for a technique that has none.
    type Maps;

    /// What the lengths of buffers follow from, for an image of `size` pixels and so many maps of lights.
    fn sizes(setup: &Self::Setup, size: [u32; 2], maps: usize) -> Self::Sizes;

    /// All buffers and textures, those of the maps among them.
    fn plan(sizes: &Self::Sizes) -> Plan;

    /// Makes them, and fills those that never change.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    fn allocate(
        device: &Device,
        queue: &Queue,
        sizes: &Self::Sizes,
        setup: &Self::Setup,
    ) -> Result<Self::Buffers, GpuError>;

    /// Buffers for an image of another size: those of `old`, with what they hold, that do not depend on it, and new ones. `probe` is
    /// what `sizes` would be for an image of yet another size: what is of the same length there does not depend on it.
    ///
    /// # Errors
    /// As [`Self::allocate`].
    fn resize(
        old: &Self::Buffers,
        device: &Device,
        queue: &Queue,
        sizes: [&Self::Sizes; 2],
        setup: &Self::Setup,
    ) -> Result<Self::Buffers, GpuError>;

    /// The maps of the lights, to be filled by a renderer that has its own; `()` for a technique that has none.
    fn maps(buffers: &Self::Buffers) -> &Self::Maps;

    /// What kernels bind by name where a pass does not say otherwise.
    fn named(buffers: &Self::Buffers) -> Vec<Named<'_>>;

    /// Writes what changes from frame to frame.
    ///
    /// # Errors
    /// Where parameters are out of range, or lights and views do not fit the buffers.
    fn prepare(
        buffers: &mut Self::Buffers,
        queue: &Queue,
        inputs: &Inputs<'_>,
        setup: &Self::Setup,
    ) -> Result<(), Self::Error>;

    /// Overwrites what is kept of the frame before by what `past`, the output of that frame, keeps of it; forgets it where that
    /// keeps nothing. For techniques that look back.
    fn restore(_buffers: &Self::Buffers, _queue: &Queue, _past: &Self::Output) {}

    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel, W/(sr·m²), and 0.
    fn image_buffer(buffers: &Self::Buffers) -> &Buffer;
}

/// What a frame on the GPU is given, beside the scene and the camera's G-buffer.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The scene's lights.
    pub lights: &'a [Light],
    /// The windows through which they see the scene.
    pub views: &'a [MapView],
    /// The camera.
    pub camera: &'a View,
}

/// Buffers and passes of a technique for one image size and number of maps; every intermediate result can be read back.
pub struct Resources<T: GpuTechnique> {
    /// The buffers.
    pub buffers: T::Buffers,
    /// In order, with the number of the row and of its run.
    passes: Vec<(usize, u32, Pass)>,
    options: T::Options,
    camera: GBufferTarget,
    maps: usize,
    bytes: u64,
}

impl<T: GpuTechnique> Resources<T> {
    /// What will be allocated.
    #[must_use]
    pub fn plan(setup: &T::Setup, size: [u32; 2], maps: usize) -> Plan {
        T::plan(&T::sizes(setup, size, maps))
    }

    /// The limits that a device must have for an image of `size` pixels and so many maps: WebGPU's defaults, raised where a
    /// buffer is larger.
    #[must_use]
    pub fn required_limits(setup: &T::Setup, size: [u32; 2], maps: usize) -> Limits {
        Self::plan(setup, size, maps).required_limits()
    }

    /// Buffers for `maps` maps, as many as the lights have views, and the pixels of `camera`, whose buffers they refer to from
    /// now on. Pipelines that are not there yet are compiled.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where the device cannot hold them.
    pub fn new(
        pipelines: &Pipelines,
        queue: &Queue,
        setup: &T::Setup,
        maps: usize,
        camera: &GBufferTarget,
    ) -> Result<Self, T::Error> {
        let device = pipelines.device();
        let sizes = T::sizes(setup, camera.size(), maps);
        T::plan(&sizes).check(&device.limits())?;
        let buffers = T::allocate(device, queue, &sizes, setup)?;
        Self::from_buffers(pipelines, queue, setup, (maps, sizes), buffers, camera)
    }

    /// Follows the image of `camera`, which may be of another size than before. What does not depend on the size is kept with what it
    /// holds: maps, photons, points, whatever was made of the scene; the history of the image is forgotten. [`Self::prepare`] must be
    /// called before the next [`Self::encode`].
    ///
    /// # Errors
    /// As [`Self::new`], and a [`BadOption`] as [`Self::prepare`]; nothing has changed then.
    pub fn resize(
        &mut self,
        pipelines: &Pipelines,
        queue: &Queue,
        setup: &T::Setup,
        camera: &GBufferTarget,
    ) -> Result<(), T::Error> {
        self.check_options(setup)?;
        let device = pipelines.device();
        let [width, height] = camera.size();
        let sizes = T::sizes(setup, camera.size(), self.maps);
        T::plan(&sizes).check(&device.limits())?;
        // An image whose pixels, blocks and tiles are all of another number.
        let probe = T::sizes(setup, [2 * width + 64, 2 * height + 64], self.maps);
        let buffers = T::resize(&self.buffers, device, queue, [&sizes, &probe], setup)?;
        *self = Self::from_buffers(pipelines, queue, setup, (self.maps, sizes), buffers, camera)?;
        Ok(())
    }

    fn from_buffers(
        pipelines: &Pipelines,
        queue: &Queue,
        setup: &T::Setup,
        (maps, sizes): (usize, T::Sizes),
        buffers: T::Buffers,
        camera: &GBufferTarget,
    ) -> Result<Self, T::Error> {
        let mut passes = Vec::new();
        {
            let mut named: Vec<_> = camera.named().into();
            named.extend(T::named(&buffers));
            let build = Build { pipelines, queue, sizes: &sizes, buffers: &buffers, setup, camera, named };
            for (i, row) in T::rows().iter().enumerate() {
                for number in 0..row.times(setup) {
                    passes.push((i, number, row.build(&build, number)?));
                }
            }
        }
        let options = T::options(setup).clone();
        Ok(Self { buffers, passes, options, camera: camera.clone(), maps, bytes: T::plan(&sizes).bytes() })
    }

    /// Sets what changes from frame to frame: lights and their views, the camera, parameters. Call it before the first
    /// [`Self::encode`], and again when something changes.
    ///
    /// # Errors
    /// A [`BadOption`] where the setup's options are not those that the buffers were made for, and as [`GpuTechnique::prepare`].
    pub fn prepare(&mut self, queue: &Queue, inputs: &Inputs<'_>, setup: &T::Setup) -> Result<(), T::Error> {
        self.check_options(setup)?;
        T::prepare(&mut self.buffers, queue, inputs, setup)
    }

    fn check_options(&self, setup: &T::Setup) -> Result<(), BadOption> {
        if *T::options(setup) == self.options {
            return Ok(());
        }
        Err(BadOption::new("options", "changed", "what the resources were made with: make new ones"))
    }

    /// All passes of a frame: from the scene and what [`Self::prepare`] was given to the indirect light of the camera's pixels.
    pub fn encode(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, scene: &SceneBuffers) {
        self.passes().for_each(|pass| pass.encode(encoder, timer, Some(scene)));
    }

    /// [`Self::encode`] without the passes whose names `skip` accepts, for renderers that have made their results already. What is
    /// left may need the scene, for rays for instance; without one, passes that draw or look at it do nothing.
    pub fn encode_without(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: Option<&SceneBuffers>,
        skip: impl Fn(&str) -> bool,
    ) {
        self.passes().filter(|p| !skip(p.name())).for_each(|pass| pass.encode(encoder, timer, scene));
    }

    /// [`Self::encode`] for a renderer that has filled the surfaces of [`Self::maps`] from its own shadow maps, by a
    /// [`GBufferImport`](indirect_gpu::GBufferImport) for instance; the light in them is computed.
    pub fn encode_from_surfaces(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: Option<&SceneBuffers>,
    ) {
        self.encode_without(encoder, timer, scene, |pass| T::MAP_PASSES.first() == Some(&pass));
    }

    /// [`Self::encode`] for a renderer that has filled all of [`Self::maps`], the light in them and its pyramids included.
    pub fn encode_from_maps(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: Option<&SceneBuffers>,
    ) {
        self.encode_without(encoder, timer, scene, |pass| T::MAP_PASSES.contains(&pass));
    }

    /// The maps of the lights.
    #[must_use]
    pub fn maps(&self) -> &T::Maps {
        T::maps(&self.buffers)
    }

    /// The passes in order.
    pub fn passes(&self) -> impl Iterator<Item = &Pass> {
        self.passes.iter().map(|(.., pass)| pass)
    }

    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel, W/(sr·m²), and 0.
    #[must_use]
    pub fn image(&self) -> &Buffer {
        T::image_buffer(&self.buffers)
    }

    /// GPU memory, bytes, without the camera's G-buffer.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }
}
