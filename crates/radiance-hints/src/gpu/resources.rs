use bytemuck::{Pod, Zeroable};
use indirect_core::{Light, View};
use indirect_filter::Reduced;
use indirect_gpu::layout::ViewUniform;
use indirect_gpu::wgpu::{BindGroup, Buffer, Device, Queue};
use indirect_gpu::{GBufferTarget, GpuError, Vec3Pad, empty_storage_buffer, uniform_buffer};
use rsm::views::MapView;

use super::RadianceHints;
use crate::{
    Enclosure, Error, Lattice, Options, Params, Reconstruction, Sample, Sampling, Scale, Surroundings,
    Transport, Visibility, Volume, Window,
    layout::{LatticeUniform, Settings, VOLUMES},
};

/// Which map a dispatch draws from, as `sample.wgsl` declares it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MapIndex {
    pub(crate) map: u32,
    pub(crate) slots: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// Where the depths of one view go, as `occlusion.wgsl` declares it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct DepthCopy {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// What the visibility test binds.
#[derive(Debug)]
pub(super) struct OcclusionGroups {
    pub(super) copies: Vec<BindGroup>,
    pub(super) test: BindGroup,
    /// Of one view.
    pub(super) texels: u32,
}

/// All buffers of a frame; every intermediate result can be read back.
#[derive(Debug)]
pub struct Resources {
    /// The maps.
    pub rsm: rsm::gpu::Resources,
    /// `array<Sample>`: the lists of samples; behind them [`Options::near`] for each hint.
    pub samples: Buffer,
    /// `array<Window>`: what hints look at closely; one element where there are no windows.
    pub windows: Buffer,
    /// `array<u32>`: what stands between hints and samples; one word without a test.
    pub blocked: Buffer,
    /// `array<u32>`: what ends the directions of later bounces; one word without a test.
    pub stops: Buffer,
    /// `array<vec4<f32>>`: the hints after the first bounce, then those of later ones by turns; as many as are held at once.
    pub volumes: Vec<Buffer>,
    /// `array<Surroundings>`; one element for one bounce.
    pub surroundings: Buffer,
    /// `array<vec4<f32>>`: irradiance per texel of the buffer of the scale, W/m², and 0.
    pub low: Buffer,
    /// `array<vec4<f32>>`: irradiance per pixel, W/m², and 0; at full resolution the same buffer as `low`.
    pub irradiance: Buffer,
    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel, W/(sr·m²), and 0.
    pub image: Buffer,
    pub(super) slots: u32,
    pub(super) hint_count: u32,
    pub(super) low_count: u32,
    pub(super) pixels: u32,
    pub(super) sample_groups: Vec<BindGroup>,
    pub(super) near_groups: Vec<BindGroup>,
    pub(super) occlusion: Option<OcclusionGroups>,
    pub(super) estimate_group: BindGroup,
    pub(super) stops_group: Option<BindGroup>,
    pub(super) bounce_groups: Vec<[BindGroup; 3]>,
    pub(super) reconstruct_group: BindGroup,
    pub(super) upsample_group: Option<BindGroup>,
    pub(super) shade_group: BindGroup,
    pub(super) transport: Transport,
    options: Options,
    maps: u32,
    camera_size: [u32; 2],
    settings: Buffer,
    bounce_settings: Vec<Buffer>,
    lattice: Buffer,
    views: Buffer,
    camera_view: Buffer,
    depths: Option<Buffer>,
    /// The maps' own renderer wants a camera; this one sees nothing.
    _no_camera: GBufferTarget,
}

