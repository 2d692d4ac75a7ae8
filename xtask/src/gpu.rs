//! The GPU of a run, if there is one.

use indirect_core::Scene;
use indirect_gpu::wgpu::DeviceType;
use indirect_gpu::{AdapterChoice, Context, PassTimer, Raster, SceneBuffers};

use crate::failure::{Failure, Outcome};
use crate::setup;

/// A device, and the scene on it.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) context: Context,
    pub(crate) scene: SceneBuffers,
    pub(crate) raster: Raster,
}

impl Gpu {
    /// Uploads a scene to a device that is open.
    pub(crate) fn upload(context: Context, scene: &Scene) -> Outcome<Self> {
        let scene = SceneBuffers::upload(&context.device, scene)
            .map_err(|e| Failure::Check(format!("{}: {e}", context.info.name)))?;
        let raster = Raster::new(&context.device);
        Ok(Self { context, scene, raster })
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

/// Opens the adapter that `INDIRECT_ADAPTER` names; without it a software one before others, which gives the same results
/// on most machines. Its storage bindings may be at least `bytes` long.
pub(crate) fn context(bytes: u64) -> Outcome<Context> {
    Context::with_storage_binding(&AdapterChoice::from_env(), bytes)
        .map_err(|e| Failure::Check(format!("{}: {e}", setup::NO_ADAPTER)))
}

/// Opens a device, with storage bindings of at least `bytes`, and uploads the scene.
pub(crate) fn open(scene: &Scene, bytes: u64) -> Outcome<Gpu> {
    Gpu::upload(context(SceneBuffers::largest_binding(scene).max(bytes))?, scene)
}

/// One line about the adapter that [`open`] would open; `None` where there is none.
pub(crate) fn describe() -> Option<String> {
    Some(context(0).ok()?.describe())
}
