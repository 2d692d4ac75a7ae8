use bytemuck::{Pod, Zeroable};
use indirect_core::{Light, MapView};
use indirect_gpu::shaders::{RSM_FLUX, RSM_PYRAMID};
use indirect_gpu::wgpu::{Buffer, BufferUsages, Device, Queue};
use indirect_gpu::{
    GBufferTarget, GpuError, Named, Pass, Pipelines, Plan, buffers, empty_storage_buffer, named,
    uniform_buffer,
};
use indirect_technique::gpu::Exchange;

use crate::{
    Error, PyramidLayout, Rsm,
    layout::{LightMap, Node, Texel},
};

indirect_core::wgsl_struct! {
    /// Where a level and the finer one below it lie.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct LevelPair = "LevelPair" {
        pub(crate) fine_offset: u32,
        pub(crate) fine_width: u32,
        pub(crate) fine_height: u32,
        pub(crate) coarse_offset: u32,
        pub(crate) coarse_width: u32,
        pub(crate) coarse_height: u32,
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
        /// The light in this map.
        map: LightMap;
    }
}

/// One map.
#[derive(Debug, Clone)]
pub struct MapResources {
    /// What the light sees.
    pub surface: GBufferTarget,
    /// The light in it.
    pub buffers: MapBuffers,
}

impl MapResources {
    /// Its buffers as kernels bind them: `positions`, `normals`, `albedos`, `triangles`, `texels`, `nodes`, `map`.
    #[must_use]
    pub fn named(&self) -> Vec<Named<'_>> {
        let mut named = self.buffers.named();
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
        let mut plan = Plan::new();
        let sizes = MapSizes { resolution, pyramids };
        for _ in 0..maps {
            plan = plan.and(GBufferTarget::plan([resolution; 2])).and(MapBuffers::plan(&sizes));
        }
        plan.storage::<Node>("tops", maps as u64, BufferUsages::empty());
        for _ in 1..PyramidLayout::new([resolution; 2]).levels.len() {
            plan.uniform::<LevelPair>("levels");
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
        let map = |_| {
            let surface = GBufferTarget::new(device, [resolution; 2])?;
            let buffers = MapBuffers::new(device, &MapSizes { resolution, pyramids })?;
            Ok(MapResources { surface, buffers })
        };
        let pair = |pair: &[crate::Level]| {
            let (fine, coarse) = (pair[0], pair[1]);
            let levels = LevelPair {
                fine_offset: fine.offset,
                fine_width: fine.size[0],
                fine_height: fine.size[1],
                coarse_offset: coarse.offset,
                coarse_width: coarse.size[0],
                coarse_height: coarse.size[1],
                pad0: 0,
                pad1: 0,
            };
            uniform_buffer(device, "levels", &levels)
        };
        Ok(Self {
            maps: (0..maps).map(map).collect::<Result<_, GpuError>>()?,
            tops: empty_storage_buffer::<Node>(device, "tops", maps as u64)?,
            resolution,
            levels: layout.levels.windows(2).map(pair).collect(),
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
        for (m, v) in self.maps.iter().zip(views) {
            let light =
                lights.get(v.light).ok_or(Error::NoSuchLight { index: v.light, count: lights.len() })?;
            let map = LightMap::new(light, &v.view, self.resolution);
            queue.write_buffer(&m.buffers.map, 0, bytemuck::bytes_of(&map));
            m.surface.prepare(queue, &v.view);
        }
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
        for m in &self.maps {
            let own = m.named();
            let texels = self.layout.levels[0].len() as u64;
            pass.compute(pipelines, (&RSM_PYRAMID, "pyramid_leaf"), texels, &[&own])?;
            for (pair, level) in self.levels.iter().zip(&self.layout.levels[1..]) {
                let levels = [named("levels", pair)];
                pass.compute(
                    pipelines,
                    (&RSM_PYRAMID, "pyramid_parent"),
                    level.len() as u64,
                    &[&own, &levels],
                )?;
            }
        }
        let node = size_of::<Node>() as u64;
        for (i, m) in (0..).zip(&self.maps) {
            let last = (self.layout.len() as u64 - 1) * node;
            pass.copy((&m.buffers.nodes, last), (&self.tops, i * node), node);
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

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::check;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<LevelPair>(&RSM_PYRAMID).unwrap();
        check::<Texel>(&RSM_PYRAMID).unwrap();
        check::<Node>(&RSM_PYRAMID).unwrap();
        check::<LightMap>(&RSM_FLUX).unwrap();
    }
}
