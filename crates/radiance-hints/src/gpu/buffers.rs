use bytemuck::Zeroable;
use glam::Vec4;
use indirect_core::MapView;
use indirect_core::settings::BadOption;
use indirect_filter::{Reduced, gpu::SmoothBuffers};
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Plan, Vec3Pad, ViewUniform, buffers, named, uniform_buffer};
use indirect_technique::gpu::Inputs;
use rsm::{Error, gpu::Maps};

use crate::{
    layout::{Index, LatticeUniform, Sample, SettingsUniform, Surroundings, VOLUMES, Volume, Window},
    settings::{Options, Params, Reconstruction, Sampling, Scale, Visibility},
    setup::{Draw, Setup},
};

/// What the lengths of buffers follow from.
#[derive(Debug, Clone)]
pub struct Sizes {
    pub(crate) options: Options,
    pub(crate) maps: usize,
    pub(crate) hints: u64,
    pub(crate) pixels: u64,
    /// The image that the field is read at.
    pub(crate) reduced: Reduced,
    /// Samples of all lists.
    pub(crate) slots: u64,
    /// Samples of all windows.
    near: u64,
    /// Texels of the depth images that visibility asks.
    depths: u64,
}

impl Sizes {
    pub(super) fn new(setup: &Setup, size: [u32; 2], maps: usize) -> Self {
        let (options, draw, hints) = (setup.options, setup.draw(), setup.lattice.hints());
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let depths = match options.visibility {
            Visibility::Off => 0,
            Visibility::RsmDepth => maps as u64 * u64::from(options.resolution).pow(2),
            Visibility::CameraDepth => pixels,
        };
        Self {
            options,
            maps,
            hints: hints.into(),
            pixels,
            reduced: Reduced::new(size, options.scale.step()),
            slots: u64::from(draw.lists(hints)) * u64::from(draw.samples),
            near: u64::from(hints) * u64::from(draw.near()),
            depths,
        }
    }

    pub(crate) fn blocked_words(&self) -> u64 {
        self.hints * u64::from(self.options.blocked_words())
    }

    pub(crate) fn stop_words(&self) -> u64 {
        self.hints * u64::from(self.options.stop_words())
    }

    /// Vectors of the hints after a bounce, where there is one of this number.
    fn vectors(&self, bounce: u32) -> u64 {
        let held = self.options.bounces >= bounce;
        if held { self.hints * u64::from(self.options.order.vectors()) } else { 0 }
    }

    /// Pixels where something is smoothed.
    fn smoothed(&self) -> u64 {
        if self.options.smoothing > 0.0 { self.pixels } else { 0 }
    }
}

buffers! {
    /// Buffers beside those of the maps and of the smoothing.
    pub struct OwnBuffers for Sizes {
        /// The lists of samples; behind them [`Draw::near`] for each hint.
        samples: [Sample] = |s| s.slots + s.near;
        /// The windows of hints.
        windows: [Window] = |s| if s.near > 0 { s.hints } else { 0 };
        /// Depths of the views that visibility asks, one view after the other.
        depths: [f32] = |s| s.depths;
        /// What stands between hints and samples: four bits each.
        blocked: [u32] = Sizes::blocked_words;
        /// The quantised hit distances of later bounces' directions: eight bits each.
        stops: [u32] = Sizes::stop_words;
        /// The hints after the first bounce.
        first: [Vec4] = |s| s.vectors(1);
        /// Those after the second and every other bounce from there on.
        even: [Vec4] = |s| s.vectors(2);
        /// Those after the third and every other bounce from there on.
        odd: [Vec4] = |s| s.vectors(3);
        /// The albedo around each hint; not read where there is one bounce.
        surroundings: [Surroundings] = |s| if s.options.bounces > 1 { s.hints } else { 0 };
        /// Irradiance per texel of the reduced image, W/m², and 0.
        low: [Vec3Pad] = |s| if s.options.scale == Scale::Full { 0 } else { s.reduced.texels().into() };
        /// Irradiance per pixel, W/m², and 0.
        irradiance: [Vec3Pad] = |s| s.pixels;
        /// Indirect radiance that leaves each pixel, W/(sr·m²), and 0.
        image: [Vec3Pad] = |s| s.pixels;
        /// The maps' views.
        views: [ViewUniform] = |s| s.maps as u64;
        /// The camera.
        camera: [ViewUniform] = |_| 1;
        /// Where the hints are.
        lattice: LatticeUniform;
        /// Options and parameters.
        settings: SettingsUniform;
        /// The image and the reduced one.
        reduced: Reduced;
    }
}

