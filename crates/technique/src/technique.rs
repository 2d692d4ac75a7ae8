//! What a technique is: its types, what its frames are given, and its passes.

use indirect_core::settings::{BadOption, Settings};
use indirect_core::{GBuffer, Image, Scene, SceneProfile, View};
#[cfg(feature = "gpu")]
use indirect_gpu::{
    GBufferTarget, GpuError, Named, Pass, Pipelines,
    shaders::Module,
    wgpu::{Buffer, Queue},
};

#[cfg(feature = "gpu")]
use crate::gpu::exchange::Exchange;

/// A way to compute indirect light.
pub trait Technique: Sized + 'static {
    /// Its name, for command lines and reports.
    const NAME: &'static str;
    /// Names of the passes that make the maps of the lights; empty for a technique that has none.
    const MAP_PASSES: &'static [&'static str] = &[];
    /// What is fixed when buffers are made.
    type Options: Settings + PartialEq;
    /// What may change from frame to frame.
    type Params: Settings + PartialEq;
    /// Both, and what was fitted to the scene.
    type Setup: Clone;
    /// Everything that frames compute on the CPU, the image among it.
    type Output: Default;
    /// What the lengths of GPU buffers follow from; `()` without the feature `gpu`.
    type Sizes;
    /// The GPU buffers; `()` without the feature `gpu`.
    type Buffers;
    /// What can go wrong.
    type Error: core::error::Error + From<BadOption>;

    /// The settings that a scene of this kind is best given, before a person changes them.
    #[must_use]
    fn for_scene(_profile: &SceneProfile) -> (Self::Options, Self::Params) {
        Default::default()
    }

    /// The options of a setup.
    fn options(setup: &Self::Setup) -> &Self::Options;

    /// The passes of a frame, in order.
    fn rows() -> Vec<Row<Self>>;

    /// The image of a frame: indirect radiance that leaves each pixel, W/(sr·m²).
    fn image(output: &Self::Output) -> &Image;

    /// Memory of a frame on the CPU, bytes.
    fn output_bytes(output: &Self::Output) -> u64;
}

/// What a frame on the CPU is given.
#[derive(Debug)]
pub struct Frame<'a, S> {
    /// The scene, for rays.
    #[cfg(feature = "cpu")]
    pub accel: &'a indirect_accel::Accel<'a>,
    /// The scene.
    pub scene: &'a Scene,
    /// The camera.
    pub view: &'a View,
    /// What the camera sees.
    pub camera: &'a GBuffer,
    /// Settings, and what was fitted to the scene.
    pub setup: &'a S,
}

// Derived ones would ask the same of `S`.
impl<S> Clone for Frame<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for Frame<'_, S> {}

/// What a row is given to add its steps.
#[cfg(feature = "gpu")]
pub struct Build<'a, T: Technique> {
    /// Pipelines by module and entry point.
    pub pipelines: &'a Pipelines,
    /// For what is written once.
    pub queue: &'a Queue,
    /// Lengths of the buffers.
    pub sizes: &'a T::Sizes,
    /// The buffers.
    pub buffers: &'a T::Buffers,
    /// Settings, and what was fitted to the scene.
    pub setup: &'a T::Setup,
    /// What the camera sees.
    pub camera: &'a GBufferTarget,
    pub(crate) named: Vec<Named<'a>>,
}

