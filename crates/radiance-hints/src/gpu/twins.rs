use bytemuck::Pod;
use indirect_core::GBuffer;
use indirect_gpu::wgpu::{Buffer, CommandEncoder, CommandEncoderDescriptor, Device, Queue};
use indirect_gpu::{GBufferTarget, PassTimer, Vec3Pad, read_buffer};
use rsm::gpu::{Data, Twin};

use super::{RadianceHints, Resources, resources::volume_of};
use crate::{Error, Sample, Scale, Surroundings, Window, cpu};

/// Runs every GPU pass after the maps on what the *CPU's* preceding passes computed and returns all buffers beside their
/// twins, so that a difference shows in the pass that makes it and nowhere else. Submits and blocks: for tests and tools.
///
/// `resources` must have been prepared with the views, lights, lattice and parameters that made `expected` for `camera`;
/// `camera_buffers` are the target that `resources` were made for. Their contents are overwritten. The maps themselves are
/// compared by [`rsm::gpu::twins`].
///
/// In the buffers of `occlusion` and `stops` a word may differ where a segment grazes a texel's border, and in `near` a window where a
/// hint's projection does: count them.
///
/// # Errors
/// [`Error::Gpu`] where a buffer cannot be read back, [`Error::MapCount`] where `resources` hold another number of maps.
pub fn twins(
    (device, queue): (&Device, &Queue),
    hints: &RadianceHints,
    resources: &Resources,
    camera: &GBuffer,
    camera_buffers: &GBufferTarget,
    expected: &cpu::Output,
) -> Result<Vec<Twin>, Error> {
    let maps = &expected.rsm.maps;
    if maps.len() != resources.rsm.maps.len() {
        return Err(Error::MapCount { available: resources.rsm.maps.len(), needed: maps.len() });
    }
    let gpu = Gpu { device, queue };
    let timer = &mut PassTimer::off();
    let mut twins = Vec::new();
    let mut add = |pass, buffer: String, cpu, gpu| twins.push(Twin { pass, buffer, map: None, cpu, gpu });

    for (map, m) in maps.iter().zip(&resources.rsm.maps) {
        gpu.surface(&map.surface, &m.surface);
        gpu.write(&m.texels, &map.texels);
        gpu.write(&m.nodes, &map.pyramid.nodes);
    }
    let tops: Vec<_> = maps.iter().map(|m| m.pyramid.top()).collect();
    gpu.write(&resources.rsm.tops, &tops);
    gpu.surface(camera, camera_buffers);

    gpu.run(|encoder| hints.encode_sample(encoder, timer, resources))?;
    let mut found: Vec<Sample> = gpu.read(&resources.samples)?;
    found.truncate(expected.samples.len());
    samples("sample", &expected.samples, &found, &mut add);
    gpu.write(&resources.samples, &expected.samples);

    let near = &expected.near;
    if !near.windows.is_empty() {
        gpu.run(|encoder| hints.encode_near(encoder, timer, resources))?;
        let windows: Vec<Window> = gpu.read(&resources.windows)?;
        let mut found: Vec<Sample> = gpu.read(&resources.samples)?;
        let mut found = found.split_off(expected.samples.len());
        // Another window, other samples: counted once, as a window.
        let count = hints.options().draw(0).near() as usize;
        let place = |w: &Window| [w.first[0], w.first[1], w.end[0], w.end[1], w.map];
        for (i, (a, b)) in near.windows.iter().zip(&windows).enumerate() {
            if place(a) != place(b) || a.first == a.end {
                let own = i * count..(i + 1) * count;
                found[own.clone()].copy_from_slice(&near.samples[own]);
            }
        }
        let places = |w: &[Window]| Data::U32(w.iter().flat_map(place).collect());
        add("near", "windows".to_owned(), places(&near.windows), places(&windows));
        samples("near", &near.samples, &found, &mut add);
        let mut all = expected.samples.clone();
        all.extend(&near.samples);
        gpu.write(&resources.samples, &all);
        gpu.write(&resources.windows, &near.windows);
    }

    if !expected.blocked.is_empty() {
        gpu.run(|encoder| hints.encode_occlusion(encoder, timer, resources))?;
        let found = gpu.read::<u32>(&resources.blocked)?;
        add("occlusion", "blocked".to_owned(), Data::U32(expected.blocked.clone()), Data::U32(found));
        gpu.write(&resources.blocked, &expected.blocked);
    }

    let numbers = hints.options().order.vectors() as usize * 4;
    gpu.run(|encoder| hints.encode_estimate(encoder, timer, resources))?;
    let found = gpu.read::<f32>(&resources.volumes[0])?;
    add(
        "estimate",
        "hints".to_owned(),
        floats(bytemuck::cast_slice(&expected.bounces[0]).to_vec(), numbers),
        floats(found, numbers),
    );
    gpu.write(&resources.volumes[0], &expected.bounces[0]);
    if !expected.surroundings.is_empty() {
        let found: Vec<Surroundings> = gpu.read(&resources.surroundings)?;
        let albedo = |s: &[Surroundings]| floats(s.iter().flat_map(|s| s.albedo).collect(), 3);
        let distances = |s: &[Surroundings]| floats(s.iter().flat_map(|s| [s.r_min, s.r_max]).collect(), 2);
        add("estimate", "albedo".to_owned(), albedo(&expected.surroundings), albedo(&found));
        add("estimate", "distances".to_owned(), distances(&expected.surroundings), distances(&found));
        gpu.write(&resources.surroundings, &expected.surroundings);
    }

    if !expected.stops.is_empty() {
        gpu.run(|encoder| hints.encode_stops(encoder, timer, resources))?;
        let found = gpu.read::<u32>(&resources.stops)?;
        add("stops", "stops".to_owned(), Data::U32(expected.stops.clone()), Data::U32(found));
        gpu.write(&resources.stops, &expected.stops);
    }

    for number in 2..=hints.options().bounces {
        gpu.run(|encoder| hints.encode_bounce(encoder, timer, resources, number))?;
        let (buffer, cpu) = (&resources.volumes[volume_of(number)], &expected.bounces[number as usize - 1]);
        let found = gpu.read::<f32>(buffer)?;
        add(
            "bounce",
            format!("hints after bounce {number}"),
            floats(bytemuck::cast_slice(cpu).to_vec(), numbers),
            floats(found, numbers),
        );
        gpu.write(buffer, cpu);
    }

    gpu.run(|encoder| hints.encode_reconstruct(encoder, timer, resources))?;
    let low = padded(&expected.low);
    let found = gpu.read::<f32>(&resources.low)?;
    add(
        "reconstruct",
        "irradiance".to_owned(),
        floats(bytemuck::cast_slice(&low).to_vec(), 4),
        floats(found, 4),
    );
    gpu.write(&resources.low, &low);

    if hints.options().scale != Scale::Full {
        gpu.run(|encoder| hints.encode_upsample(encoder, timer, resources))?;
        let full = padded(&expected.irradiance);
        let found = gpu.read::<f32>(&resources.irradiance)?;
        add(
            "upsample",
            "irradiance".to_owned(),
            floats(bytemuck::cast_slice(&full).to_vec(), 4),
            floats(found, 4),
        );
        gpu.write(&resources.irradiance, &full);
    }

    gpu.run(|encoder| hints.encode_shade(encoder, timer, resources))?;
    let image = padded(&expected.image.pixels);
    let found = gpu.read::<f32>(&resources.image)?;
    add("shade", "image".to_owned(), floats(bytemuck::cast_slice(&image).to_vec(), 4), floats(found, 4));
    Ok(twins)
}

