use bytemuck::{Pod, Zeroable};
use indirect_gpu::shaders::{Module, RSM_TRAVERSE, RSM_TREE, RSM_TREE_SORT};
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Pipelines, Plan, Vec3Pad, buffers, named, uniform_buffer};

use super::Traversal;
use crate::{Bound, Branch, Form, TILE, TreeLayout};

/// Pairs that a workgroup sorts by itself, as `tree_sort.wgsl` declares it.
const BLOCK: u32 = 1024;

/// Threads of the workgroups that sort, and most of them that look for bounds.
const THREADS: u32 = 256;

/// Receivers of a thread of `traverse`.
const RECEIVERS: u64 = 4;

indirect_core::wgsl_struct! {
    /// The tree and its settings.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct TreeUniform = "Tree" {
        offsets: [[u32; 4]; 6],
        lights: u32,
        padded: u32,
        inner: u32,
        branches: u32,
        partials: u32,
        seed: u32,
        bound: u32,
        tau: f32,
    }
}

indirect_core::wgsl_struct! {
    /// A stage of the sort.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct SortStep = "SortStep" {
        size: u32,
        distance: u32,
        pad0: u32,
        pad1: u32,
    }
}

indirect_core::wgsl_struct! {
    /// A level and the finer one below it.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct TreeLevel = "TreeLevel" {
        level: u32,
        offset: u32,
        count: u32,
        fine_offset: u32,
        fine_count: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// What may change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeParams {
    /// Number of receivers, no more than the tree was made for.
    pub receivers: u32,
    /// Share of the reference irradiance that the bound of a branch may reach before it is subdivided, `≥ 0`. Higher:
    /// fewer lights in a cut, less exact; 0 gathers every light.
    pub tau: f32,
    /// What tau bounds.
    pub bound: Bound,
    /// A light is a small disc or a point.
    pub form: Form,
    /// Draws the representatives.
    pub seed: u32,
}

impl Default for TreeParams {
    fn default() -> Self {
        Self { receivers: 0, tau: 0.003, bound: Bound::Error, form: Form::Disc, seed: 0 }
    }
}

/// What the lengths of [`TreeBuffers`] follow from.
#[derive(Debug, Clone)]
pub struct TreeSizes {
    layout: TreeLayout,
    receivers: u64,
}

impl TreeSizes {
    /// Places that are sorted.
    fn padded(&self) -> u32 {
        self.layout.count(0).next_power_of_two().max(BLOCK)
    }

    /// Workgroups that look for bounds.
    fn partials(&self) -> u32 {
        self.layout.count(0).div_ceil(THREADS).clamp(1, THREADS)
    }
}

buffers! {
    /// Buffers of a [`LightTree`].
    pub struct TreeBuffers for TreeSizes {
        /// Least and greatest position of the lights that each workgroup has looked at.
        bounds: [Vec3Pad] = |s| 2 * u64::from(s.partials());
        /// Key of each light and its place in the list, sorted by key.
        pairs: [[u32; 2]] = |s| s.padded().into();
        /// The branches, those of the coarsest level first.
        branches: [Branch] = |s| s.layout.len().into();
        /// The reference irradiance, W/m².
        reference: [f32] = |_| 1;
        /// Number of receivers.
        receiver_count: [u32] = |_| 1;
        /// Lights in the cut of each tile of receivers.
        cuts: [u32] = |s| s.receivers.div_ceil(TILE as u64);
        /// The tree and its settings.
        tree: TreeUniform;
        /// How it is walked.
        traversal: Traversal;
    }
}

/// A binary tree over a list of virtual point lights that lies on the GPU, and the sum of the light of cuts through
/// it: the twin of `cpu::LightTree`. It knows nothing of maps: any list and any receivers will do.
///
/// A frame adds [`Self::build`], [`Self::reference`], [`Self::solve_reach`] and [`Self::traverse`] to its passes, in
/// this order.
#[derive(Debug, Clone)]
pub struct LightTree {
    /// The buffers.
    pub buffers: TreeBuffers,
    sizes: TreeSizes,
    steps: Vec<(SortStep, Buffer)>,
    levels: Vec<Buffer>,
}

