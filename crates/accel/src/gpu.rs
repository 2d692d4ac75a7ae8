//! Ray queries on wgpu.
//!
//! WGSL of one's own takes `accel/layout.wgsl`, `accel/traverse.wgsl` and one of `accel/opaque.wgsl` and `accel/masked.wgsl` (with
//! `core/{texture,scene,surface}.wgsl`) into its module, declares
//!
//! ```wgsl
//! @group(…) @binding(…) var<storage, read> accel_nodes: array<AccelNode>;
//! @group(…) @binding(…) var<storage, read> accel_triangles: array<AccelTriangle>;
//! ```
//!
//! and calls `accel_closest_hit`, `accel_any_hit` or `accel_occlusion`; [`AccelBuffers::named`] binds the two. Without any WGSL,
//! [`Rays`] casts a buffer of rays.
//!
//! The caller owns device, queue and encoder; nothing here submits or blocks but what reads results back. WebGPU's default limits
//! (bindings of 128 MiB) suffice for 2.1 million nodes, 2.8 million triangles in leaves and 4.2 million rays at a time. Masked scenes
//! use all of the eight storage buffers that a stage may have.

use bytemuck::{Pod, Zeroable};
use indirect_core::{Hit, Ray};
use indirect_gpu::shaders::{ACCEL_RAYS, ACCEL_RAYS_MASKED};
use indirect_gpu::wgpu::{Device, Queue};
use indirect_gpu::{GpuError, Pass, Pipelines, Plan, buffers, read_range};

use crate::{FlatNode, FlatTree, FlatTriangle};

/// Sizes of a [`FlatTree`], which those of its buffers follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TreeSizes {
    /// Number of nodes.
    pub nodes: u64,
    /// Number of triangles in all leaves.
    pub triangles: u64,
}

impl TreeSizes {
    /// Those of a tree.
    #[must_use]
    pub fn of(tree: &FlatTree) -> Self {
        Self { nodes: tree.nodes().len() as u64, triangles: tree.triangles().len() as u64 }
    }
}

buffers! {
    /// A [`FlatTree`] on the GPU. Zeroed, as [`Self::new`] makes it, it is the tree of nothing.
    pub struct AccelBuffers for TreeSizes {
        /// The nodes.
        accel_nodes: [FlatNode] = |s| s.nodes;
        /// The triangles of the leaves.
        accel_triangles: [FlatTriangle] = |s| s.triangles;
    }
}

impl AccelBuffers {
    /// Buffers for `tree` with its contents, from the next submission on.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn upload(device: &Device, queue: &Queue, tree: &FlatTree) -> Result<Self, GpuError> {
        let buffers = Self::new(device, &TreeSizes::of(tree))?;
        buffers.write(queue, tree)?;
        Ok(buffers)
    }

    /// Other contents, from the next submission on: those of a tree after [`FlatTree::refit`], or of any that is no larger.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where the tree does not fit.
    pub fn write(&self, queue: &Queue, tree: &FlatTree) -> Result<(), GpuError> {
        let (nodes, triangles) = (tree.nodes(), tree.triangles());
        fits("nodes", size_of_val(nodes), self.accel_nodes.size())?;
        fits("triangles", size_of_val(triangles), self.accel_triangles.size())?;
        queue.write_buffer(&self.accel_nodes, 0, bytemuck::cast_slice(nodes));
        queue.write_buffer(&self.accel_triangles, 0, bytemuck::cast_slice(triangles));
        Ok(())
    }
}

fn fits(what: &'static str, needed: usize, available: u64) -> Result<(), GpuError> {
    let needed = needed as u64;
    if needed > available {
        return Err(GpuError::Limit { what, limit: "buffer", needed, available });
    }
    Ok(())
}

indirect_core::wgsl_struct! {
    /// A [`Ray`] as the GPU reads it: WGSL's `AccelRay` (`accel/rays.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct RayUniform = "AccelRay" {
        /// [`Ray::origin`].
        pub origin: [f32; 3],
        /// [`Ray::t_max`].
        pub t_max: f32,
        /// [`Ray::direction`].
        pub direction: [f32; 3],
        /// Unused.
        pub pad0: u32,
    }
}

impl From<&Ray> for RayUniform {
    fn from(ray: &Ray) -> Self {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        Self { origin, t_max: ray.t_max, direction, pad0: 0 }
    }
}

indirect_core::wgsl_struct! {
    /// What a ray hits, as the GPU writes it: WGSL's `AccelHit` (`accel/layout.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct HitUniform = "AccelHit" {
        /// [`Hit::t`].
        pub t: f32,
        /// [`Hit::u`].
        pub u: f32,
        /// [`Hit::v`].
        pub v: f32,
        /// [`Hit::triangle`], [`HitUniform::NONE`] or [`HitUniform::UNFINISHED`].
        pub triangle: u32,
    }
}

