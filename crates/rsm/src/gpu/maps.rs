use bytemuck::{Pod, Zeroable};
use indirect_core::{Light, MapView};
use indirect_gpu::shaders::{RSM_FLUX, RSM_PYRAMID};
use indirect_gpu::wgpu::{Buffer, BufferUsages, Device, Queue};
use indirect_gpu::{
    GBufferTarget, GpuError, Named, Pass, Pipelines, Plan, Uniforms, buffers, empty_storage_buffer, named,
    uniform_buffer,
};
use indirect_technique::gpu::Exchange;

use crate::{
    Error, PyramidLayout, Rsm,
    layout::{LightMap, Node, Texel},
};

/// Most nodes of a level that one workgroup makes together with all levels above it.
const TOP_NODES: usize = 32 * 32;

indirect_core::wgsl_struct! {
    /// Where the levels lie, and which of them a dispatch makes.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct PyramidLevels = "PyramidLevels" {
        pub(crate) levels: [[u32; 4]; 16],
        pub(crate) first: u32,
        pub(crate) count: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
    }
}

/// Texels along each side of a map, and whether it has a pyramid.
#[derive(Debug, Clone, Copy)]
pub struct MapSizes {
    resolution: u32,
    pyramids: bool,
}

buffers! {
    /// Buffers of one map, beside its surface.
    pub struct MapBuffers for MapSizes {
        /// One per texel.
        texels: [Texel] = |s| u64::from(s.resolution) * u64::from(s.resolution);
        /// Laid out as [`PyramidLayout`] says; one without pyramids.
        nodes: [Node] = |s| if s.pyramids { PyramidLayout::new([s.resolution; 2]).len() as u64 } else { 0 };
    }
}

/// One map.
#[derive(Debug, Clone)]
pub struct MapResources {
    /// What the light sees.
    pub surface: GBufferTarget,
    /// The light in it.
    pub buffers: MapBuffers,
    lights: Uniforms<LightMap>,
    index: usize,
}

impl MapResources {
    /// Its buffers as kernels bind them: `positions`, `normals`, `albedos`, `triangles`, `texels`, `nodes`, `map`.
    #[must_use]
    pub fn named(&self) -> Vec<Named<'_>> {
        let mut named = self.buffers.named();
        named.push(("map", self.lights.binding(self.index)));
        named.extend(self.surface.named());
        named
    }
}

/// The maps of all lights: what [`Rsm`] is on the CPU. Needs no camera.
#[derive(Debug, Clone)]
pub struct Maps {
    /// One per map.
    pub maps: Vec<MapResources>,
    /// `array<Node>`: the last node of each map's pyramid.
    pub tops: Buffer,
    resolution: u32,
    layout: PyramidLayout,
    levels: Vec<Buffer>,
}

impl Maps {
    /// What `maps` maps of `resolution`² texels will allocate.
    #[must_use]
    pub fn plan(resolution: u32, maps: usize) -> Plan {
        Self::plan_with(resolution, maps, true)
    }

    /// [`Self::plan`] with or without pyramids.
    #[must_use]
    pub fn plan_with(resolution: u32, maps: usize, pyramids: bool) -> Plan {
        let mut plan = GBufferTarget::plan_of_many([resolution; 2], maps);
        let sizes = MapSizes { resolution, pyramids };
        for _ in 0..maps {
            plan = plan.and(MapBuffers::plan(&sizes));
        }
        if maps > 0 {
            plan.uniforms::<LightMap>("map", maps);
        }
        plan.storage::<Node>("tops", maps as u64, BufferUsages::empty());
        for _ in dispatches(&PyramidLayout::new([resolution.max(1); 2])) {
            plan.uniform::<PyramidLevels>("levels");
        }
        plan
    }

    /// Buffers for `maps` maps, as many as the lights have [`views`](crate::views::views).
    ///
    /// # Errors
    /// [`GpuError::Limit`], and [`GpuError::EmptySize`] for a resolution of 0.
    pub fn new(device: &Device, resolution: u32, maps: usize) -> Result<Self, GpuError> {
        Self::with(device, resolution, maps, true)
    }

    /// [`Self::new`] with or without pyramids, for techniques that do not always run [`Self::pyramid`].
    ///
    /// # Errors
    /// As there.
    pub fn with(device: &Device, resolution: u32, maps: usize, pyramids: bool) -> Result<Self, GpuError> {
        let layout = PyramidLayout::new([resolution.max(1); 2]);
        let lights = Uniforms::new(device, "map", maps);
        let map = |(index, surface)| {
            let buffers = MapBuffers::new(device, &MapSizes { resolution, pyramids })?;
            Ok(MapResources { surface, buffers, lights: lights.clone(), index })
        };
        let surfaces = GBufferTarget::many(device, [resolution; 2], maps)?;
        let levels = |(first, count)| {
            let mut uniform = PyramidLevels { first, count, ..PyramidLevels::zeroed() };
            for (entry, l) in uniform.levels.iter_mut().zip(&layout.levels) {
                *entry = [l.offset, l.size[0], l.size[1], 0];
            }
            uniform_buffer(device, "levels", &uniform)
        };
        Ok(Self {
            maps: surfaces.into_iter().enumerate().map(map).collect::<Result<_, GpuError>>()?,
            tops: empty_storage_buffer::<Node>(device, "tops", maps as u64)?,
            resolution,
            levels: dispatches(&layout).into_iter().map(levels).collect(),
            layout,
        })
    }