/// Compares samples field by field.
fn samples(
    pass: &'static str,
    expected: &[Sample],
    found: &[Sample],
    add: &mut impl FnMut(&'static str, String, Data, Data),
) {
    let mut field = |name: &str, get: fn(&Sample) -> Vec<f32>| {
        let of = |s: &[Sample]| floats(s.iter().flat_map(get).collect(), get(&Sample::default()).len());
        add(pass, name.to_owned(), of(expected), of(found));
    };
    field("position", |s| s.position.to_array().to_vec());
    field("normal", |s| s.normal.to_array().to_vec());
    field("flux", |s| s.flux.to_array().to_vec());
    field("incident", |s| s.incident.to_array().to_vec());
    field("area", |s| vec![s.area]);
    let texels = |s: &[Sample]| Data::U32(s.iter().flat_map(|s| [s.map, s.texel]).collect());
    add(pass, "map and texel".to_owned(), texels(expected), texels(found));
}

fn floats(values: Vec<f32>, components: usize) -> Data {
    Data::F32 { values, components }
}

fn padded(values: &[glam::Vec3]) -> Vec<Vec3Pad> {
    values.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect()
}

struct Gpu<'a> {
    device: &'a Device,
    queue: &'a Queue,
}

impl Gpu<'_> {
    fn run(&self, encode: impl FnOnce(&mut CommandEncoder) -> Result<(), Error>) -> Result<(), Error> {
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        encode(&mut encoder)?;
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn read<T: Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, Error> {
        Ok(read_buffer(self.device, self.queue, buffer)?)
    }

    fn write<T: Pod>(&self, buffer: &Buffer, data: &[T]) {
        self.queue.write_buffer(buffer, 0, bytemuck::cast_slice(data));
    }

    fn surface(&self, g: &GBuffer, target: &GBufferTarget) {
        let position: Vec<_> = g.position.iter().zip(&g.depth).map(|(p, d)| Vec3Pad::new(*p, *d)).collect();
        self.write(&target.position, &position);
        self.write(&target.normal, &padded(&g.normal));
        self.write(&target.albedo, &padded(&g.albedo));
        self.write(&target.triangle, &g.triangle);
    }
}
