//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. `trace` binds seven storage buffers: the scene in group 0, four, and the tree for rays and the photons in
//! group 1; whoever reads photons declares
//!
//! ```wgsl
//! @group(…) @binding(…) var<storage, read> photons: array<Photon>;
//! ```
//!
//! and includes `photons/layout.wgsl`. WebGPU's default limits (bindings of 128 MiB) suffice for 2.1 million photons.

use indirect_gpu::shaders::{PHOTONS_EMIT, PHOTONS_TRACE};
use indirect_gpu::wgpu::{Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Pipelines, Plan, buffers};

use crate::layout::{Emitter, Photon, PhotonSettings, PunctualLight};
use crate::sources::{Params, Sources};

/// What the lengths of buffers follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PhotonSizes {
    /// Photons to emit.
    pub photons: u32,
    /// Room for emissive triangles.
    pub emitters: u32,
    /// Room for punctual lights.
    pub lights: u32,
}

impl PhotonSizes {
    /// Room for `photons` photons of these sources, and for the lights of a scene that has `lights` of them, black ones included.
    #[must_use]
    pub fn new(sources: &Sources, photons: u32, lights: usize) -> Self {
        let emitters = sources.emitters().len() as u32;
        Self { photons, emitters, lights: lights.max(sources.lights().len()) as u32 }
    }
}

buffers! {
    /// Buffers of [`Photons`], named as `photons/*.wgsl` names them.
    pub struct PhotonBuffers for PhotonSizes {
        /// The photons, in place.
        photons: [Photon] = |s| s.photons.into();
        /// Emissive triangles.
        emitters: [Emitter] = |s| s.emitters.into();
        /// Punctual lights.
        photon_lights: [PunctualLight] = |s| s.lights.into();
        /// What both passes read.
        photon_settings: PhotonSettings;
    }
}

/// Photons on the GPU.
#[derive(Debug, Clone)]
pub struct Photons {
    /// The buffers.
    pub buffers: PhotonBuffers,
    sizes: PhotonSizes,
}

impl Photons {
    /// What will be allocated.
    #[must_use]
    pub fn plan(sizes: &PhotonSizes) -> Plan {
        PhotonBuffers::plan(sizes)
    }

    /// Buffers for photons and sources, zeroed: no photons until [`Self::write_lights`].
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, sizes: PhotonSizes) -> Result<Self, GpuError> {
        Ok(Self { buffers: PhotonBuffers::new(device, &sizes)?, sizes })
    }

    /// What there is room for.
    #[must_use]
    pub const fn sizes(&self) -> &PhotonSizes {
        &self.sizes
    }

    /// Uploads the emissive triangles: at the beginning, and whenever the geometry changed; [`Self::write_lights`] must follow.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where they are more than there is room for.
    pub fn write_emitters(&self, queue: &Queue, sources: &Sources) -> Result<(), GpuError> {
        let emitters = sources.emitters();
        fits("emitters", emitters.len(), self.sizes.emitters)?;
        queue.write_buffer(&self.buffers.emitters, 0, bytemuck::cast_slice(emitters));
        Ok(())
    }

    /// Uploads the lights and what a frame is given: `seed`, and the number of photons of [`Self::new`].
    ///
    /// # Errors
    /// [`GpuError::Limit`] where lights or emitters are more than there is room for.
    pub fn write_lights(&self, queue: &Queue, sources: &Sources, seed: u32) -> Result<(), GpuError> {
        let lights = sources.lights();
        fits("emitters", sources.emitters().len(), self.sizes.emitters)?;
        fits("photon_lights", lights.len(), self.sizes.lights)?;
        let settings = sources.settings(&Params { photons: self.sizes.photons, seed });
        queue.write_buffer(&self.buffers.photon_lights, 0, bytemuck::cast_slice(lights));
        queue.write_buffer(&self.buffers.photon_settings, 0, bytemuck::bytes_of(&settings));
        Ok(())
    }

    /// Adds `emit`: all photons where light starts.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more photons than a dispatch can have.
    pub fn emit(&self, pipelines: &Pipelines, pass: &mut Pass) -> Result<(), GpuError> {
        let photons = self.sizes.photons.into();
        pass.compute(pipelines, (&PHOTONS_EMIT, "emit_photons"), photons, &[&self.buffers.named()])
    }

    /// Adds `trace`: one flight and reflection of every photon that is alive. `tree` binds `accel_nodes` and `accel_triangles`, as
    /// [`AccelBuffers`](indirect_accel::gpu::AccelBuffers) names them, of the scene that [`Pass::encode`] is given; without one nothing is
    /// traced. A photon whose ray crosses more than a shader looks at counts as escaped.
    ///
    /// # Errors
    /// As [`Self::emit`], and [`GpuError::Unbound`] where one of the names is missing.
    pub fn trace(&self, pipelines: &Pipelines, pass: &mut Pass, tree: &[Named<'_>]) -> Result<(), GpuError> {
        let lists = [&*self.buffers.named(), tree];
        pass.compute(pipelines, (&PHOTONS_TRACE, "trace_photons"), self.sizes.photons.into(), &lists)
    }
}

fn fits(what: &'static str, found: usize, room: u32) -> Result<(), GpuError> {
    let (needed, available) = (found as u64, u64::from(room));
    if needed > available {
        return Err(GpuError::Limit { what, limit: "buffer", needed, available });
    }
    Ok(())
}