#[cfg(feature = "gpu")]
impl<T: Technique> Build<'_, T> {
    /// [`Pass::compute`] with the technique's named buffers, behind which `own` are looked up first.
    ///
    /// # Errors
    /// As there.
    pub fn compute(
        &self,
        pass: &mut Pass,
        entry: (&Module, &'static str),
        invocations: u64,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        pass.compute(self.pipelines, entry, invocations, &[&self.named, own])
    }

    /// [`Pass::compute_indirect`], likewise.
    ///
    /// # Errors
    /// As there.
    pub fn compute_indirect(
        &self,
        pass: &mut Pass,
        entry: (&Module, &'static str),
        arguments: (&Buffer, u64),
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        pass.compute_indirect(self.pipelines, entry, arguments, &[&self.named, own])
    }

    /// What kernels bind by name where a pass does not say otherwise: the technique's buffers.
    #[must_use]
    pub fn named(&self) -> &[Named<'_>] {
        &self.named
    }
}

type CpuFn<T> = fn(&Frame<'_, <T as Technique>::Setup>, &mut <T as Technique>::Output, u32);
#[cfg(feature = "gpu")]
type GpuFn<T> = fn(&Build<'_, T>, &mut Pass, u32) -> Result<(), GpuError>;
#[cfg(feature = "gpu")]
type DataFn<T> = fn(&<T as Technique>::Buffers, &mut <T as Technique>::Output, &mut Exchange<'_>, u32);

/// A pass, registered once; [`passes!`](crate::passes) makes the rows of a technique.
pub struct Row<T: Technique> {
    name: &'static str,
    times: fn(&T::Setup) -> u32,
    cpu: Option<CpuFn<T>>,
    #[cfg(feature = "gpu")]
    gpu: Option<GpuFn<T>>,
    #[cfg(feature = "gpu")]
    data: Option<DataFn<T>>,
}

impl<T: Technique> Row<T> {
    /// A pass that does nothing yet. `times` says how often it runs in a frame, 0 where the setup does not ask for it; each run
    /// has a number, from 0.
    #[must_use]
    pub const fn new(name: &'static str, times: fn(&T::Setup) -> u32) -> Self {
        Self {
            name,
            times,
            cpu: None,
            #[cfg(feature = "gpu")]
            gpu: None,
            #[cfg(feature = "gpu")]
            data: None,
        }
    }

    /// Its CPU function: computes results from those of the passes before.
    #[must_use]
    pub const fn cpu(mut self, cpu: CpuFn<T>) -> Self {
        self.cpu = Some(cpu);
        self
    }

    /// What adds its steps on the GPU.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub const fn gpu(mut self, gpu: GpuFn<T>) -> Self {
        self.gpu = Some(gpu);
        self
    }

    /// What names the buffers that hold its results beside their places in the output.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub const fn data(mut self, data: DataFn<T>) -> Self {
        self.data = Some(data);
        self
    }

    /// Its name, the same on both backends.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// How often it runs in a frame of this setup.
    #[must_use]
    pub fn times(&self, setup: &T::Setup) -> u32 {
        (self.times)(setup)
    }

    /// Runs it on the CPU.
    pub fn run_cpu(&self, frame: &Frame<'_, T::Setup>, output: &mut T::Output, number: u32) {
        if let Some(cpu) = self.cpu {
            cpu(frame, output, number);
        }
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn build(&self, build: &Build<'_, T>, number: u32) -> Result<Pass, GpuError> {
        let mut pass = Pass::new(self.name);
        if let Some(gpu) = self.gpu {
            gpu(build, &mut pass, number)?;
        }
        Ok(pass)
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn exchange(
        &self,
        buffers: &T::Buffers,
        output: &mut T::Output,
        exchange: &mut Exchange<'_>,
        number: u32,
    ) {
        if let Some(data) = self.data {
            exchange.begin(self.name);
            data(buffers, output, exchange, number);
        }
    }
}

/// The rows of a technique: `passes!(Technique, [Row { name: …, times: …, cpu: …, gpu: …, data: … }, …])`, see [`Row`]. Where the
/// caller's own features `cpu` or `gpu` are off, their parts are left out.
#[macro_export]
macro_rules! passes {
    ($technique:ty, [$(Row {
        name: $name:expr, times: $times:expr, cpu: $cpu:expr, gpu: $gpu:expr, data: $data:expr $(,)?
    }),* $(,)?]) => {
        vec![$({
            let row = $crate::Row::<$technique>::new($name, $times);
            #[cfg(feature = "cpu")]
            let row = row.cpu($cpu);
            #[cfg(feature = "gpu")]
            let row = row.gpu($gpu);
            #[cfg(all(feature = "cpu", feature = "gpu"))]
            let row = row.data($data);
            row
        }),*]
    };
}