    /// Texels along each side of each map.
    #[must_use]
    pub const fn resolution(&self) -> u32 {
        self.resolution
    }

    /// Sets lights and their views, from the next submission on.
    ///
    /// # Errors
    /// [`Error::MapCount`] where `views` are not as many as the maps, [`Error::NoSuchLight`] where one names no light.
    pub fn prepare(&self, queue: &Queue, lights: &[Light], views: &[MapView]) -> Result<(), Error> {
        if views.len() != self.maps.len() {
            return Err(Error::MapCount { available: self.maps.len(), needed: views.len() });
        }
        let map = |v: &MapView| {
            let light = lights.get(v.light).ok_or(Error::NoSuchLight { index: v.light, count: lights.len() });
            Ok(LightMap::new(light?, &v.view, self.resolution))
        };
        let values = views.iter().map(map).collect::<Result<Vec<_>, Error>>()?;
        if let Some(first) = self.maps.first() {
            first.lights.write(queue, 0, &values);
        }
        GBufferTarget::prepare_many(
            queue,
            self.maps.iter().map(|m| &m.surface).zip(views.iter().map(|v| &v.view)),
        );
        Ok(())
    }

    /// Adds `surface`: what each light sees.
    pub fn surface(&self, pipelines: &Pipelines, pass: &mut Pass) {
        self.maps.iter().for_each(|m| pass.surface(pipelines, &m.surface));
    }

    /// Adds `flux`: texels from surfaces.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more texels than a dispatch can have.
    pub fn flux(&self, pipelines: &Pipelines, pass: &mut Pass) -> Result<(), GpuError> {
        let texels = u64::from(self.resolution) * u64::from(self.resolution);
        self.maps.iter().try_for_each(|m| pass.compute(pipelines, (&RSM_FLUX, "flux"), texels, &[&m.named()]))
    }

    /// Adds `pyramid`: nodes from surfaces and texels.
    ///
    /// # Errors
    /// As [`Self::flux`].
    pub fn pyramid(&self, pipelines: &Pipelines, pass: &mut Pass) -> Result<(), GpuError> {
        let texels = self.layout.levels[0].len() as u64;
        for m in &self.maps {
            pass.compute(pipelines, (&RSM_PYRAMID, "pyramid_leaf"), texels, &[&m.named()])?;
        }
        for (uniform, (first, count)) in self.levels.iter().zip(dispatches(&self.layout)) {
            let nodes = self.layout.levels[first as usize + 1].len() as u64;
            let (entry, invocations) =
                if count == 1 { ("pyramid_parent", nodes) } else { ("pyramid_top", 1) };
            for m in &self.maps {
                let own = [named("pyramid", uniform)];
                pass.compute(pipelines, (&RSM_PYRAMID, entry), invocations, &[&m.named(), &own])?;
            }
        }
        let node = size_of::<Node>() as u64;
        for (i, m) in (0..).zip(&self.maps) {
            let last = (self.layout.len() as u64 - 1) * node;
            pass.copy("tops", (&m.buffers.nodes, last), (&self.tops, i * node), node);
        }
        Ok(())
    }

    /// Names the results of `surface`.
    pub fn exchange_surface(&self, rsm: &mut Rsm, exchange: &mut Exchange<'_>) {
        for (i, (map, m)) in rsm.maps.iter_mut().zip(&self.maps).enumerate() {
            exchange.within(&format!("map {i} "));
            exchange.surface(&m.surface, &mut map.surface);
        }
    }

    /// Names the results of `flux`.
    pub fn exchange_flux(&self, rsm: &mut Rsm, exchange: &mut Exchange<'_>) {
        for (i, (map, m)) in rsm.maps.iter_mut().zip(&self.maps).enumerate() {
            exchange.within(&format!("map {i} "));
            exchange.elements("", &m.buffers.texels, 0, &mut map.texels);
        }
    }

    /// Names the results of `pyramid`, level by level: their names tell in which one a difference begins.
    pub fn exchange_pyramid(&self, rsm: &mut Rsm, exchange: &mut Exchange<'_>) {
        for (i, (map, m)) in rsm.maps.iter_mut().zip(&self.maps).enumerate() {
            exchange.within(&format!("map {i} "));
            for (k, level) in self.layout.levels.iter().enumerate() {
                let first = level.offset as usize;
                let nodes = &mut map.pyramid.nodes[first..first + level.len()];
                exchange.elements(&format!("level {k}"), &m.buffers.nodes, first, nodes);
            }
        }
        exchange.within("");
        let mut tops: Vec<_> = rsm.maps.iter().map(|m| m.pyramid.top()).collect();
        exchange.elements("tops", &self.tops, 0, &mut tops);
    }
}

/// The finest level that each dispatch above the leaves reads, and how many it makes: large levels one by one, then the rest.
fn dispatches(layout: &PyramidLayout) -> Vec<(u32, u32)> {
    let above = layout.levels.len() as u32 - 1;
    let large = layout.levels.iter().skip(1).take_while(|l| l.len() > TOP_NODES).count() as u32;
    let mut dispatches: Vec<_> = (0..large).map(|first| (first, 1)).collect();
    if large < above {
        dispatches.push((large, above - large));
    }
    dispatches
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::check;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<PyramidLevels>(&RSM_PYRAMID).unwrap();
        check::<Texel>(&RSM_PYRAMID).unwrap();
        check::<Node>(&RSM_PYRAMID).unwrap();
        check::<LightMap>(&RSM_FLUX).unwrap();
    }
}