impl Resources {
    /// Buffers for `maps` maps, as many as [`rsm::views::views`] returns, the hints of `lattice` and the pixels of `camera`,
    /// whose buffers they refer to from now on.
    ///
    /// # Errors
    /// [`Error::Gpu`] where a buffer exceeds the device's limits.
    pub fn new(
        device: &Device,
        hints: &RadianceHints,
        maps: usize,
        lattice: &Lattice,
        camera: &GBufferTarget,
    ) -> Result<Self, Error> {
        let options = *hints.options();
        let no_camera = GBufferTarget::new(device, [1, 1], 1)?;
        let rsm = rsm::gpu::Resources::new(device, &hints.rsm, maps, &no_camera)?;
        let hint_count = lattice.hints();
        let slots = u64::from(options.sets(hint_count)) * u64::from(options.samples);
        let slots = u32::try_from(slots).map_err(|_| GpuError::Limit {
            what: "the lists of samples",
            limit: "32-bit index",
            needed: slots,
            available: u64::from(u32::MAX),
        })?;
        let texels = options.resolution * options.resolution;
        let [width, height] = camera.size();
        let reduced = Reduced::new([width, height], options.scale.step());
        let (pixels, low_count) = (width * height, reduced.texels());

        let settings = uniform_buffer(device, "radiance hints settings", &Settings::zeroed());
        let lattice_buffer = uniform_buffer(device, "radiance hints lattice", &LatticeUniform::zeroed());
        let near = u64::from(hint_count) * u64::from(options.near());
        let samples =
            empty_storage_buffer::<Sample>(device, "radiance hints samples", u64::from(slots) + near)?;
        let windows = if near > 0 { u64::from(hint_count) } else { 1 };
        let windows = empty_storage_buffer::<Window>(device, "radiance hints windows", windows)?;
        let words = u64::from(hint_count) * u64::from(options.words());
        let blocked = empty_storage_buffer::<u32>(device, "radiance hints occlusion", words)?;
        let words = u64::from(hint_count) * u64::from(options.stop_words());
        let stops = empty_storage_buffer::<u32>(device, "radiance hints stops", words)?;
        let vectors = u64::from(hint_count) * u64::from(options.order.vectors());
        let volumes = (0..options.bounces.min(3))
            .map(|_| empty_storage_buffer::<[f32; 4]>(device, "radiance hints", vectors))
            .collect::<Result<Vec<_>, _>>()?;
        let known = if options.bounces > 1 { u64::from(hint_count) } else { 1 };
        let surroundings =
            empty_storage_buffer::<Surroundings>(device, "radiance hints surroundings", known)?;
        let low = empty_storage_buffer::<Vec3Pad>(device, "radiance hints irradiance", u64::from(low_count))?;
        let irradiance = if options.scale == Scale::Full {
            low.clone()
        } else {
            empty_storage_buffer::<Vec3Pad>(device, "irradiance", u64::from(pixels))?
        };
        let image = empty_storage_buffer::<Vec3Pad>(device, "indirect light", u64::from(pixels))?;
        let by_camera = options.visibility == Visibility::CameraDepth;
        let views = empty_storage_buffer::<ViewUniform>(device, "radiance hints views", maps as u64)?;

        let (sample_groups, near_groups): (_, Vec<Option<BindGroup>>) = (0..)
            .zip(&rsm.maps)
            .map(|(map, m)| {
                let index =
                    uniform_buffer(device, "radiance hints map", &MapIndex { map, slots, pad0: 0, pad1: 0 });
                let mut resources = vec![
                    (0, settings.as_entire_binding()),
                    (2, index.as_entire_binding()),
                    (3, m.surface.position.as_entire_binding()),
                    (4, m.surface.normal.as_entire_binding()),
                    (5, m.texels.as_entire_binding()),
                    (6, samples.as_entire_binding()),
                ];
                if matches!(options.sampling, Sampling::Disc { .. }) {
                    resources
                        .extend([(1, lattice_buffer.as_entire_binding()), (9, views.as_entire_binding())]);
                } else {
                    resources.extend([(7, m.nodes.as_entire_binding()), (8, rsm.tops.as_entire_binding())]);
                }
                let near = hints.near.as_ref().map(|kernel| {
                    let mut resources: Vec<_> =
                        resources.iter().filter(|(binding, _)| *binding != 8).cloned().collect();
                    resources.extend([
                        (1, lattice_buffer.as_entire_binding()),
                        (9, views.as_entire_binding()),
                        (10, windows.as_entire_binding()),
                    ]);
                    kernel.bind(device, 0, &resources)
                });
                (hints.sample.bind(device, 0, &resources), near)
            })
            .unzip();
        let near_groups = near_groups.into_iter().flatten().collect();

        let camera_view = empty_storage_buffer::<ViewUniform>(device, "radiance hints camera", 1)?;
        let mut depths = None;
        let occlusion = match &hints.occlusion {
            None => None,
            Some([copy, test]) => {
                let (count, seen) = if by_camera { (pixels, 1) } else { (texels, maps as u32) };
                let total = u64::from(count) * u64::from(seen);
                let buffer = empty_storage_buffer::<f32>(device, "radiance hints depths", total)?;
                let positions: Vec<&Buffer> = if by_camera {
                    vec![&camera.position]
                } else {
                    rsm.maps.iter().map(|m| &m.surface.position).collect()
                };
                let copies = (0..)
                    .zip(positions)
                    .map(|(i, positions)| {
                        let place = DepthCopy { first: i * count, count, pad0: 0, pad1: 0 };
                        let place = uniform_buffer(device, "radiance hints depths", &place);
                        let resources = [
                            (6, place.as_entire_binding()),
                            (7, positions.as_entire_binding()),
                            (8, buffer.as_entire_binding()),
                        ];
                        copy.bind(device, 0, &resources)
                    })
                    .collect();
                let looking = if by_camera { &camera_view } else { &views };
                let resources = [
                    (0, settings.as_entire_binding()),
                    (1, lattice_buffer.as_entire_binding()),
                    (2, samples.as_entire_binding()),
                    (3, looking.as_entire_binding()),
                    (4, buffer.as_entire_binding()),
                    (5, blocked.as_entire_binding()),
                    (9, windows.as_entire_binding()),
                ];
                let test = test.bind(device, 0, &resources);
                depths = Some(buffer);
                Some(OcclusionGroups { copies, test, texels: count })
            }
        };

        let estimate_group = hints.estimate.bind(
            device,
            0,
            &[
                (0, settings.as_entire_binding()),
                (1, lattice_buffer.as_entire_binding()),
                (2, samples.as_entire_binding()),
                (3, blocked.as_entire_binding()),
                (4, volumes[0].as_entire_binding()),
                (5, surroundings.as_entire_binding()),
                (6, windows.as_entire_binding()),
            ],
        );
        let stops_group = match (&hints.stops, &depths) {
            (Some(kernel), Some(depths)) => {
                let resources = [
                    (0, settings.as_entire_binding()),
                    (1, lattice_buffer.as_entire_binding()),
                    (2, views.as_entire_binding()),
                    (3, depths.as_entire_binding()),
                    (4, stops.as_entire_binding()),
                ];
                Some(kernel.bind(device, 0, &resources))
            }
            _ => None,
        };
        let bounce_settings: Vec<_> = (2..=options.bounces)
            .map(|_| uniform_buffer(device, "radiance hints bounce", &Settings::zeroed()))
            .collect();
        let bounce_groups = match &hints.bounce {
            None => Vec::new(),
            Some(kernels) => (2..=options.bounces)
                .zip(&bounce_settings)
                .map(|(number, settings)| {
                    let (last, next) = (&volumes[volume_of(number - 1)], &volumes[volume_of(number)]);
                    let group = |transport: Transport| {
                        let base = if transport == Transport::SphereAsPrinted { last } else { &volumes[0] };
                        let mut resources = vec![
                            (0, settings.as_entire_binding()),
                            (1, lattice_buffer.as_entire_binding()),
                            (2, last.as_entire_binding()),
                            (3, base.as_entire_binding()),
                            (4, surroundings.as_entire_binding()),
                            (5, next.as_entire_binding()),
                        ];
                        if transport == Transport::Directions {
                            resources.push((6, stops.as_entire_binding()));
                        }
                        kernels[transport as usize].bind(device, 0, &resources)
                    };
                    [Transport::Directions, Transport::Sphere, Transport::SphereAsPrinted].map(group)
                })
                .collect(),
        };
        let reduced = uniform_buffer(device, "radiance hints reduced", &reduced);
        let field = &volumes[volume_of(options.bounces)];
        let mut read = vec![
            (0, settings.as_entire_binding()),
            (1, lattice_buffer.as_entire_binding()),
            (2, field.as_entire_binding()),
            (3, camera.position.as_entire_binding()),
            (4, camera.normal.as_entire_binding()),
            (5, reduced.as_entire_binding()),
            (6, low.as_entire_binding()),
        ];
        let reconstruct_group = hints.reconstruct.bind(device, 0, &read);
        read.push((7, irradiance.as_entire_binding()));
        let upsample_group = hints.upsample.as_ref().map(|kernel| kernel.bind(device, 0, &read));
        let shade_group = hints.shade.bind(
            device,
            0,
            &[
                (0, camera.albedo.as_entire_binding()),
                (1, irradiance.as_entire_binding()),
                (2, image.as_entire_binding()),
            ],
        );
        Ok(Self {
            rsm,
            samples,
            windows,
            blocked,
            stops,
            volumes,
            surroundings,
            low,
            irradiance,
            image,
            slots,
            hint_count,
            low_count,
            pixels,
            sample_groups,
            near_groups,
            occlusion,
            estimate_group,
            stops_group,
            bounce_groups,
            reconstruct_group,
            upsample_group,
            shade_group,
            transport: Transport::default(),
            options,
            maps: maps as u32,
            camera_size: camera.size(),
            settings,
            bounce_settings,
            lattice: lattice_buffer,
            views,
            camera_view,
            depths,
            _no_camera: no_camera,
        })
    }