/// All buffers.
#[derive(Debug)]
pub struct Buffers {
    /// The maps.
    pub rsm: Maps,
    /// What the technique adds.
    pub own: OwnBuffers,
    /// The history.
    pub smooth: SmoothBuffers,
    /// The numbers 0, 1, …, as many as there are maps or bounces.
    indices: Vec<Buffer>,
    sizes: Sizes,
}

impl Buffers {
    fn index_count(s: &Sizes) -> usize {
        s.maps.max(s.options.bounces as usize + 1)
    }

    pub(super) fn plan(s: &Sizes) -> Plan {
        let maps = Maps::plan(s.options.resolution, s.maps);
        let mut plan = maps.and(OwnBuffers::plan(s)).and(SmoothBuffers::plan(&s.smoothed()));
        (0..Self::index_count(s)).for_each(|_| plan.uniform::<Index>("current"));
        for (name, count) in [
            ("samples", s.slots + s.near),
            ("depths", s.depths),
            ("blocked", s.blocked_words()),
            ("stops", s.stop_words()),
        ] {
            plan.index(name, count);
        }
        plan
    }

    pub(super) fn new(device: &Device, queue: &Queue, s: &Sizes) -> Result<Self, GpuError> {
        let own = OwnBuffers::new(device, s)?;
        queue.write_buffer(&own.reduced, 0, bytemuck::bytes_of(&s.reduced));
        let index = |value| uniform_buffer(device, "current", &Index { value });
        Ok(Self {
            rsm: Maps::new(device, s.options.resolution, s.maps)?,
            own,
            smooth: SmoothBuffers::new(device, &s.smoothed())?,
            indices: (0..Self::index_count(s) as u32).map(index).collect(),
            sizes: s.clone(),
        })
    }

    pub(super) fn prepare(&self, queue: &Queue, inputs: &Inputs<'_>, setup: &Setup) -> Result<(), Error> {
        let (lattice, hints) = (&setup.lattice, setup.lattice.hints());
        if u64::from(hints) != self.sizes.hints {
            let needed = format_args!("{} hints, for which the resources were made", self.sizes.hints);
            return Err(BadOption::new("lattice", format_args!("one of {hints} hints"), needed).into());
        }
        self.rsm.prepare(queue, inputs.lights, inputs.views)?;
        let volumes = lattice.volumes();
        let mut volume = [Volume::zeroed(); VOLUMES];
        volume[..volumes.len()].copy_from_slice(volumes);
        let uniform = LatticeUniform { volumes: volumes.len() as u32, hints, pad0: 0, pad1: 0, volume };
        queue.write_buffer(&self.own.lattice, 0, bytemuck::bytes_of(&uniform));
        queue.write_buffer(&self.own.settings, 0, bytemuck::bytes_of(&self.settings(setup)));
        let n = setup.options.resolution;
        let of_map = |(i, v): (u32, &MapView)| ViewUniform::new(&v.view, [n, n], i * n * n);
        let views: Vec<_> = (0..).zip(inputs.views).map(of_map).collect();
        queue.write_buffer(&self.own.views, 0, bytemuck::cast_slice(&views));
        let camera = ViewUniform::new(inputs.camera, self.sizes.reduced.size, 0);
        queue.write_buffer(&self.own.camera, 0, bytemuck::bytes_of(&camera));
        self.smooth.prepare(queue, inputs.camera, self.sizes.reduced.size, setup.options.smoothing);
        Ok(())
    }

    fn settings(&self, setup: &Setup) -> SettingsUniform {
        let Setup { options, params: Params { seed, jitter, footprint, range, disc, reconstruct }, .. } =
            *setup;
        let draw: Draw = setup.draw();
        let around = setup.enclosure.unwrap_or_default();
        SettingsUniform {
            samples: options.samples,
            maps: self.sizes.maps as u32,
            resolution: options.resolution,
            seed,
            jitter,
            footprint,
            range,
            disc,
            vectors: options.order.vectors(),
            bounce_samples: options.bounce_samples,
            sampling: u32::from(options.sampling == Sampling::Disc),
            words: options.blocked_words(),
            as_printed: u32::from(reconstruct == Reconstruction::AsPrinted),
            enclosed: u32::from(setup.enclosure.is_some()),
            side: draw.side(),
            near: draw.near(),
            stop_words: options.stop_words(),
            slots: self.sizes.slots as u32,
            pad0: 0,
            pad1: 0,
            enclosure: core::array::from_fn(|face| around.albedo[face].extend(around.depth[face])),
        }
    }