impl LightTree {
    fn sizes(lights: u64, receivers: u64) -> TreeSizes {
        TreeSizes { layout: TreeLayout::new(u32::try_from(lights).unwrap_or(u32::MAX)), receivers }
    }

    /// The stages beyond those within blocks: of each size the distances of at least a block, and one for all smaller
    /// ones.
    fn steps(padded: u32) -> Vec<SortStep> {
        let mut steps = Vec::new();
        let mut size = 2 * BLOCK;
        while size <= padded {
            let mut distance = size / 2;
            while distance >= BLOCK / 2 {
                steps.push(SortStep { size, distance, pad0: 0, pad1: 0 });
                distance /= 2;
            }
            size *= 2;
        }
        steps
    }

    /// What a tree over up to `lights` lights (those beyond [`TreeLayout::MAX_LIGHTS`] are left out) for up to
    /// `receivers` receivers will allocate.
    #[must_use]
    pub fn plan(lights: u64, receivers: u64) -> Plan {
        let sizes = Self::sizes(lights, receivers);
        let mut plan = TreeBuffers::plan(&sizes);
        Self::steps(sizes.padded()).iter().for_each(|_| plan.uniform::<SortStep>("step"));
        (1..sizes.layout.levels()).for_each(|_| plan.uniform::<TreeLevel>("pair"));
        plan.index("receivers", receivers.saturating_mul(256));
        plan
    }

