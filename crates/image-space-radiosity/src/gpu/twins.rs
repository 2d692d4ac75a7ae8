use bytemuck::Pod;
use glam::Vec3;
use indirect_core::GBuffer;
use indirect_gpu::wgpu::{Buffer, CommandEncoder, CommandEncoderDescriptor, Device, Queue};
use indirect_gpu::{GBufferTarget, PassTimer, Vec3Pad, read_buffer};
use rsm::gpu::{Data, Twin};
use rsm::{PyramidLayout, Vpl};

use super::{ImageSpaceRadiosity, Resources};
use crate::{
    Error, Lights, Method, cpu,
    layout::{Block, Branch, Patch},
};

/// Runs every GPU pass after the maps on what the *CPU's* preceding passes computed and returns all buffers beside their twins,
/// so that a difference shows in the pass that makes it and nowhere else. Submits and blocks: for tests and tools. The maps have
/// their own: [`rsm::gpu::twins`].
///
/// `resources` must have been prepared with the views, lights and parameters that made `expected`, which was computed for
/// `camera`; `camera_buffers` are the target that `resources` were made for. Their contents are overwritten.
///
/// # Errors
/// [`Error::Gpu`] where a buffer cannot be read back, [`Error::Rsm`] where `resources` hold another number of maps.
pub fn twins(
    (device, queue): (&Device, &Queue),
    technique: &ImageSpaceRadiosity,
    resources: &Resources,
    camera: &GBuffer,
    camera_buffers: &GBufferTarget,
    expected: &cpu::Output,
) -> Result<Vec<Twin>, Error> {
    let (available, needed) = (resources.rsm.maps.len(), expected.rsm.maps.len());
    if available != needed {
        return Err(rsm::Error::MapCount { available, needed }.into());
    }
    let gpu = Gpu { device, queue };
    upload_surface(queue, camera, camera_buffers);
    for (map, m) in expected.rsm.maps.iter().zip(&resources.rsm.maps) {
        upload_surface(queue, &map.surface, &m.surface);
        gpu.write(&m.texels, &map.texels);
    }
    let mut twins = Twins { gpu, list: Vec::new() };
    twins.pyramids(technique, resources, expected)?;
    twins.lights(technique, resources, expected)?;
    if technique.options().method == Method::BoundedSplat {
        twins.gpu.run(|e| technique.encode_splat(e, &mut PassTimer::off(), resources))?;
        twins.vectors("splat", "irradiance", &resources.irradiance, &expected.irradiance.pixels)?;
    } else {
        twins.fragments(technique, resources, expected)?;
        twins.irradiance(technique, resources, camera, expected)?;
    }
    twins.gpu.run(|e| technique.encode_shade(e, &mut PassTimer::off(), resources))?;
    twins.vectors("shade", "image", &resources.image, &expected.image.pixels)?;
    Ok(twins.list)
}

struct Twins<'a> {
    gpu: Gpu<'a>,
    list: Vec<Twin>,
}

