use bytemuck::Pod;
use indirect_core::GBuffer;
use indirect_gpu::wgpu::{Buffer, CommandEncoder, CommandEncoderDescriptor, Device, Queue};
use indirect_gpu::{GBufferTarget, PassTimer, SceneBuffers, Vec3Pad, read_buffer};

use crate::{
    Error, Map, Vpl, cpu,
    gpu::{Resources, Rsm},
    layout::{Node, Texel},
};

/// Contents of a buffer.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Numbers that agree up to rounding: 1e-4 relative, 1e-6 of the buffer's unit absolute.
    F32 {
        /// All components of all elements.
        values: Vec<f32>,
        /// Components per element.
        components: usize,
    },
    /// Numbers that agree exactly.
    U32(Vec<u32>),
}

impl Data {
    fn of<T: Pod>(elements: &[T]) -> Self {
        Self::F32 { values: bytemuck::cast_slice(elements).to_vec(), components: size_of::<T>() / 4 }
    }

    /// One field of every element: a struct mixes units, which one tolerance cannot.
    fn field<T, F: Pod>(elements: &[T], get: impl Fn(&T) -> F) -> Self {
        Self::of(&elements.iter().map(get).collect::<Vec<_>>())
    }
}

/// One buffer, as the CPU's and as the GPU's pass left it.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// Name of the pass.
    pub pass: &'static str,
    /// What the buffer, or one field of its elements, holds.
    pub buffer: String,
    /// Number of the map, for buffers of which each map has one.
    pub map: Option<usize>,
    /// What the CPU computed.
    pub cpu: Data,
    /// What the GPU computed.
    pub gpu: Data,
}

/// Runs every GPU pass on what the *CPU's* preceding passes computed and returns all buffers beside their twins, so that a
/// difference shows in the pass that makes it and nowhere else. Submits and blocks: for tests and tools.
///
/// `resources` must have been prepared with the views, lights and parameters that made `expected`, which was gathered for
/// `camera`; `camera_buffers` are the target that `resources` were made for. Their contents are overwritten.
///
/// # Errors
/// [`Error::Gpu`] where a buffer cannot be read back, [`Error::MapCount`] where `resources` hold another number of maps.
pub fn twins(
    (device, queue): (&Device, &Queue),
    rsm: &Rsm,
    resources: &Resources,
    scene: &SceneBuffers,
    camera: &GBuffer,
    camera_buffers: &GBufferTarget,
    expected: &cpu::Output,
) -> Result<Vec<Twin>, Error> {
    let maps = &expected.rsm.maps;
    if maps.len() != resources.maps.len() {
        return Err(Error::MapCount { available: resources.maps.len(), needed: maps.len() });
    }
    let gpu = Gpu { device, queue };
    let timer = &mut PassTimer::off();
    let mut twins = Vec::new();

    gpu.run(|encoder| rsm.encode_surface(encoder, timer, scene, resources))?;
    for (i, (map, m)) in maps.iter().zip(&resources.maps).enumerate() {
        let s = Surface::of(&map.surface);
        let mut add = |buffer: &str, cpu, gpu| {
            twins.push(Twin { pass: "surface", buffer: buffer.to_owned(), map: Some(i), cpu, gpu });
        };
        add("position and depth", Data::of(&s.position), gpu.read::<Vec3Pad>(&m.surface.position)?);
        add("normal", Data::of(&s.normal), gpu.read::<Vec3Pad>(&m.surface.normal)?);
        add("albedo", Data::of(&s.albedo), gpu.read::<Vec3Pad>(&m.surface.albedo)?);
        let triangle = read_buffer(device, queue, &m.surface.triangle)?;
        add("triangle", Data::U32(map.surface.triangle.clone()), Data::U32(triangle));
        s.upload(queue, &map.surface, &m.surface);
    }

    gpu.run(|encoder| rsm.encode_flux(encoder, timer, resources))?;
    for (i, (map, m)) in maps.iter().zip(&resources.maps).enumerate() {
        let found: Vec<Texel> = read_buffer(device, queue, &m.texels)?;
        let mut add = |buffer: &str, field: fn(&Texel) -> [f32; 3]| {
            let (cpu, gpu) = (Data::field(&map.texels, field), Data::field(&found, field));
            twins.push(Twin { pass: "flux", buffer: buffer.to_owned(), map: Some(i), cpu, gpu });
        };
        add("incident", |t| t.incident.to_array());
        add("reflected", |t| t.reflected.to_array());
        let area = |texels: &[Texel]| Data::field(texels, |t| t.area);
        let (cpu, gpu) = (area(&map.texels), area(&found));
        twins.push(Twin { pass: "flux", buffer: "area".to_owned(), map: Some(i), cpu, gpu });
        queue.write_buffer(&m.texels, 0, bytemuck::cast_slice(&map.texels));
    }

    gpu.run(|encoder| rsm.encode_pyramid(encoder, timer, resources))?;
    for (i, (map, m)) in maps.iter().zip(&resources.maps).enumerate() {
        twins.extend(gpu.pyramid(i, map, &m.nodes)?);
        queue.write_buffer(&m.nodes, 0, bytemuck::cast_slice(&map.pyramid.nodes));
    }
    let tops: Vec<_> = maps.iter().map(|m| m.pyramid.top()).collect();
    queue.write_buffer(&resources.tops, 0, bytemuck::cast_slice(&tops));

    gpu.run(|encoder| rsm.encode_vpls(encoder, timer, resources))?;
    let mut found: Vec<Vpl> = read_buffer(device, queue, &resources.slots)?;
    found.truncate(expected.slots.len());
    twins.extend(vpl_twins("vpls", &expected.slots, &found));
    queue.write_buffer(&resources.slots, 0, bytemuck::cast_slice(&expected.slots));

    gpu.run(|encoder| {
        rsm.encode_compact(encoder, timer, resources);
        Ok(())
    })?;
    let counts = read_buffer::<u32>(device, queue, &resources.gather.count)?;
    let (cpu, gpu_count) = (Data::U32(vec![expected.vpls.len() as u32]), Data::U32(counts));
    twins.push(Twin { pass: "compact", buffer: "count".to_owned(), map: None, cpu, gpu: gpu_count });
    let mut found: Vec<Vpl> = read_buffer(device, queue, &resources.gather.vpls)?;
    found.truncate(expected.vpls.len());
    twins.extend(vpl_twins("compact", &expected.vpls, &found));
    resources.gather.write_vpls(queue, &expected.vpls);

    Surface::of(camera).upload(queue, camera, camera_buffers);
    gpu.run(|encoder| rsm.encode_gather(encoder, timer, resources))?;
    let mut irradiance = vec![Vec3Pad::default(); camera.len()];
    for (&i, e) in expected.texels.iter().zip(&expected.irradiance) {
        irradiance[i as usize] = Vec3Pad::new(*e, 0.0);
    }
    let found = gpu.read::<Vec3Pad>(&resources.gather.irradiance)?;
    let cpu = Data::of(&irradiance);
    twins.push(Twin { pass: "gather", buffer: "irradiance".to_owned(), map: None, cpu, gpu: found });
    queue.write_buffer(&resources.gather.irradiance, 0, bytemuck::cast_slice(&irradiance));

    gpu.run(|encoder| rsm.encode_shade(encoder, timer, resources))?;
    let image: Vec<_> = expected.image.pixels.iter().map(|p| Vec3Pad::new(*p, 0.0)).collect();
    let (cpu, found) = (Data::of(&image), gpu.read::<Vec3Pad>(&resources.image)?);
    twins.push(Twin { pass: "shade", buffer: "image".to_owned(), map: None, cpu, gpu: found });
    Ok(twins)
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

    fn read<T: Pod>(&self, buffer: &Buffer) -> Result<Data, Error> {
        Ok(Data::of(&read_buffer::<T>(self.device, self.queue, buffer)?))
    }

    /// The pyramid's levels apart: their names tell in which one a difference begins.
    fn pyramid(&self, i: usize, map: &Map, nodes: &Buffer) -> Result<Vec<Twin>, Error> {
        let found: Vec<Node> = read_buffer(self.device, self.queue, nodes)?;
        let mut twins = Vec::new();
        for (k, level) in map.pyramid.layout.levels.iter().enumerate() {
            let (cpu, gpu) = (map.pyramid.level(k), &found[level.offset as usize..][..level.len()]);
            let mut add = |field: &str, cpu, gpu| {
                let buffer = format!("level {k} {field}");
                twins.push(Twin { pass: "pyramid", buffer, map: Some(i), cpu, gpu });
            };
            let reflected = |nodes: &[Node]| Data::field(nodes, |n| n.reflected);
            add("reflected", reflected(cpu), reflected(gpu));
            let incident = |nodes: &[Node]| Data::field(nodes, |n| n.incident);
            add("incident", incident(cpu), incident(gpu));
            let depth = |nodes: &[Node]| Data::field(nodes, |n| [n.depth_min, n.depth_max]);
            add("depth", depth(cpu), depth(gpu));
            let axis = |nodes: &[Node]| Data::field(nodes, |n| n.cone_axis);
            add("cone axis", axis(cpu), axis(gpu));
            let versine = |nodes: &[Node]| Data::field(nodes, |n| n.cone_versine);
            add("cone versine", versine(cpu), versine(gpu));
        }
        Ok(twins)
    }
}

