//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks, but for `twins`, which is
//! for tools.
//!
//! No optional feature is used, and WebGPU's default limits suffice up to 1024² texels per map and, with the windows of 60
//! samples, 41³ hints: 28 samples of 64 bytes for each are one binding.

mod resources;
mod smooth;
#[cfg(feature = "cpu")]
mod twins;

pub use resources::Resources;
pub use smooth::{Smooth, SmoothResources};
#[cfg(feature = "cpu")]
pub use twins::twins;

use indirect_gpu::shaders::{
    FILTER_SHADE, RADIANCE_HINTS_BOUNCE, RADIANCE_HINTS_ESTIMATE, RADIANCE_HINTS_OCCLUSION,
    RADIANCE_HINTS_RECONSTRUCT, RADIANCE_HINTS_SAMPLE, RADIANCE_HINTS_STOPS, RADIANCE_HINTS_UPSAMPLE,
};
use indirect_gpu::wgpu::{CommandEncoder, Device};
use indirect_gpu::{Kernel, PassTimer, SceneBuffers, workgroups_1d};

use crate::{Error, Options, Sampling, Scale, Transport, Visibility};

/// Invocations per workgroup of every pass.
const WORKGROUP: u32 = 64;

/// The pipelines of all passes that the options ask for.
#[derive(Debug)]
pub struct RadianceHints {
    options: Options,
    rsm: rsm::gpu::Rsm,
    sample: Kernel,
    near: Option<Kernel>,
    /// Copies depths; tests.
    occlusion: Option<[Kernel; 2]>,
    estimate: Kernel,
    stops: Option<Kernel>,
    /// One per [`Transport`], in its order.
    bounce: Option<[Kernel; 3]>,
    reconstruct: Kernel,
    upsample: Option<Kernel>,
    shade: Kernel,
}

impl RadianceHints {
    /// Builds the pipelines.
    ///
    /// # Errors
    /// [`Error::BadOption`] where `options` are out of range.
    pub fn new(device: &Device, options: &Options) -> Result<Self, Error> {
        options.validate()?;
        let kernel = |module, entry| Kernel::new(device, module, entry, &[]);
        let sample = match options.sampling {
            Sampling::Importance | Sampling::Nearby => "sample_importance",
            Sampling::Disc { .. } => "sample_disc",
        };
        let occlusion = match options.visibility {
            Visibility::Off => None,
            Visibility::RsmDepth => Some("occlusion_rsm"),
            Visibility::CameraDepth => Some("occlusion_camera"),
        };
        let bounces = ["bounce_directions", "bounce_sphere", "bounce_sphere_as_printed"];
        Ok(Self {
            options: *options,
            rsm: rsm::gpu::Rsm::new(device, &options.rsm())?,
            sample: kernel(&RADIANCE_HINTS_SAMPLE, sample),
            near: (options.near() > 0).then(|| kernel(&RADIANCE_HINTS_SAMPLE, "sample_near")),
            occlusion: occlusion.map(|entry| {
                ["occlusion_depths", entry].map(|entry| kernel(&RADIANCE_HINTS_OCCLUSION, entry))
            }),
            estimate: kernel(&RADIANCE_HINTS_ESTIMATE, "estimate"),
            stops: (options.stop_words() > 0).then(|| kernel(&RADIANCE_HINTS_STOPS, "stop_directions")),
            bounce: (options.bounces > 1).then(|| bounces.map(|entry| kernel(&RADIANCE_HINTS_BOUNCE, entry))),
            reconstruct: kernel(&RADIANCE_HINTS_RECONSTRUCT, "reconstruct"),
            upsample: (options.scale != Scale::Full).then(|| kernel(&RADIANCE_HINTS_UPSAMPLE, "upsample")),
            shade: kernel(&FILTER_SHADE, "shade"),
        })
    }