    /// Sets what changes from frame to frame: lights and their views, the camera, where the lattice is, parameters. Call it
    /// before the first [`RadianceHints::encode`], and again when something changes.
    ///
    /// # Errors
    /// [`Error::BadOption`] where `params` are out of range, [`Error::HintCount`] for a lattice with another number of hints,
    /// [`Error::MapCount`] or [`Error::Rsm`] where `views` do not fit maps and lights.
    pub fn prepare(
        &mut self,
        queue: &Queue,
        (lights, views): (&[Light], &[MapView]),
        camera: &View,
        lattice: &Lattice,
        params: &Params,
    ) -> Result<(), Error> {
        params.validate()?;
        if views.len() != self.maps as usize {
            return Err(Error::MapCount { available: self.maps as usize, needed: views.len() });
        }
        if lattice.hints() != self.hint_count {
            let (available, needed) = (self.hint_count as usize, lattice.hints() as usize);
            return Err(Error::HintCount { available, needed });
        }
        self.rsm.prepare(
            queue,
            lights,
            views,
            &rsm::Params { seed: params.seed, ..rsm::Params::default() },
        )?;
        let mut volume = [Volume::zeroed(); VOLUMES];
        volume[..lattice.volumes().len()].copy_from_slice(lattice.volumes());
        let uniform = LatticeUniform {
            volumes: lattice.volumes().len() as u32,
            hints: self.hint_count,
            pad0: 0,
            pad1: 0,
            volume,
        };
        queue.write_buffer(&self.lattice, 0, bytemuck::bytes_of(&uniform));
        let settings = self.settings_of(params);
        queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&settings));
        for (number, buffer) in (2..).zip(&self.bounce_settings) {
            let seed = indirect_sampling::rng::hash_combine(params.seed, number);
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(&Settings { seed, ..settings }));
        }
        let n = self.options.resolution;
        let of_map = |(i, v): (u32, &MapView)| ViewUniform::new(&v.view, [n, n], i * n * n);
        let uniforms: Vec<_> = (0..).zip(views).map(of_map).collect();
        queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&uniforms));
        let camera = ViewUniform::new(camera, self.camera_size, 0);
        queue.write_buffer(&self.camera_view, 0, bytemuck::bytes_of(&camera));
        self.transport = params.transport;
        Ok(())
    }

    fn settings_of(&self, params: &Params) -> Settings {
        let options = &self.options;
        let (sampling, fraction) = match options.sampling {
            Sampling::Importance | Sampling::Nearby => (0, 0.0),
            Sampling::Disc { fraction } => (1, fraction),
        };
        let Enclosure { albedo, depth } = params.enclosure.unwrap_or_default();
        let enclosure = core::array::from_fn(|face| albedo[face].extend(depth[face]).to_array());
        Settings {
            samples: options.samples,
            maps: self.maps,
            resolution: options.resolution,
            seed: params.seed,
            jitter: params.jitter,
            footprint: params.footprint,
            range: params.range,
            fraction,
            vectors: options.order.vectors(),
            bounce_samples: options.bounce_samples,
            sampling,
            words: options.words(),
            as_printed: u32::from(params.reconstruction == Reconstruction::AsPrinted),
            enclosed: u32::from(params.enclosure.is_some()),
            side: options.side(),
            near: options.near(),
            stop_words: options.stop_words(),
            direction_seed: indirect_sampling::rng::hash_combine(params.seed, 0),
            pad0: 0,
            pad1: 0,
            enclosure,
        }
    }

    /// The hints after the last bounce.
    #[must_use]
    pub fn field(&self) -> &Buffer {
        &self.volumes[volume_of(self.options.bounces)]
    }

    /// GPU memory, bytes: the maps', 64 for each sample of lists and windows, [`Options::hint_bytes`] of the hints, and what else the
    /// options ask for.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.samples,
            &self.windows,
            &self.blocked,
            &self.surroundings,
            &self.low,
            &self.image,
            &self.settings,
        ];
        let rest = [&self.lattice, &self.views, &self.camera_view];
        let mut bytes: u64 = own.iter().chain(&rest).map(|b| b.size()).sum();
        bytes += self.volumes.iter().chain(&self.bounce_settings).map(Buffer::size).sum::<u64>();
        bytes += self.depths.as_ref().map_or(0, Buffer::size);
        if self.options.scale != Scale::Full {
            bytes += self.irradiance.size();
        }
        bytes + self.rsm.bytes()
    }
}

