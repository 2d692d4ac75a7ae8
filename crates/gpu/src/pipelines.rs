use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use indirect_shaders::Module;
use wgpu::Device;

use crate::{Kernel, Raster, scene_layout};

/// All pipelines that techniques ask for on one device. Each is compiled when it is first asked for and kept.
#[derive(Debug)]
pub struct Pipelines {
    device: Device,
    raster: Raster,
    kernels: Mutex<HashMap<(&'static str, &'static str), Kernel>>,
}

impl Pipelines {
    /// No kernels yet, and the raster.
    #[must_use]
    pub fn new(device: &Device) -> Self {
        Self { device: device.clone(), raster: Raster::new(device), kernels: Mutex::default() }
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &Device {
        &self.device
    }

    /// What draws cameras and maps.
    #[must_use]
    pub const fn raster(&self) -> &Raster {
        &self.raster
    }

    /// The pipeline of an entry point. One that binds anything in group 1 has the scene in group 0, bound by
    /// [`SceneBuffers::group`](crate::SceneBuffers::group).
    #[must_use]
    pub fn kernel(&self, module: &Module, entry_point: &'static str) -> Kernel {
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        let beside_scene =
            module.entry_point(entry_point).is_some_and(|e| e.bindings.iter().any(|b| b.group == 1));
        let new = || {
            if beside_scene {
                Kernel::with_shared(&self.device, module, entry_point, &scene_layout(&self.device))
            } else {
                Kernel::new(&self.device, module, entry_point, &[])
            }
        };
        kernels.entry((module.name, entry_point)).or_insert_with(new).clone()
    }
}
