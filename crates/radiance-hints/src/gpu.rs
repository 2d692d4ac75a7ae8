//! Frames on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. [`Resources::required_limits`] says which limits a setup needs: WebGPU's defaults for the
//! default settings, 24 maps and 3840×2160 pixels.

use bytemuck::Zeroable;
use glam::Vec4;
use indirect_core::MapView;
use indirect_core::settings::{BadOption, Settings};
use indirect_filter::{Reduced, gpu::SmoothBuffers};
use indirect_gpu::shaders::Module;
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Plan, Vec3Pad, ViewUniform, buffers, named, uniform_buffer};
use indirect_technique::gpu::Build;
#[cfg(feature = "cpu")]
use indirect_technique::gpu::Exchange;
use rsm::{Error, gpu::Maps};

pub use indirect_technique::gpu::{GpuTechnique, Inputs};

#[cfg(feature = "cpu")]
use crate::layout::Near;
use crate::{
    layout::{Index, LatticeUniform, Sample, SettingsUniform, Surroundings, VOLUMES, Volume, Window},
    output::{Output, RadianceHints},
    settings::{Options, Params, Reconstruction, Sampling, Scale, Visibility},
    setup::Setup,
};

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<RadianceHints>;

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
    /// Texels of the depth images that visibility is tested against.
    depths: u64,
}

impl Sizes {
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

