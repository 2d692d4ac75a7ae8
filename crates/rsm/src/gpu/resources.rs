use bytemuck::{Pod, Zeroable};
use indirect_core::Light;
use indirect_gpu::wgpu::{BindGroup, Buffer, Device, Queue};
use indirect_gpu::{GBufferTarget, GpuError, Vec3Pad, empty_storage_buffer, uniform_buffer};

use crate::{
    Error, Params, PyramidLayout, Selection, Vpl,
    gpu::{GatherResources, Rsm},
    layout::{LightMap, Node, Texel},
    views::MapView,
};

/// Where a level and the finer one below it lie, as `pyramid.wgsl` declares it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LevelPair {
    pub(crate) fine_offset: u32,
    pub(crate) fine_width: u32,
    pub(crate) fine_height: u32,
    pub(crate) coarse_offset: u32,
    pub(crate) coarse_width: u32,
    pub(crate) coarse_height: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// One map among all, and the slots it fills, as `vpls.wgsl` declares it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SelectionUniform {
    pub(crate) resolution: u32,
    pub(crate) map: u32,
    pub(crate) maps: u32,
    pub(crate) first_slot: u32,
    pub(crate) slots: u32,
    pub(crate) cells: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// Buffers of one map.
#[derive(Debug)]
pub struct MapResources {
    /// What the light sees.
    pub surface: GBufferTarget,
    /// `array<Texel>`, one per texel.
    pub texels: Buffer,
    /// `array<Node>`, laid out as [`PyramidLayout`] says.
    pub nodes: Buffer,
    pub(super) light: Buffer,
    pub(super) flux_group: BindGroup,
    pub(super) leaf_group: BindGroup,
    pub(super) parent_groups: Vec<BindGroup>,
    pub(super) vpls_group: BindGroup,
}

/// All buffers of a frame; every intermediate result can be read back.
#[derive(Debug)]
pub struct Resources {
    /// One per map.
    pub maps: Vec<MapResources>,
    /// `array<Node>`: the last node of each map's pyramid.
    pub tops: Buffer,
    /// `array<Vpl>`: one per slot of the selection.
    pub slots: Buffer,
    /// The VPLs with flux, and the irradiance that they cast on the camera's pixels.
    pub gather: GatherResources,
    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel of the camera, W/(sr·m²), and 0.
    pub image: Buffer,
    pub(super) layout: PyramidLayout,
    pub(super) views: Vec<MapView>,
    pub(super) slot_count: u32,
    pub(super) compact_group: BindGroup,
    pub(super) shade_group: BindGroup,
    points: Buffer,
    slot_uniform: Buffer,
    selection: Selection,
    resolution: u32,
}

