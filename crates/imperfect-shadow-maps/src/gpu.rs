//! The passes on wgpu: maps of a list of VPLs that is on the device.
//!
//! Points are resolved on the CPU and uploaded: a [`Pass`] has no bind group of the scene, and a scene that moves is moved there.

use indirect_gpu::shaders::{ISM_PULL, ISM_PUSH, ISM_SPLAT, ISM_VISIBLE};
use indirect_gpu::wgpu::{Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Pipelines, Plan, buffers};

use crate::layout::{Ism, Point};
use crate::settings::Options;

buffers! {
    /// Buffers of an [`Atlas`], named as `ism/query.wgsl` names them.
    pub struct IsmBuffers for Ism {
        /// The scene's points in the world.
        ism_points: [Point] = |s| s.points.into();
        /// `1 / (distance + height)`, 1/m, or 0: map after map, each row-major.
        ism_atlas: [f32] = |s| u64::from(s.tiles) * u64::from(s.tile) * u64::from(s.tile);
        /// The coarser levels of `pull`: map after map, the finest level first.
        ism_coarse: [f32] = |s| u64::from(s.tiles) * u64::from(s.coarse);
        /// Sizes and factors.
        ism: Ism;
    }
}

/// The maps of a list of VPLs.
#[derive(Debug, Clone)]
pub struct Atlas {
    /// The buffers: what a module with `ism/query.wgsl` binds is `ism_atlas` and `ism`.
    pub buffers: IsmBuffers,
    ism: Ism,
}

impl Atlas {
    /// What `tiles` maps of `points` points will allocate.
    #[must_use]
    pub fn plan(options: &Options, points: u32, tiles: u32) -> Plan {
        let ism = Ism::new(options, points, tiles);
        let mut plan = IsmBuffers::plan(&ism);
        let tiles = u64::from(tiles);
        plan.index("texels of shadow maps", tiles.saturating_mul(ism.texels() as u64));
        plan.index("splats of shadow maps", tiles.saturating_mul(ism.points_per_map.into()));
        plan
    }

    /// Buffers for `tiles` maps, as many as the list of VPLs has room for, and `points` points.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, options: &Options, points: u32, tiles: u32) -> Result<Self, GpuError> {
        Self::plan(options, points, tiles).check(&device.limits())?;
        let ism = Ism::new(options, points, tiles);
        Ok(Self { buffers: IsmBuffers::new(device, &ism)?, ism })
    }

    /// Sets the factors of `options` from the next submission on; its sizes stay those of [`Self::new`].
    pub fn prepare(&self, queue: &Queue, options: &Options) {
        let Ism { tile, tiles, points, points_per_map, levels, .. } = self.ism;
        let sizes = Options { tile, points_per_map, pull_push: levels, ..*options };
        queue.write_buffer(&self.buffers.ism, 0, bytemuck::bytes_of(&Ism::new(&sizes, points, tiles)));
    }

    /// Uploads the points: at the beginning, and whenever the scene moved. Those beyond what there is room for are left out;
    /// fewer leave the rest as it was.
    pub fn write(&self, queue: &Queue, points: &[Point]) {
        let points = &points[..points.len().min(self.ism.points as usize)];
        queue.write_buffer(&self.buffers.ism_points, 0, bytemuck::cast_slice(points));
    }

    /// Sizes and factors as [`Self::new`] was given them.
    #[must_use]
    pub const fn ism(&self) -> &Ism {
        &self.ism
    }

    /// Adds `splat`: all maps emptied, and the points drawn into those of the VPLs. `list` binds `vpls` and `count`, as
    /// `rsm::gpu::VplList` names them; maps beyond the count stay empty.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more splats than a dispatch can have, [`GpuError::Unbound`] where one of the names is missing.
    pub fn splat(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        let tiles = u64::from(self.ism.tiles);
        let lists = [&self.buffers.named()[..], list];
        pass.compute(pipelines, (&ISM_SPLAT, "splat_clear"), tiles * self.ism.texels() as u64, &lists)?;
        let splats = tiles * u64::from(self.ism.points_per_map);
        pass.compute(pipelines, (&ISM_SPLAT, "splat"), splats, &lists)
    }

    /// Adds `pull`: the coarser levels. Nothing without levels. `list` as in [`Self::splat`].
    ///
    /// # Errors
    /// As there.
    pub fn pull(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        self.fill(pipelines, pass, list, (&ISM_PULL, "pull"))
    }

    /// Adds `push`: holes filled. Nothing without levels. `list` as in [`Self::splat`].
    ///
    /// # Errors
    /// As there.
    pub fn push(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        self.fill(pipelines, pass, list, (&ISM_PUSH, "push"))
    }

    fn fill(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        list: &[Named<'_>],
        entry: (&indirect_gpu::shaders::Module, &'static str),
    ) -> Result<(), GpuError> {
        if self.ism.levels == 0 {
            return Ok(());
        }
        // A workgroup to a map.
        let threads = 64 * u64::from(self.ism.tiles);
        pass.compute(pipelines, entry, threads, &[&self.buffers.named(), list])
    }

    /// Adds `visible`: the answers for `pairs` pairs. `own` binds `vpls`, `pairs` (`vec3` receiver, `u32` VPL, `vec3` normal, 0:
    /// 32 bytes each) and `visible_pairs`, one `u32` each: bit 0 as a point, bit 1 as a surface.
    ///
    /// # Errors
    /// As in [`Self::splat`].
    pub fn visible(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        pairs: u64,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        pass.compute(pipelines, (&ISM_VISIBLE, "visible"), pairs, &[&self.buffers.named(), own])
    }

    /// Names the maps: the results of `splat` and `push`. A texel in which a splat ends on the other side of a middle, or another
    /// point wins, is a choice; few may differ.
    #[cfg(feature = "cpu")]
    pub fn exchange_maps(
        &self,
        atlas: &mut crate::cpu::Atlas,
        exchange: &mut indirect_technique::gpu::Exchange<'_>,
    ) {
        choices(exchange, "maps", &self.buffers.ism_atlas, &mut atlas.depths);
    }

    /// Names the coarser levels: the results of `pull`.
    #[cfg(feature = "cpu")]
    pub fn exchange_levels(
        &self,
        atlas: &mut crate::cpu::Atlas,
        exchange: &mut indirect_technique::gpu::Exchange<'_>,
    ) {
        choices(exchange, "coarser levels", &self.buffers.ism_coarse, &mut atlas.coarse);
    }
}

#[cfg(feature = "cpu")]
fn choices(
    exchange: &mut indirect_technique::gpu::Exchange<'_>,
    name: &str,
    buffer: &indirect_gpu::wgpu::Buffer,
    cpu: &mut [f32],
) {
    /// Beyond this share two values are not the same one rounded twice.
    const SAME: f32 = 1e-4;
    let gpu: Vec<f32> = exchange.read(buffer, 0, cpu.len());
    let same = cpu.iter().zip(&gpu).map(|(a, b)| (a - b).abs() <= SAME * a).collect();
    exchange.same(Some(same));
    exchange.floats(name, buffer, cpu, 1);
    exchange.same(None);
}
