//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks, but for `twins`, which is
//! for tools.
//!
//! No optional feature is used, and WebGPU's default limits suffice up to 1024² texels per map; beyond, a pyramid needs a
//! larger `max_storage_buffer_binding_size`.

mod gather;
mod resources;
#[cfg(feature = "cpu")]
mod twins;

pub use gather::{CHUNK, Gather, GatherResources};
pub use resources::{MapResources, Resources};
#[cfg(feature = "cpu")]
pub use twins::{Data, Twin, twins};

use indirect_gpu::shaders::{RSM_COMPACT, RSM_FLUX, RSM_PYRAMID, RSM_SHADE, RSM_VPLS};
use indirect_gpu::wgpu::{CommandEncoder, ComputePass, Device};
use indirect_gpu::{GBufferTarget, Kernel, PassTimer, Raster, SceneBuffers, workgroups_1d};

use crate::{Error, Options, Selection, layout::Node};

/// Invocations per workgroup of every pass but `compact`.
const WORKGROUP: u32 = 64;

/// The pipelines of all passes.
#[derive(Debug)]
pub struct Rsm {
    options: Options,
    raster: Raster,
    flux: Kernel,
    pyramid_leaf: Kernel,
    pyramid_parent: Kernel,
    vpls: Kernel,
    compact: Kernel,
    gather: Gather,
    shade: Kernel,
}

impl Rsm {
    /// Builds the pipelines.
    ///
    /// # Errors
    /// [`Error::BadOption`] where `options` are out of range.
    pub fn new(device: &Device, options: &Options) -> Result<Self, Error> {
        options.validate()?;
        let vpls = match options.selection {
            Selection::All => "vpls_all",
            Selection::Grid { .. } => "vpls_grid",
            Selection::Importance { .. } => "vpls_importance",
        };
        let kernel = |module, entry| Kernel::new(device, module, entry, &[]);
        Ok(Self {
            options: *options,
            raster: Raster::new(device),
            flux: kernel(&RSM_FLUX, "flux"),
            pyramid_leaf: kernel(&RSM_PYRAMID, "pyramid_leaf"),
            pyramid_parent: kernel(&RSM_PYRAMID, "pyramid_parent"),
            vpls: kernel(&RSM_VPLS, vpls),
            compact: kernel(&RSM_COMPACT, "compact"),
            gather: Gather::new(device),
            shade: kernel(&RSM_SHADE, "shade"),
        })
    }

    /// What it was made with.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// All passes of a frame: from the scene and the views that [`Resources::prepare`] was given to the indirect light of the
    /// camera's pixels in [`Resources::image`].
    ///
    /// # Errors
    /// [`Error::Gpu`] where something exceeds the device's limits.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: &SceneBuffers,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.encode_surface(encoder, timer, scene, resources)?;
        self.encode_flux(encoder, timer, resources)?;
        self.encode_pyramid(encoder, timer, resources)?;
        self.encode_vpls(encoder, timer, resources)?;
        self.encode_compact(encoder, timer, resources);
        self.encode_gather(encoder, timer, resources)?;
        self.encode_shade(encoder, timer, resources)
    }

    /// `surface`: what each light sees.
    ///
    /// # Errors
    /// As [`Rsm::encode`], like all that follow.
    pub fn encode_surface(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: &SceneBuffers,
        resources: &Resources,
    ) -> Result<(), Error> {
        for (map, view) in resources.maps.iter().zip(&resources.views) {
            self.raster.encode(encoder, timer, scene, &view.view, &map.surface, 0)?;
        }
        Ok(())
    }

    /// `flux`: texels from surfaces.
    ///
    /// # Errors
    /// See [`Rsm::encode`].
    pub fn encode_flux(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(resources.texels_per_map(), WORKGROUP)?;
        timer.compute(encoder, "flux", |pass| {
            for map in &resources.maps {
                self.flux.record(pass, &[&map.flux_group], workgroups);
            }
        });
        Ok(())
    }

    /// `pyramid`: nodes from surfaces and texels.
    ///
    /// # Errors
    /// See [`Rsm::encode`].
    pub fn encode_pyramid(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let leaves = workgroups_1d(resources.texels_per_map(), WORKGROUP)?;
        let levels: Result<Vec<_>, _> = resources.layout.levels[1..]
            .iter()
            .map(|level| workgroups_1d(level.len() as u64, WORKGROUP))
            .collect();
        let levels = levels?;
        timer.compute(encoder, "pyramid", |pass: &mut ComputePass<'_>| {
            for map in &resources.maps {
                self.pyramid_leaf.record(pass, &[&map.leaf_group], leaves);
                for (group, workgroups) in map.parent_groups.iter().zip(&levels) {
                    self.pyramid_parent.record(pass, &[group], *workgroups);
                }
            }
        });
        let node = size_of::<Node>() as u64;
        for (i, map) in (0..).zip(&resources.maps) {
            let last = (resources.layout.len() as u64 - 1) * node;
            encoder.copy_buffer_to_buffer(&map.nodes, last, &resources.tops, i * node, node);
        }
        Ok(())
    }

    /// `vpls`: slots from texels and pyramids.
    ///
    /// # Errors
    /// See [`Rsm::encode`].
    pub fn encode_vpls(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let maps = match self.options.selection {
            Selection::Importance { .. } => 1,
            Selection::All | Selection::Grid { .. } => resources.maps.len().max(1),
        };
        let workgroups = workgroups_1d(u64::from(resources.slot_count) / maps as u64, WORKGROUP)?;
        timer.compute(encoder, "vpls", |pass| {
            for map in &resources.maps {
                self.vpls.record(pass, &[&map.vpls_group], workgroups);
            }
        });
        Ok(())
    }

    /// `compact`: the slots that hold flux.
    pub fn encode_compact(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, resources: &Resources) {
        self.compact.dispatch(encoder, timer, &[&resources.compact_group], [1, 1, 1]);
    }

    /// `gather`: irradiance on the camera's pixels.
    ///
    /// # Errors
    /// See [`Rsm::encode`].
    pub fn encode_gather(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.gather.encode(encoder, timer, &resources.gather)
    }

    /// `shade`: radiance from irradiance.
    ///
    /// # Errors
    /// See [`Rsm::encode`].
    pub fn encode_shade(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.gather.receivers()), WORKGROUP)?;
        self.shade.dispatch(encoder, timer, &[&resources.shade_group], workgroups);
        Ok(())
    }

    /// Buffers of this renderer for `maps` maps and a camera; see [`Resources::new`].
    ///
    /// # Errors
    /// As there.
    pub fn resources(
        &self,
        device: &Device,
        maps: usize,
        camera: &GBufferTarget,
    ) -> Result<Resources, Error> {
        Resources::new(device, self, maps, camera)
    }
}