    /// Numbers that dispatches are given: those of maps and bounces.
    fn numbers(&self) -> u32 {
        self.options.bounces.max(self.maps as u32) + 1
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
        /// Depths of the views that visibility is tested against, one view after the other.
        depths: [f32] = |s| s.depths;
        /// Occlusion between hints and samples: four bits each.
        blocked: [u32] = Sizes::blocked_words;
        /// The quantised hit distances of later bounces' directions: eight bits each.
        stops: [u32] = Sizes::stop_words;
        /// The hints after the first bounce.
        first: [Vec4] = |s| s.vectors(1);
        /// Those after the second and every other bounce from there on.
        even: [Vec4] = |s| s.vectors(2);
        /// Those after the third and every other bounce from there on.
        odd: [Vec4] = |s| s.vectors(3);
        /// Mean albedo and distances of the lit surfaces around each hint; not read where there is one bounce.
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
#[derive(Debug, Clone)]
pub struct Buffers {
    /// The maps.
    pub rsm: Maps,
    /// What the technique adds.
    pub own: OwnBuffers,
    /// The history.
    pub smooth: SmoothBuffers,
    /// The numbers 0, 1, …
    indices: Vec<Buffer>,
    sizes: Sizes,
}

impl GpuTechnique for RadianceHints {
    type Maps = Maps;

    fn sizes(setup: &Setup, size: [u32; 2], maps: usize) -> Sizes {
        let (options, draw, hints) = (setup.options, setup.draw(), setup.lattice.hints());
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        Sizes {
            options,
            maps,
            hints: hints.into(),
            pixels,
            reduced: setup.reduced(size),
            slots: u64::from(draw.lists(hints)) * u64::from(draw.samples),
            near: u64::from(hints) * u64::from(draw.near()),
            depths: match options.visibility {
                Visibility::Off => 0,
                Visibility::RsmDepth => maps as u64 * u64::from(options.resolution).pow(2),
                Visibility::CameraDepth => pixels,
            },
        }
    }

    fn plan(s: &Sizes) -> Plan {
        let maps = Maps::plan(s.options.resolution, s.maps);
        let mut plan = maps.and(OwnBuffers::plan(s)).and(SmoothBuffers::plan(&s.smoothed()));
        (0..s.numbers()).for_each(|_| plan.uniform::<Index>("current"));
        let (blocked, stops) = (s.blocked_words(), s.stop_words());
        for (name, count) in
            [("samples", s.slots + s.near), ("depths", s.depths), ("blocked", blocked), ("stops", stops)]
        {
            plan.index(name, count);
        }
        plan
    }

    fn allocate(device: &Device, queue: &Queue, s: &Sizes, _: &Setup) -> Result<Buffers, GpuError> {
        let own = OwnBuffers::new(device, s)?;
        queue.write_buffer(&own.reduced, 0, bytemuck::bytes_of(&s.reduced));
        let index = |value| uniform_buffer(device, "current", &Index { value });
        Ok(Buffers {
            rsm: Maps::new(device, s.options.resolution, s.maps)?,
            own,
            smooth: SmoothBuffers::new(device, &s.smoothed())?,
            indices: (0..s.numbers()).map(index).collect(),
            sizes: s.clone(),
        })
    }

    fn resize(
        old: &Buffers,
        device: &Device,
        queue: &Queue,
        [sizes, probe]: [&Sizes; 2],
        _: &Setup,
    ) -> Result<Buffers, GpuError> {
        let own = old.own.resized(device, sizes, probe)?;
        queue.write_buffer(&own.reduced, 0, bytemuck::bytes_of(&sizes.reduced));
        let smooth = SmoothBuffers::new(device, &sizes.smoothed())?;
        Ok(Buffers { own, smooth, sizes: sizes.clone(), ..old.clone() })
    }

    fn maps(buffers: &Buffers) -> &Maps {
        &buffers.rsm
    }

    fn named(b: &Buffers) -> Vec<Named<'_>> {
        let mut all = b.own.named();
        all.extend([named("tops", &b.rsm.tops), named("copies", &b.own.depths)]);
        all
    }

    fn prepare(b: &mut Buffers, queue: &Queue, inputs: &Inputs<'_>, setup: &Setup) -> Result<(), Error> {
        setup.params.validate()?;
        let (lattice, hints, size) = (&setup.lattice, setup.lattice.hints(), b.sizes.reduced.size);
        if u64::from(hints) != b.sizes.hints {
            let needed = format_args!("{} hints, for which the resources were made", b.sizes.hints);
            return Err(BadOption::new("lattice", format_args!("one of {hints} hints"), needed).into());
        }
        b.rsm.prepare(queue, inputs.lights, inputs.views)?;
        let volumes = lattice.volumes();
        let mut volume = [Volume::zeroed(); VOLUMES];
        volume[..volumes.len()].copy_from_slice(volumes);
        let uniform = LatticeUniform { volumes: volumes.len() as u32, hints, pad0: 0, pad1: 0, volume };
        queue.write_buffer(&b.own.lattice, 0, bytemuck::bytes_of(&uniform));
        queue.write_buffer(&b.own.settings, 0, bytemuck::bytes_of(&b.settings(setup)));
        let n = setup.options.resolution;
        let of_map = |(i, v): (u32, &MapView)| ViewUniform::new(&v.view, [n, n], i * n * n);
        let views: Vec<_> = (0..).zip(inputs.views).map(of_map).collect();
        queue.write_buffer(&b.own.views, 0, bytemuck::cast_slice(&views));
        let camera = ViewUniform::new(inputs.camera, size, 0);
        queue.write_buffer(&b.own.camera, 0, bytemuck::bytes_of(&camera));
        b.smooth.prepare(queue, inputs.camera, size, setup.options.smoothing);
        Ok(())
    }

    fn restore(b: &Buffers, queue: &Queue, past: &Output) {
        b.smooth.restore(queue, past.history.as_ref());
    }

    fn image_buffer(b: &Buffers) -> &Buffer {
        &b.own.image
    }
}

impl Buffers {
    fn settings(&self, setup: &Setup) -> SettingsUniform {
        let Setup { options, params: Params { seed, jitter, footprint, range, disc, reconstruct }, .. } =
            *setup;
        let (draw, around) = (setup.draw(), setup.enclosure.unwrap_or_default());
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

    /// The irradiance that `reconstruct` writes: that of the reduced image, or of all pixels.
    pub(crate) fn low(&self) -> &Buffer {
        if self.sizes.reduced.step == 1 { &self.own.irradiance } else { &self.own.low }
    }

    /// The irradiance that `shade` reads.
    pub(crate) fn shaded(&self) -> &Buffer {
        if self.sizes.smoothed() > 0 { &self.smooth.smoothed } else { &self.own.irradiance }
    }

    /// Floats of a hint.
    #[cfg(feature = "cpu")]
    pub(crate) const fn floats(&self) -> usize {
        4 * self.sizes.options.order.vectors() as usize
    }

    /// Names the results of `near`, whose samples lie behind the `lists` of those of the lists. Where a hint's projection
    /// grazes a texel's border its window may be another: counted, and with other samples.
    #[cfg(feature = "cpu")]
    pub(crate) fn exchange_near(&self, lists: usize, near: &mut Near, x: &mut Exchange<'_>) {
        let place = |w: &Window| (w.first, w.end, w.map);
        let windows: Vec<Window> = x.read(&self.own.windows, 0, near.windows.len());
        let same: Vec<bool> = near.windows.iter().zip(&windows).map(|(a, b)| place(a) == place(b)).collect();
        let count = near.samples.len() / near.windows.len().max(1);
        let samples: Vec<Sample> = x.read(&self.own.samples, lists, near.samples.len());
        // A hint without a window keeps the samples of one that it had.
        let stale = |i: usize| {
            near.windows[i / count].first == near.windows[i / count].end && samples[i] != near.samples[i]
        };
        let of_samples = (0..samples.len()).map(|i| same[i / count] && !stale(i)).collect();
        x.same(Some(same));
        x.elements("window", &self.own.windows, 0, &mut near.windows);
        x.same(Some(of_samples));
        x.elements("", &self.own.samples, lists, &mut near.samples);
        x.same(None);
    }
}

/// Adds a dispatch for each map.
pub(crate) fn for_each_map(
    b: &Build<'_, RadianceHints>,
    pass: &mut Pass,
    entry: (&Module, &'static str),
    invocations: u64,
) -> Result<(), GpuError> {
    (0..b.sizes.maps).try_for_each(|i| b.compute(pass, entry, invocations, &b.buffers.of_map(i)))
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