    /// What it was made with.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// All passes of a frame: from the scene and what [`Resources::prepare`] was given to the indirect light of the camera's
    /// pixels in [`Resources::image`].
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
        self.encode_maps(encoder, timer, scene, resources)?;
        self.encode_sample(encoder, timer, resources)?;
        self.encode_near(encoder, timer, resources)?;
        self.encode_occlusion(encoder, timer, resources)?;
        self.encode_estimate(encoder, timer, resources)?;
        self.encode_stops(encoder, timer, resources)?;
        for number in 2..=self.options.bounces {
            self.encode_bounce(encoder, timer, resources, number)?;
        }
        self.encode_reconstruct(encoder, timer, resources)?;
        self.encode_upsample(encoder, timer, resources)?;
        self.encode_shade(encoder, timer, resources)
    }

    /// The reflective shadow maps and their pyramids.
    ///
    /// # Errors
    /// As [`RadianceHints::encode`], like all that follow.
    pub fn encode_maps(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: &SceneBuffers,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.rsm.encode_surface(encoder, timer, scene, &resources.rsm)?;
        self.rsm.encode_flux(encoder, timer, &resources.rsm)?;
        Ok(self.rsm.encode_pyramid(encoder, timer, &resources.rsm)?)
    }

    /// `sample`: the lists of samples.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_sample(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.slots), WORKGROUP)?;
        timer.compute(encoder, "sample", |pass| {
            for group in &resources.sample_groups {
                self.sample.record(pass, &[group], workgroups);
            }
        });
        Ok(())
    }

    /// `near`: the windows of the hints and the samples in them; nothing to do where [`Options::near`] is 0.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_near(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let Some(kernel) = &self.near else { return Ok(()) };
        let workgroups = workgroups_1d(u64::from(resources.hint_count), WORKGROUP)?;
        timer.compute(encoder, "near", |pass| {
            for group in &resources.near_groups {
                kernel.record(pass, &[group], workgroups);
            }
        });
        Ok(())
    }

    /// `occlusion`: what stands between hints and samples; nothing to do for [`Visibility::Off`].
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_occlusion(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let (Some([depths, test]), Some(groups)) = (&self.occlusion, &resources.occlusion) else {
            return Ok(());
        };
        let copies = workgroups_1d(u64::from(groups.texels), WORKGROUP)?;
        let words = u64::from(resources.hint_count) * u64::from(self.options.words());
        let workgroups = workgroups_1d(words, WORKGROUP)?;
        timer.compute(encoder, "occlusion", |pass| {
            for group in &groups.copies {
                depths.record(pass, &[group], copies);
            }
            test.record(pass, &[&groups.test], workgroups);
        });
        Ok(())
    }

    /// `estimate`: the first bounce at the hints.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_estimate(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.hint_count), WORKGROUP)?;
        self.estimate.dispatch(encoder, timer, &[&resources.estimate_group], workgroups);
        Ok(())
    }

    /// `stops`: what ends the directions of later bounces, after `occlusion`, which collects the depths; nothing to do where
    /// nothing is tested or light goes from place to place.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_stops(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let (Some(kernel), Some(group)) = (&self.stops, &resources.stops_group) else { return Ok(()) };
        if resources.transport != Transport::Directions {
            return Ok(());
        }
        let words = u64::from(resources.hint_count) * u64::from(self.options.stop_words());
        let workgroups = workgroups_1d(words, WORKGROUP)?;
        timer.compute(encoder, "stops", |pass| kernel.record(pass, &[group], workgroups));
        Ok(())
    }

    /// `bounce`: bounce `number`, `2..=`[`Options::bounces`]; nothing to do for another.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_bounce(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
        number: u32,
    ) -> Result<(), Error> {
        let Some(kernels) = &self.bounce else { return Ok(()) };
        let Some(groups) = number.checked_sub(2).and_then(|i| resources.bounce_groups.get(i as usize)) else {
            return Ok(());
        };
        let workgroups = workgroups_1d(u64::from(resources.hint_count), WORKGROUP)?;
        let which = resources.transport as usize;
        timer.compute(encoder, "bounce", |pass| kernels[which].record(pass, &[&groups[which]], workgroups));
        Ok(())
    }

    /// `reconstruct`: irradiance in the buffer of the scale.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_reconstruct(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.low_count), WORKGROUP)?;
        self.reconstruct.dispatch(encoder, timer, &[&resources.reconstruct_group], workgroups);
        Ok(())
    }

    /// `upsample`: irradiance at every pixel; nothing to do at full resolution.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_upsample(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let (Some(kernel), Some(group)) = (&self.upsample, &resources.upsample_group) else { return Ok(()) };
        let workgroups = workgroups_1d(u64::from(resources.pixels), WORKGROUP)?;
        kernel.dispatch(encoder, timer, &[group], workgroups);
        Ok(())
    }

    /// `shade`: radiance from irradiance.
    ///
    /// # Errors
    /// See [`RadianceHints::encode`].
    pub fn encode_shade(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.pixels), WORKGROUP)?;
        self.shade.dispatch(encoder, timer, &[&resources.shade_group], workgroups);
        Ok(())
    }
}