impl Resources {
    /// Buffers for `maps` maps, as many as [`views`](crate::views::views) returns, and the pixels of `camera`, whose buffers
    /// they refer to from now on.
    ///
    /// # Errors
    /// [`Error::Gpu`] where a buffer exceeds the device's limits.
    pub fn new(device: &Device, rsm: &Rsm, maps: usize, camera: &GBufferTarget) -> Result<Self, Error> {
        let options = rsm.options();
        let n = options.resolution;
        let layout = PyramidLayout::new([n, n]);
        let count = options.selection.slot_count(maps, n);
        // One below 2³²: the largest that the length of a buffer allows anyway.
        let slot_count = u32::try_from(count).map_err(|_| GpuError::Limit {
            what: "the VPL slots",
            limit: "32-bit index",
            needed: count as u64,
            available: u64::from(u32::MAX),
        })?;
        let tops = empty_storage_buffer::<Node>(device, "pyramid tops", maps as u64)?;
        let slots = empty_storage_buffer::<Vpl>(device, "vpl slots", u64::from(slot_count))?;
        let drawn = if matches!(options.selection, Selection::Importance { .. }) { slot_count } else { 0 };
        let points = empty_storage_buffer::<[f32; 2]>(device, "sequence", u64::from(drawn))?;
        let shared = Shared { rsm, layout: &layout, tops: &tops, slots: &slots, points: &points, slot_count };
        let maps: Vec<_> = (0..maps).map(|i| shared.map(device, i, maps)).collect::<Result<_, _>>()?;

        let [width, height] = camera.size();
        let (positions, normals) = (&camera.position, &camera.normal);
        let gather =
            GatherResources::new(device, &rsm.gather, slot_count, positions, normals, width * height)?;
        let image = empty_storage_buffer::<Vec3Pad>(device, "indirect light", u64::from(width * height))?;
        let slot_uniform = uniform_buffer(device, "slot count", &[slot_count, 0, 0, 0]);
        let compact_group = rsm.compact.bind(
            device,
            0,
            &[
                (0, slots.as_entire_binding()),
                (1, gather.vpls.as_entire_binding()),
                (2, gather.count.as_entire_binding()),
                (3, slot_uniform.as_entire_binding()),
            ],
        );
        let shade_group = rsm.shade.bind(
            device,
            0,
            &[
                (0, camera.albedo.as_entire_binding()),
                (1, gather.irradiance.as_entire_binding()),
                (2, image.as_entire_binding()),
            ],
        );
        let selection = options.selection;
        Ok(Self {
            maps,
            tops,
            slots,
            gather,
            image,
            layout,
            views: Vec::new(),
            slot_count,
            compact_group,
            shade_group,
            points,
            slot_uniform,
            selection,
            resolution: n,
        })
    }

    /// Sets what changes from frame to frame: lights, their views, parameters. Call it before the first
    /// [`Rsm::encode`], and again when something changes.
    ///
    /// # Errors
    /// [`Error::MapCount`] where `views` are not as many as the maps, [`Error::NoSuchLight`] where one names no light.
    pub fn prepare(
        &mut self,
        queue: &Queue,
        lights: &[Light],
        views: &[MapView],
        params: &Params,
    ) -> Result<(), Error> {
        if views.len() != self.maps.len() {
            return Err(Error::MapCount { available: self.maps.len(), needed: views.len() });
        }
        for (map, v) in self.maps.iter().zip(views) {
            let light =
                lights.get(v.light).ok_or(Error::NoSuchLight { index: v.light, count: lights.len() })?;
            let light = LightMap::new(light, &v.view, self.resolution);
            queue.write_buffer(&map.light, 0, bytemuck::bytes_of(&light));
        }
        let points: Vec<[f32; 2]> =
            self.selection.points(params.seed).into_iter().map(|p| p.to_array()).collect();
        queue.write_buffer(&self.points, 0, bytemuck::cast_slice(&points));
        self.gather.prepare(queue, params.form);
        self.views = views.to_vec();
        Ok(())
    }

    /// GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let map = |m: &MapResources| m.surface.bytes() + m.texels.size() + m.nodes.size() + m.light.size();
        let own = [&self.tops, &self.slots, &self.image, &self.points, &self.slot_uniform].map(Buffer::size);
        self.maps.iter().map(map).sum::<u64>() + own.iter().sum::<u64>() + self.gather.bytes()
    }

    pub(super) fn texels_per_map(&self) -> u64 {
        u64::from(self.resolution) * u64::from(self.resolution)
    }
}

/// What all maps bind.
struct Shared<'a> {
    rsm: &'a Rsm,
    layout: &'a PyramidLayout,
    tops: &'a Buffer,
    slots: &'a Buffer,
    points: &'a Buffer,
    slot_count: u32,
}

