//! The GPU of a run, if there is one.

use std::rc::Rc;

use indirect_core::Scene;
use indirect_gpu::wgpu::{DeviceType, Limits};
use indirect_gpu::{AdapterChoice, Context, GpuError, PassTimer, Pipelines, SceneBuffers};

use crate::failure::{Failure, Outcome};
use crate::setup;

/// A device, and the pipelines that techniques share on it.
#[derive(Debug, Clone)]
pub(crate) struct Device {
    pub(crate) context: Context,
    pub(crate) pipelines: Rc<Pipelines>,
}

impl Device {
    /// Opens the adapter that `INDIRECT_ADAPTER` names; without it a software one before others, which gives the same results
    /// on most machines. It has at least these limits.
    pub(crate) fn open(limits: &Limits) -> Outcome<Self> {
        let context = context(limits)?;
        let pipelines = Rc::new(Pipelines::new(&context.device));
        Ok(Self { context, pipelines })
    }

    /// A clock for passes. Software adapters execute some time after they stamp: there only the wall clock is right.
    pub(crate) fn timer(&self) -> PassTimer {
        let Context { device, queue, info } = &self.context;
        if info.device_type == DeviceType::Cpu {
            PassTimer::wall(device, queue)
        } else {
            PassTimer::new(device, queue)
        }
    }
}

fn context(limits: &Limits) -> Outcome<Context> {
    Context::with_limits(&AdapterChoice::from_env(), limits).map_err(|e| match e {
        // There is one, but not for this scene with these settings.
        GpuError::Limit { .. } => Failure::Input(format!("the GPU adapter is too small for this: {e}")),
        e => Failure::Check(format!("{}: {e}", setup::NO_ADAPTER)),
    })
}

/// A device, and the scene on it.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) device: Device,
    pub(crate) scene: SceneBuffers,
}

impl Gpu {
    /// Uploads a scene to a device that is open.
    pub(crate) fn upload(device: Device, scene: &Scene) -> Outcome<Self> {
        let scene = SceneBuffers::upload(&device.context.device, scene)
            .map_err(|e| Failure::Check(format!("{}: {e}", device.context.info.name)))?;
        Ok(Self { device, scene })
    }
}

/// Opens a device with at least these limits that can hold the scene, and uploads it.
pub(crate) fn open(scene: &Scene, limits: &Limits) -> Outcome<Gpu> {
    Gpu::upload(Device::open(&with_scene(limits, scene))?, scene)
}

/// The larger of both limits, of each kind that matters here.
pub(crate) fn larger(a: &Limits, b: &Limits) -> Limits {
    Limits {
        max_storage_buffer_binding_size: a
            .max_storage_buffer_binding_size
            .max(b.max_storage_buffer_binding_size),
        max_buffer_size: a.max_buffer_size.max(b.max_buffer_size),
        max_texture_dimension_2d: a.max_texture_dimension_2d.max(b.max_texture_dimension_2d),
        ..a.clone()
    }
}

/// These limits, and those that the scene's buffers need.
pub(crate) fn with_scene(limits: &Limits, scene: &Scene) -> Limits {
    let bytes = SceneBuffers::largest_binding(scene);
    let scene =
        Limits { max_storage_buffer_binding_size: bytes, max_buffer_size: bytes, ..Limits::default() };
    larger(limits, &scene)
}

/// One line about the adapter that [`open`] would open; `None` where there is none.
pub(crate) fn describe() -> Option<String> {
    Some(context(&Limits::default()).ok()?.describe())
}
