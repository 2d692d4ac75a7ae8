use bytemuck::{Pod, Zeroable};
use indirect_shaders::{Module, SCAN, SCAN_INTO};
use wgpu::{Buffer, Device};

use crate::{GpuError, Named, Pass, Pipelines, Plan, buffers, named, uniform_buffer};

/// Values of a workgroup, as `sort/scan.wgsl` declares it.
const BLOCK: u32 = 2048;

/// Threads of a workgroup.
const THREADS: u32 = 256;

indirect_core::wgsl_struct! {
    /// How many values there are.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct ScanUniform = "Scan" {
        length: u32,
        blocks: u32,
    }
}

buffers! {
    /// Buffers of a [`Scan`], by the number of values.
    pub struct ScanBuffers for u64 {
        /// The sum of each block of values, and then of all blocks before it.
        block_sums: [u32] = |n| n.div_ceil(BLOCK.into());
        /// The sum of all values.
        total: [u32] = |_| 1;
    }
}

/// The sum of all values before each (exclusive prefix sum) of a buffer of `u32`, modulo 2³²; twin of
/// [`indirect_core::sort::exclusive_scan`]. Three dispatches for any number of values; the second is one workgroup, which adds up
/// 2048 blocks of 2048 values at a time.
#[derive(Debug, Clone)]
pub struct Scan {
    /// The buffers.
    pub buffers: ScanBuffers,
    length: u32,
    scan: Buffer,
}

impl Scan {
    /// What a scan of `length` values will allocate, the values left out.
    #[must_use]
    pub fn plan(length: u64) -> Plan {
        let mut plan = ScanBuffers::plan(&length);
        plan.uniform::<ScanUniform>("scan");
        plan.index("values", length);
        plan
    }

    /// For `length` values.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, length: u32) -> Result<Self, GpuError> {
        let uniform = ScanUniform { length, blocks: length.div_ceil(BLOCK) };
        let scan = uniform_buffer(device, "scan", &uniform);
        Ok(Self { buffers: ScanBuffers::new(device, &length.into())?, length, scan })
    }

    /// Number of values.
    #[must_use]
    pub const fn length(&self) -> u32 {
        self.length
    }

    /// Replaces values by the sums of those before them; then `total` holds the sum of all. `list` binds `values`.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] where the name is missing.
    pub fn encode(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        self.encode_with(pipelines, pass, &SCAN, &[list])
    }

    /// [`Self::encode`] into another buffer: `list` binds `values` and `scanned`.
    ///
    /// # Errors
    /// As there.
    pub fn encode_into(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        list: &[Named<'_>],
    ) -> Result<(), GpuError> {
        self.encode_with(pipelines, pass, &SCAN_INTO, &[list])
    }

    /// [`Self::encode`] by a module that includes `sort/scan.wgsl` with values and results of its own; `lists` bind what those
    /// need.
    ///
    /// # Errors
    /// As there.
    pub fn encode_with(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        module: &Module,
        lists: &[&[Named<'_>]],
    ) -> Result<(), GpuError> {
        let (own, scan) = (self.buffers.named(), [named("scan", &self.scan)]);
        let lists: Vec<_> = lists.iter().copied().chain([&own[..], &scan]).collect();
        let blocks = u64::from(self.length.div_ceil(BLOCK));
        for (entry, workgroups) in [("scan_reduce", blocks), ("scan_blocks", 1), ("scan_spread", blocks)] {
            pass.compute(pipelines, (module, entry), workgroups * u64::from(THREADS), &lists)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_shaders::COMPACT;
    use testkit::layout::{check, check_constant, check_workgroup_size};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        for module in [&SCAN, &SCAN_INTO, &COMPACT] {
            check::<ScanUniform>(module).unwrap();
            check_constant(module, "SCAN_BLOCK", BLOCK).unwrap();
            check_constant(module, "SCAN_THREADS", THREADS).unwrap();
            for entry in ["scan_reduce", "scan_blocks", "scan_spread"] {
                check_workgroup_size(module, entry, [THREADS, 1, 1]).unwrap();
            }
        }
    }
}