impl Shared<'_> {
    fn map(&self, device: &Device, index: usize, maps: usize) -> Result<MapResources, Error> {
        let rsm = self.rsm;
        let n = rsm.options().resolution;
        let surface = GBufferTarget::new(device, [n, n], 1)?;
        let texels = empty_storage_buffer::<Texel>(device, "rsm texels", u64::from(n) * u64::from(n))?;
        let nodes = empty_storage_buffer::<Node>(device, "rsm pyramid", self.layout.len() as u64)?;
        let light = uniform_buffer(device, "rsm light", &LightMap::zeroed());
        let flux_group = rsm.flux.bind(
            device,
            0,
            &[
                (0, light.as_entire_binding()),
                (1, surface.triangle.as_entire_binding()),
                (2, surface.position.as_entire_binding()),
                (3, surface.normal.as_entire_binding()),
                (4, surface.albedo.as_entire_binding()),
                (5, texels.as_entire_binding()),
            ],
        );
        let leaf_group = rsm.pyramid_leaf.bind(
            device,
            0,
            &[
                (1, surface.position.as_entire_binding()),
                (2, surface.normal.as_entire_binding()),
                (3, texels.as_entire_binding()),
                (4, nodes.as_entire_binding()),
            ],
        );
        let parent_groups = self
            .layout
            .levels
            .windows(2)
            .map(|pair| {
                let levels = LevelPair {
                    fine_offset: pair[0].offset,
                    fine_width: pair[0].size[0],
                    fine_height: pair[0].size[1],
                    coarse_offset: pair[1].offset,
                    coarse_width: pair[1].size[0],
                    coarse_height: pair[1].size[1],
                    pad0: 0,
                    pad1: 0,
                };
                let levels = uniform_buffer(device, "rsm pyramid levels", &levels);
                let resources = [(0, levels.as_entire_binding()), (4, nodes.as_entire_binding())];
                rsm.pyramid_parent.bind(device, 0, &resources)
            })
            .collect();
        let selection = uniform_buffer(device, "rsm selection", &self.selection(index as u32, maps as u32));
        let mut resources = vec![
            (0, selection.as_entire_binding()),
            (1, surface.position.as_entire_binding()),
            (2, surface.normal.as_entire_binding()),
            (3, texels.as_entire_binding()),
            (4, self.slots.as_entire_binding()),
        ];
        if matches!(rsm.options().selection, Selection::Importance { .. }) {
            resources.extend([
                (5, nodes.as_entire_binding()),
                (6, self.tops.as_entire_binding()),
                (7, self.points.as_entire_binding()),
            ]);
        }
        let vpls_group = rsm.vpls.bind(device, 0, &resources);
        Ok(MapResources { surface, texels, nodes, light, flux_group, leaf_group, parent_groups, vpls_group })
    }

    fn selection(&self, map: u32, maps: u32) -> SelectionUniform {
        let resolution = self.rsm.options().resolution;
        let per_map = self.slot_count / maps;
        let (first_slot, slots, cells) = match self.rsm.options().selection {
            Selection::All => (map * per_map, per_map, 0),
            Selection::Grid { cells } => (map * per_map, per_map, cells.min(resolution)),
            Selection::Importance { count } => (0, count, 0),
        };
        SelectionUniform { resolution, map, maps, first_slot, slots, cells, pad0: 0, pad1: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{RSM_FLUX, RSM_PYRAMID, RSM_VPLS};
    use testkit::assert_layout;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        assert_layout!(
            RSM_PYRAMID,
            "LevelPair" = LevelPair {
                fine_offset,
                fine_width,
                fine_height,
                coarse_offset,
                coarse_width,
                coarse_height,
                pad0,
                pad1
            }
        );
        assert_layout!(
            RSM_VPLS,
            "Selection" = SelectionUniform { resolution, map, maps, first_slot, slots, cells, pad0, pad1 }
        );
        assert_layout!(RSM_VPLS, "Vpl" = Vpl { position, area, normal, pad0, flux, pad1 });
        assert_layout!(RSM_VPLS, "Texel" = Texel { incident, pad0, reflected, area });
        assert_layout!(
            RSM_VPLS,
            "Node" = Node { reflected, depth_min, incident, depth_max, cone_axis, cone_versine }
        );
        assert_layout!(
            RSM_FLUX,
            "LightMap" = LightMap {
                right,
                half_width,
                up,
                half_height,
                forward,
                orthographic,
                power,
                inverse_range,
                axis,
                cos_outer,
                spot_scale,
                resolution,
                pad0,
                pad1
            }
        );
    }
}