impl Twins<'_> {
    fn push(&mut self, pass: &'static str, buffer: &str, cpu: Data, gpu: Data) {
        self.list.push(Twin { pass, buffer: buffer.to_owned(), map: None, cpu, gpu });
    }

    /// One field of all elements, as many as the CPU has.
    fn field<T: Pod, F: Pod>(
        &mut self,
        (pass, buffer): (&'static str, &str),
        cpu: &[T],
        gpu: &[T],
        get: impl Fn(&T) -> F,
    ) {
        let data = |elements: &[T]| {
            let values: Vec<F> = elements.iter().map(&get).collect();
            Data::F32 { values: bytemuck::cast_slice(&values).to_vec(), components: size_of::<F>() / 4 }
        };
        let gpu = data(&gpu[..cpu.len().min(gpu.len())]);
        self.push(pass, buffer, data(cpu), gpu);
    }

    fn integers(
        &mut self,
        pass: &'static str,
        buffer: &str,
        found: &Buffer,
        cpu: &[u32],
    ) -> Result<(), Error> {
        let mut found: Vec<u32> = self.gpu.read(found)?;
        found.truncate(cpu.len());
        self.push(pass, buffer, Data::U32(cpu.to_vec()), Data::U32(found));
        Ok(())
    }

    /// A buffer of padded vectors, which is overwritten with the CPU's.
    fn vectors(
        &mut self,
        pass: &'static str,
        name: &str,
        buffer: &Buffer,
        cpu: &[Vec3],
    ) -> Result<(), Error> {
        let cpu: Vec<_> = cpu.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
        let found: Vec<Vec3Pad> = self.gpu.read(buffer)?;
        self.field((pass, name), &cpu, &found, |v| v.vec3());
        self.gpu.write(buffer, &cpu);
        Ok(())
    }

    fn pyramids(
        &mut self,
        t: &ImageSpaceRadiosity,
        r: &Resources,
        expected: &cpu::Output,
    ) -> Result<(), Error> {
        let timer = &mut PassTimer::off();
        if t.options().has_patches() && !expected.patches.is_empty() {
            self.gpu.run(|e| t.encode_patches(e, timer, r))?;
            let mut found: Vec<Patch> = Vec::new();
            for (buffer, cpu) in r.patches.iter().zip(&expected.patches) {
                let patches: Vec<Patch> = self.gpu.read(buffer)?;
                found.extend(&patches[..cpu.len()]);
                self.gpu.write(buffer, cpu);
            }
            let sources: Vec<Patch> = self.gpu.read(&r.sources)?;
            found.extend(&sources[..expected.sources.len()]);
            self.gpu.write(&r.sources, &expected.sources);
            let cpu = &[&expected.patches.concat()[..], &expected.sources].concat();
            self.field(("patches", "position"), cpu, &found, |p| p.position);
            self.field(("patches", "normal"), cpu, &found, |p| p.normal);
            self.field(("patches", "flux"), cpu, &found, |p| p.flux);
            self.field(("patches", "area"), cpu, &found, |p| p.area);
            self.field(("patches", "radius and relief"), cpu, &found, |p| [p.radius, p.relief]);
            self.field(("patches", "versine"), cpu, &found, |p| p.versine);
        }
        self.gpu.run(|e| t.encode_mips(e, timer, r))?;
        // A single pixel has no coarser blocks.
        if !expected.blocks.is_empty() {
            let found: Vec<Block> = self.gpu.read(&r.blocks)?;
            let cpu = &expected.blocks;
            self.field(("mips", "position"), cpu, &found, |b| b.position);
            self.field(("mips", "normal"), cpu, &found, |b| b.normal);
            self.field(("mips", "depth"), cpu, &found, |b| [b.depth_min, b.depth_max]);
            self.field(("mips", "radius"), cpu, &found, |b| b.radius);
            self.field(("mips", "versine"), cpu, &found, |b| b.versine);
            let found = &found[..cpu.len()];
            let pixels =
                |blocks: &[Block]| Data::U32(blocks.iter().flat_map(|b| [b.pixels, b.mixed]).collect());
            self.push("mips", "pixels", pixels(cpu), pixels(found));
            self.gpu.write(&r.blocks, cpu);
        }

        self.gpu.run(|e| {
            t.encode_sources(e, timer, r);
            Ok(())
        })?;
        let reference: Vec<f32> = self.gpu.read(&r.reference)?;
        self.field(("sources", "reference"), &[expected.reference], &reference, |v| *v);
        self.gpu.write(&r.reference, &[expected.reference]);
        Ok(())
    }

    fn vpls(&mut self, pass: &'static str, cpu: &[Vpl], found: &[Vpl]) {
        self.field((pass, "position"), cpu, found, |v| v.position);
        self.field((pass, "normal"), cpu, found, |v| v.normal);
        self.field((pass, "flux"), cpu, found, |v| v.flux);
        self.field((pass, "area"), cpu, found, |v| v.area);
    }

    fn lights(
        &mut self,
        t: &ImageSpaceRadiosity,
        r: &Resources,
        expected: &cpu::Output,
    ) -> Result<(), Error> {
        let timer = &mut PassTimer::off();
        match t.options().lights {
            Lights::Flat(_) => self.gpu.write(&r.rsm.slots, &expected.light_slots),
            Lights::Basic { .. } => {
                self.gpu.run(|e| t.encode_clusters(e, timer, r))?;
                let found: Vec<Vpl> = self.gpu.read(&r.clusters)?;
                let used = |vpls: &[Vpl]| {
                    let used = vpls.iter().take(expected.light_slots.len());
                    Data::U32(used.map(|v| u32::from(v.flux.element_sum() > 0.0)).collect())
                };
                if !expected.light_slots.is_empty() {
                    self.push("clusters", "levels", used(&expected.light_slots), used(&found));
                    self.vpls("clusters", &expected.light_slots, &found);
                }
                self.gpu.write(&r.clusters, &expected.light_slots);
            }
            Lights::Hierarchical { .. } => {
                if !expected.tree.is_empty() {
                    self.gpu.run(|e| t.encode_tree(e, timer, r))?;
                    let mut found: Vec<Branch> = Vec::new();
                    for part in &r.parts {
                        found.extend(self.gpu.read::<Branch>(&part.branches)?);
                    }
                    self.field(("tree", "position"), &expected.tree, &found, |b| b.position);
                    self.field(("tree", "normal"), &expected.tree, &found, |b| b.normal);
                    self.field(("tree", "flux"), &expected.tree, &found, |b| b.flux);
                    self.field(("tree", "area"), &expected.tree, &found, |b| b.area);
                    self.field(("tree", "reach"), &expected.tree, &found, |b| b.reach);
                    let next = |tree: &[Branch]| {
                        Data::U32(
                            tree.iter().take(expected.tree.len()).flat_map(|b| [b.next, b.child]).collect(),
                        )
                    };
                    self.push("tree", "links", next(&expected.tree), next(&found));
                    for part in &r.parts {
                        let [first, end] = part.range.map(|i| i as usize);
                        self.gpu.write(&part.branches, &expected.tree[first..end]);
                    }
                }
                return Ok(());
            }
        }
        self.gpu.run(|e| {
            t.encode_lights(e, timer, r);
            Ok(())
        })?;
        self.integers("lights", "count", &r.gather.count, &[expected.lights.len() as u32])?;
        let found: Vec<Vpl> = self.gpu.read(&r.gather.vpls)?;
        if !expected.lights.is_empty() {
            self.vpls("lights", &expected.lights, &found);
        }
        r.gather.write_vpls(self.gpu.queue, &expected.lights);
        Ok(())
    }

    fn fragments(
        &mut self,
        t: &ImageSpaceRadiosity,
        r: &Resources,
        expected: &cpu::Output,
    ) -> Result<(), Error> {
        let timer = &mut PassTimer::off();
        self.gpu.run(|e| t.encode_refine(e, timer, r))?;
        // A single pixel, or blocks of one pixel, need nothing.
        if !expected.needs.is_empty() {
            self.integers("refine", "needs", &r.needs, &expected.needs)?;
        }
        self.integers("refine", "states", &r.states, &expected.states)?;
        self.gpu.write(&r.needs, &expected.needs);
        self.gpu.write(&r.states, &expected.states);

        self.gpu.run(|e| t.encode_compact(e, timer, r))?;
        let fragments = &expected.fragments;
        self.integers("compact", "count", &r.totals, &[fragments.nodes.len() as u32])?;
        if !fragments.nodes.is_empty() {
            self.integers("compact", "nodes", &r.fragment_nodes, &fragments.nodes)?;
            // The slots of nodes that are not valid hold whatever a former frame left.
            let mut found: Vec<u32> = self.gpu.read(&r.slots)?;
            for (slot, state) in found.iter_mut().zip(&expected.states) {
                *slot *= u32::from(*state == crate::layout::state::VALID);
            }
            found.truncate(fragments.slots.len());
            self.push("compact", "slots", Data::U32(fragments.slots.clone()), Data::U32(found));
            let points =
                |get: fn(&(Vec3, Vec3)) -> Vec3| fragments.points.iter().map(get).collect::<Vec<_>>();
            self.vectors("compact", "positions", &r.positions, &points(|p| p.0))?;
            self.vectors("compact", "normals", &r.normals, &points(|p| p.1))?;
        }
        self.gpu.write(&r.slots, &fragments.slots);
        Ok(())
    }

    fn irradiance(
        &mut self,
        t: &ImageSpaceRadiosity,
        r: &Resources,
        camera: &GBuffer,
        expected: &cpu::Output,
    ) -> Result<(), Error> {
        let timer = &mut PassTimer::off();
        let pass = match (t.options().method, t.options().lights) {
            (Method::Gather, Lights::Hierarchical { .. }) => "traverse",
            (Method::Gather, _) => "gather",
            _ => "splat",
        };
        self.gpu.run(|e| {
            match pass {
                "traverse" => t.encode_traverse(e, timer, r),
                "gather" => t.encode_gather(e, timer, r),
                _ => t.encode_splat(e, timer, r)?,
            }
            Ok(())
        })?;
        if !expected.gathered.is_empty() {
            self.vectors(pass, "irradiance", &r.gather.irradiance, &expected.gathered)?;
        }
        if !expected.cuts.is_empty() {
            self.integers("traverse", "cuts", &r.cuts, &expected.cuts)?;
        }
        self.gpu.run(|e| t.encode_pull(e, timer, r))?;
        let layout = PyramidLayout::new(expected.image.size);
        let blocks = cpu::Blocks::new(camera, &expected.blocks);
        let (fragments, gathered) = (&expected.fragments, &expected.gathered);
        let pulled = cpu::pull(&blocks, &expected.states, fragments, gathered, &layout, r.coarsest);
        self.vectors("upsample", "pulled", &r.irradiance, &pulled.pixels)?;
        if !pulled.coarse.is_empty() {
            self.vectors("upsample", "pulled blocks", &r.coarse_irradiance, &pulled.coarse)?;
        }
        self.gpu.run(|e| t.encode_push(e, timer, r))?;
        self.vectors("upsample", "irradiance", &r.irradiance, &expected.irradiance.pixels)?;
        if !expected.irradiance.coarse.is_empty() {
            // Level by level: their names tell in which one a difference begins.
            let found: Vec<Vec3Pad> = self.gpu.read(&r.coarse_irradiance)?;
            let cpu: Vec<_> = expected.irradiance.coarse.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
            for (i, l) in layout.levels.iter().enumerate().take(r.coarsest + 1).skip(1) {
                let begin = l.offset as usize - camera.len();
                let level = begin..begin + l.len();
                let name = format!("level {i}");
                self.field(("upsample", &name), &cpu[level.clone()], &found[level], |v| v.vec3());
            }
            self.gpu.write(&r.coarse_irradiance, &cpu);
        }
        Ok(())
    }
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
}

/// A G-buffer as the GPU lays it out.
fn upload_surface(queue: &Queue, g: &GBuffer, target: &GBufferTarget) {
    let pad = |v: &[Vec3]| v.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect::<Vec<_>>();
    let position = g.position.iter().zip(&g.depth).map(|(p, depth)| Vec3Pad::new(*p, *depth));
    let position: Vec<_> = position.collect();
    queue.write_buffer(&target.position, 0, bytemuck::cast_slice(&position));
    queue.write_buffer(&target.normal, 0, bytemuck::cast_slice(&pad(&g.normal)));
    queue.write_buffer(&target.albedo, 0, bytemuck::cast_slice(&pad(&g.albedo)));
    queue.write_buffer(&target.triangle, 0, bytemuck::cast_slice(&g.triangle));
}