/// Which of the volumes holds the hints after bounce `number`.
pub(super) const fn volume_of(number: u32) -> usize {
    match number {
        0 | 1 => 0,
        n => 1 + (n % 2) as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{
        RADIANCE_HINTS_BOUNCE, RADIANCE_HINTS_ESTIMATE, RADIANCE_HINTS_OCCLUSION, RADIANCE_HINTS_RECONSTRUCT,
        RADIANCE_HINTS_SAMPLE,
    };
    use testkit::{assert_layout, layout::check_constant};

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        assert_layout!(RADIANCE_HINTS_SAMPLE, "MapIndex" = MapIndex { map, slots, pad0, pad1 });
        assert_layout!(RADIANCE_HINTS_OCCLUSION, "DepthCopy" = DepthCopy { first, count, pad0, pad1 });
        assert_layout!(RADIANCE_HINTS_RECONSTRUCT, "Reduced" = Reduced { size, small, step, pad0 });
        assert_layout!(
            RADIANCE_HINTS_SAMPLE,
            "Sample" = Sample { position, area, normal, map, flux, texel, incident, pad1 }
        );
        assert_layout!(RADIANCE_HINTS_SAMPLE, "Window" = Window { first, end, map, score, pad0, pad1 });
        assert_layout!(
            RADIANCE_HINTS_BOUNCE,
            "Volume" = Volume { origin, first, cell, room, resolution, pad1 }
        );
        assert_layout!(
            RADIANCE_HINTS_BOUNCE,
            "Lattice" = LatticeUniform { volumes, hints, pad0, pad1, volume }
        );
        assert_layout!(RADIANCE_HINTS_ESTIMATE, "Surroundings" = Surroundings { albedo, r_min, r_max });
        assert_layout!(
            RADIANCE_HINTS_ESTIMATE,
            "Settings" = Settings {
                samples,
                maps,
                resolution,
                seed,
                jitter,
                footprint,
                range,
                fraction,
                vectors,
                bounce_samples,
                sampling,
                words,
                as_printed,
                enclosed,
                side,
                near,
                stop_words,
                direction_seed,
                pad0,
                pad1,
                enclosure
            }
        );
        check_constant(&RADIANCE_HINTS_ESTIMATE, "INTERLEAVE", crate::INTERLEAVE).unwrap();
    }

    #[cfg(feature = "cpu")]
    #[test]
    fn constants_are_the_same_in_wgsl() {
        use crate::cpu::{bounce, depths, field, near, reconstruct, stops};
        let numbers = [
            (&RADIANCE_HINTS_SAMPLE, "REACH", near::REACH),
            (&RADIANCE_HINTS_SAMPLE, "SPAN", near::SPAN),
            (&RADIANCE_HINTS_SAMPLE, "OFF_CENTRE", near::OFF_CENTRE),
            (&RADIANCE_HINTS_RECONSTRUCT, "NEAR_RADIUS", reconstruct::NEAR_RADIUS),
            (&RADIANCE_HINTS_RECONSTRUCT, "NEAR_LIFT", reconstruct::NEAR_LIFT),
            (&RADIANCE_HINTS_RECONSTRUCT, "FAR_LIFT", reconstruct::FAR_LIFT),
            (&RADIANCE_HINTS_RECONSTRUCT, "MOST_GAIN", reconstruct::MOST_GAIN),
            (&RADIANCE_HINTS_RECONSTRUCT, "LEAST_SHARE", field::LEAST_SHARE),
        ];
        numbers.into_iter().for_each(|(module, name, value)| check_constant(module, name, value).unwrap());
        let counts = [
            (&RADIANCE_HINTS_OCCLUSION, "STEPS", depths::STEPS),
            (&RADIANCE_HINTS_OCCLUSION, "REFINEMENTS", depths::REFINEMENTS),
            (&RADIANCE_HINTS_BOUNCE, "OPEN", stops::OPEN),
            (&RADIANCE_HINTS_BOUNCE, "PLACES", bounce::PLACES),
        ];
        counts.into_iter().for_each(|(module, name, value)| check_constant(module, name, value).unwrap());
    }
}