    /// Buffers for it.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, lights: u64, receivers: u64) -> Result<Self, GpuError> {
        Self::plan(lights, receivers).check(&device.limits())?;
        let sizes = Self::sizes(lights, receivers);
        let step = |step: SortStep| (step, uniform_buffer(device, "step", &step));
        let layout = &sizes.layout;
        let pair = |level: usize| {
            let value = TreeLevel {
                level: level as u32,
                offset: layout.offset(level),
                count: layout.count(level),
                fine_offset: layout.offset(level - 1),
                fine_count: layout.count(level - 1),
                pad0: 0,
                pad1: 0,
                pad2: 0,
            };
            uniform_buffer(device, "pair", &value)
        };
        Ok(Self {
            buffers: TreeBuffers::new(device, &sizes)?,
            steps: Self::steps(sizes.padded()).into_iter().map(step).collect(),
            levels: (1..layout.levels()).map(pair).collect(),
            sizes,
        })
    }

    /// Where the levels lie.
    #[must_use]
    pub const fn layout(&self) -> &TreeLayout {
        &self.sizes.layout
    }

    /// Sets what may change from frame to frame.
    pub fn prepare(&self, queue: &Queue, params: &TreeParams) {
        let layout = &self.sizes.layout;
        let mut offsets = [[0; 4]; 6];
        for (level, offset) in offsets.as_flattened_mut().iter_mut().enumerate() {
            *offset = layout.offset(level);
        }
        let tree = TreeUniform {
            offsets,
            lights: layout.count(0),
            padded: self.sizes.padded(),
            inner: layout.inner(),
            branches: layout.len(),
            partials: self.sizes.partials(),
            seed: params.seed,
            bound: params.bound as u32,
            tau: params.tau,
        };
        let write = |buffer: &Buffer, bytes: &[u8]| queue.write_buffer(buffer, 0, bytes);
        write(&self.buffers.tree, bytemuck::bytes_of(&tree));
        write(&self.buffers.traversal, bytemuck::bytes_of(&Traversal::new(0..layout.len(), params.form)));
        let receivers = params.receivers.min(u32::try_from(self.sizes.receivers).unwrap_or(u32::MAX));
        write(&self.buffers.receiver_count, bytemuck::bytes_of(&receivers));
    }

    /// Adds `tree`: sorts a list and makes the branches. `list` binds `vpls` and `count`, those of
    /// [`VplList`](super::VplList) say.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] where one of the names is missing.
    pub fn build(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        let (layout, own) = (&self.sizes.layout, self.buffers.named());
        if layout.is_empty() {
            return Ok(());
        }
        let padded = u64::from(self.sizes.padded());
        let mut sort = |entry, threads: u64, step: Option<&Buffer>| {
            let step: Vec<Named<'_>> = step.map(|step| named("step", step)).into_iter().collect();
            pass.compute(pipelines, (&RSM_TREE_SORT, entry), threads, &[&own, list, &step])
        };
        sort("tree_bounds", u64::from(self.sizes.partials() * THREADS), None)?;
        sort("tree_keys", padded, None)?;
        // A workgroup of 256 threads sorts 1024 pairs.
        let blocks = padded / u64::from(BLOCK / THREADS);
        sort("sort_blocks", blocks, None)?;
        for (step, uniform) in &self.steps {
            if step.distance < BLOCK {
                sort("sort_merge", blocks, Some(uniform))?;
            } else {
                sort("sort_pairs", padded / 2, Some(uniform))?;
            }
        }
        pass.compute(pipelines, (&RSM_TREE, "tree_leaves"), layout.count(0).into(), &[&own, list])?;
        for (level, uniform) in (1..).zip(&self.levels) {
            let pair = [named("pair", uniform)];
            let threads = layout.count(level).into();
            pass.compute(pipelines, (&RSM_TREE, "tree_parents"), threads, &[&own, list, &pair])?;
        }
        Ok(())
    }

    /// Adds `reference`: the irradiance that [`TreeParams::tau`] is a share of, as
    /// `cpu::LightTree::reference_irradiance` has it. `own` binds `positions` and `normals` of the receivers,
    /// `array<vec4<f32>>`. A caller that knows it writes it to `reference` instead.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn reference(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        pass.compute(pipelines, (&RSM_TREE, "tree_reference"), 1, &[&self.buffers.named(), own])
    }

    /// Adds `reach`: the distance from which each branch may be taken for one light.
    ///
    /// # Errors
    /// None in practice.
    pub fn solve_reach(&self, pipelines: &Pipelines, pass: &mut Pass) -> Result<(), GpuError> {
        let threads = self.sizes.layout.inner().into();
        pass.compute(pipelines, (&RSM_TREE, "tree_reach"), threads, &[&self.buffers.named()])
    }

    /// Adds `traverse`: the irradiance of cuts at the receivers, without visibility. `own` binds `positions`,
    /// `normals` (xyz each) and `irradiance`, all `array<vec4<f32>>`.
    ///
    /// # Errors
    /// As [`Self::build`], and [`GpuError::Limit`] for more receivers than a dispatch can have.
    pub fn traverse(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        self.traverse_with(pipelines, pass, &RSM_TRAVERSE, own)
    }

    /// [`Self::traverse`] by a module that includes `rsm/traverse.wgsl` with a `light_visible` of its own; `own` also
    /// binds what that needs.
    ///
    /// # Errors
    /// As there.
    pub fn traverse_with(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        module: &Module,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        let threads = self.sizes.receivers.div_ceil(RECEIVERS);
        pass.compute(pipelines, (module, "traverse"), threads, &[own, &self.buffers.named()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        check::<TreeUniform>(&RSM_TREE).unwrap();
        check::<TreeUniform>(&RSM_TREE_SORT).unwrap();
        check::<TreeLevel>(&RSM_TREE).unwrap();
        check::<Branch>(&RSM_TREE).unwrap();
        check::<SortStep>(&RSM_TREE_SORT).unwrap();
        check_constant(&RSM_TREE_SORT, "BLOCK", BLOCK).unwrap();
        check_constant(&RSM_TREE_SORT, "THREADS", THREADS).unwrap();
        check_constant(&RSM_TREE, "SAMPLES", TreeLayout::SAMPLES).unwrap();
        check_constant(&RSM_TREE, "SOURCES", TreeLayout::SOURCES).unwrap();
    }

    #[test]
    fn default_limits_suffice_for_the_largest_tree() {
        let plan = LightTree::plan(u64::MAX, 3840 * 2160);
        plan.check(&indirect_gpu::wgpu::Limits::default()).unwrap();
        // The table of offsets has room for its levels, and one beyond the root.
        assert!(TreeLayout::new(u32::MAX).levels() < 24);
    }
}