impl HitUniform {
    /// `triangle` where nothing is hit.
    pub const NONE: u32 = u32::MAX;
    /// `triangle` where the ray crosses more boxes and triangles than a shader looks at (65 000): what it hits is not known.
    pub const UNFINISHED: u32 = u32::MAX - 1;

    /// The hit, if there is one.
    #[must_use]
    pub const fn hit(&self) -> Option<Hit> {
        let Self { t, u, v, triangle } = *self;
        if triangle < Self::UNFINISHED { Some(Hit { t, u, v, triangle }) } else { None }
    }
}

indirect_core::wgsl_struct! {
    /// How many rays are cast: WGSL's `AccelRayCount`.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
    pub(crate) struct RayCount = "AccelRayCount" {
        pub(crate) count: u32,
    }
}

buffers! {
    /// Buffers of [`Rays`], by how many fit.
    pub struct RayBuffers for u64 {
        /// The rays, written by [`Rays::write`] or by a shader.
        accel_rays: [RayUniform] = |n| *n;
        /// The hits of `cast_closest`.
        accel_hits: [HitUniform] = |n| *n;
        /// The answers of `cast_any`: 1 where something is hit, 0 where nothing is, 2 where that is not known.
        accel_occluded: [u32] = |n| *n;
        /// How many rays are cast, one `u32`.
        accel_ray_count: RayCount;
    }
}

/// A buffer of rays to cast, and of what they hit.
#[derive(Debug, Clone)]
pub struct Rays {
    /// The buffers.
    pub buffers: RayBuffers,
    capacity: u32,
}

impl Rays {
    /// What up to `capacity` rays will allocate.
    #[must_use]
    pub fn plan(capacity: u64) -> Plan {
        let mut plan = RayBuffers::plan(&capacity);
        plan.index("rays", capacity);
        plan
    }

    /// Room for up to `capacity` rays.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, capacity: u32) -> Result<Self, GpuError> {
        Ok(Self { buffers: RayBuffers::new(device, &capacity.into())?, capacity })
    }

    /// Number of rays that fit.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Sets the rays to cast and their number, from the next submission on. Those beyond [`Self::capacity`] are left out.
    pub fn write(&self, queue: &Queue, rays: &[Ray]) {
        let rays: Vec<RayUniform> = rays.iter().take(self.capacity as usize).map(RayUniform::from).collect();
        queue.write_buffer(&self.buffers.accel_rays, 0, bytemuck::cast_slice(&rays));
        self.set_count(queue, rays.len() as u32);
    }

    /// Sets how many of the rays are cast, for callers whose shaders write them; no more than [`Self::capacity`] are.
    pub fn set_count(&self, queue: &Queue, count: u32) {
        let count = RayCount { count: count.min(self.capacity) };
        queue.write_buffer(&self.buffers.accel_ray_count, 0, bytemuck::bytes_of(&count));
    }

    /// Adds `cast_closest`: the nearest hit of every ray. Where `masked`, rays pass through the holes of alpha masks of the
    /// scene given to [`Pass::encode`], without which nothing is cast; else all is opaque.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more rays than a dispatch can have.
    pub fn cast_closest(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        tree: &AccelBuffers,
        masked: bool,
    ) -> Result<(), GpuError> {
        self.cast(pipelines, pass, tree, masked, "cast_closest")
    }

    /// Adds `cast_any`: whether each ray hits anything; as [`Self::cast_closest`].
    ///
    /// # Errors
    /// As there.
    pub fn cast_any(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        tree: &AccelBuffers,
        masked: bool,
    ) -> Result<(), GpuError> {
        self.cast(pipelines, pass, tree, masked, "cast_any")
    }

    fn cast(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        tree: &AccelBuffers,
        masked: bool,
        entry_point: &'static str,
    ) -> Result<(), GpuError> {
        let module = if masked { &ACCEL_RAYS_MASKED } else { &ACCEL_RAYS };
        let lists = [&*tree.named(), &self.buffers.named()];
        pass.compute(pipelines, (module, entry_point), self.capacity.into(), &lists)
    }

    /// The first `count` hits. Submits and blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn read_hits(&self, device: &Device, queue: &Queue, count: u32) -> Result<Vec<HitUniform>, GpuError> {
        let count = count.min(self.capacity);
        read_range(device, queue, &self.buffers.accel_hits, 0, count.into())
    }

    /// The first `count` answers of `cast_any`. Submits and blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn read_occluded(&self, device: &Device, queue: &Queue, count: u32) -> Result<Vec<u32>, GpuError> {
        let count = count.min(self.capacity);
        read_range(device, queue, &self.buffers.accel_occluded, 0, count.into())
    }
}