/// The fields of a list of VPLs.
fn vpl_twins(pass: &'static str, cpu: &[Vpl], gpu: &[Vpl]) -> Vec<Twin> {
    let twin = |buffer: &str, field: fn(&Vpl) -> [f32; 3]| {
        let (cpu, gpu) = (Data::field(cpu, field), Data::field(gpu, field));
        Twin { pass, buffer: buffer.to_owned(), map: None, cpu, gpu }
    };
    let area = |vpls: &[Vpl]| Data::field(vpls, |v| v.area);
    vec![
        twin("position", |v| v.position.to_array()),
        twin("normal", |v| v.normal.to_array()),
        twin("flux", |v| v.flux.to_array()),
        Twin { pass, buffer: "area".to_owned(), map: None, cpu: area(cpu), gpu: area(gpu) },
    ]
}

/// A G-buffer as the GPU lays it out.
struct Surface {
    position: Vec<Vec3Pad>,
    normal: Vec<Vec3Pad>,
    albedo: Vec<Vec3Pad>,
}

impl Surface {
    fn of(g: &GBuffer) -> Self {
        let position = g.position.iter().zip(&g.depth).map(|(p, depth)| Vec3Pad::new(*p, *depth)).collect();
        let pad = |v: &[glam::Vec3]| v.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
        Self { position, normal: pad(&g.normal), albedo: pad(&g.albedo) }
    }

    fn upload(&self, queue: &Queue, g: &GBuffer, target: &GBufferTarget) {
        queue.write_buffer(&target.position, 0, bytemuck::cast_slice(&self.position));
        queue.write_buffer(&target.normal, 0, bytemuck::cast_slice(&self.normal));
        queue.write_buffer(&target.albedo, 0, bytemuck::cast_slice(&self.albedo));
        queue.write_buffer(&target.triangle, 0, bytemuck::cast_slice(&g.triangle));
    }
}
