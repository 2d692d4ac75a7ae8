use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use indirect_shaders::Module;
use wgpu::Device;

use crate::{Kernel, Raster};

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

    /// The pipeline of an entry point.
    #[must_use]
    pub fn kernel(&self, module: &Module, entry_point: &'static str) -> Kernel {
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        let new = || Kernel::new(&self.device, module, entry_point, &[]);
        kernels.entry((module.name, entry_point)).or_insert_with(new).clone()
    }
}