    pub(super) fn named(&self) -> Vec<Named<'_>> {
        let mut all = self.own.named();
        all.extend([named("tops", &self.rsm.tops), named("copies", &self.own.depths)]);
        all
    }

    /// What a dispatch for map `i` binds: the map's buffers and its number.
    pub(crate) fn of_map(&self, i: usize) -> Vec<Named<'_>> {
        let mut all = self.rsm.maps[i].named();
        all.push(self.current(i));
        all
    }

    /// The number `i` as a uniform.
    pub(crate) fn current(&self, i: usize) -> Named<'_> {
        named("current", &self.indices[i])
    }

    /// The hints after bounce `number`, 1 for the first.
    #[must_use]
    pub fn field(&self, number: u32) -> &Buffer {
        match number {
            0 | 1 => &self.own.first,
            n if n % 2 == 0 => &self.own.even,
            _ => &self.own.odd,
        }
    }

    /// The hints after the last bounce.
    pub(crate) fn last_field(&self) -> &Buffer {
        self.field(self.sizes.options.bounces)
    }

    /// Floats of a hint.
    #[cfg(feature = "cpu")]
    pub(crate) const fn floats(&self) -> usize {
        4 * self.sizes.options.order.vectors() as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{
        RADIANCE_HINTS_BOUNCE, RADIANCE_HINTS_ESTIMATE, RADIANCE_HINTS_OCCLUSION, RADIANCE_HINTS_RECONSTRUCT,
        RADIANCE_HINTS_SAMPLE, RADIANCE_HINTS_UPSAMPLE,
    };
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<Sample>(&RADIANCE_HINTS_SAMPLE).unwrap();
        check::<Window>(&RADIANCE_HINTS_SAMPLE).unwrap();
        check::<Index>(&RADIANCE_HINTS_SAMPLE).unwrap();
        check::<Volume>(&RADIANCE_HINTS_BOUNCE).unwrap();
        check::<LatticeUniform>(&RADIANCE_HINTS_BOUNCE).unwrap();
        check::<Surroundings>(&RADIANCE_HINTS_ESTIMATE).unwrap();
        check::<SettingsUniform>(&RADIANCE_HINTS_ESTIMATE).unwrap();
        check_constant(&RADIANCE_HINTS_ESTIMATE, "INTERLEAVE", crate::INTERLEAVE).unwrap();
    }

    #[cfg(feature = "cpu")]
    #[test]
    fn constants_are_the_same_in_wgsl() {
        use crate::cpu::{
            bounce, depths, directions, estimate, field, near, occlusion, reconstruct, upsample,
        };
        let numbers = [
            (&RADIANCE_HINTS_SAMPLE, "REACH", near::REACH),
            (&RADIANCE_HINTS_SAMPLE, "SPAN", near::SPAN),
            (&RADIANCE_HINTS_SAMPLE, "OFF_CENTRE", near::OFF_CENTRE),
            (&RADIANCE_HINTS_ESTIMATE, "LEAST_D2", estimate::LEAST_D2),
            (&RADIANCE_HINTS_RECONSTRUCT, "NEAR_RADIUS", reconstruct::NEAR_RADIUS),
            (&RADIANCE_HINTS_RECONSTRUCT, "NEAR_LIFT", reconstruct::NEAR_LIFT),
            (&RADIANCE_HINTS_RECONSTRUCT, "FAR_LIFT", reconstruct::FAR_LIFT),
            (&RADIANCE_HINTS_RECONSTRUCT, "MOST_GAIN", reconstruct::MOST_GAIN),
            (&RADIANCE_HINTS_RECONSTRUCT, "LEAST_SHARE", field::LEAST_SHARE),
            (&RADIANCE_HINTS_UPSAMPLE, "LEAST_WEIGHT", upsample::LEAST_WEIGHT),
        ];
        numbers.into_iter().for_each(|(module, name, value)| check_constant(module, name, value).unwrap());
        let counts = [
            (&RADIANCE_HINTS_OCCLUSION, "STEPS", depths::STEPS),
            (&RADIANCE_HINTS_OCCLUSION, "REFINEMENTS", depths::REFINEMENTS),
            (&RADIANCE_HINTS_OCCLUSION, "POINTS", occlusion::POINTS),
            (&RADIANCE_HINTS_BOUNCE, "OPEN", directions::OPEN),
            (&RADIANCE_HINTS_BOUNCE, "PLACES", bounce::PLACES),
        ];
        counts.into_iter().for_each(|(module, name, value)| check_constant(module, name, value).unwrap());
    }
}
