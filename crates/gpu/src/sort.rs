use bytemuck::{Pod, Zeroable};
use indirect_core::sort::low_bits;
use indirect_shaders::RADIX_SORT;
use wgpu::{Buffer, Device};

use crate::bindings::find;
use crate::{GpuError, Named, Pass, Pipelines, Plan, Scan, buffers, named, uniform_buffer};

/// Pairs of a workgroup, as `sort/radix.wgsl` declares it.
const BLOCK: u32 = 2048;

/// Threads of a workgroup.
const THREADS: u32 = 64;

/// Most bits of a digit. A pass over digits of 4 bits takes llvmpipe nine tenths of one over 8.
const DIGIT: u32 = 8;

indirect_core::wgsl_struct! {
    /// A digit of the keys.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct SortDigit = "SortDigit" {
        shift: u32,
        mask: u32,
        capacity: u32,
        blocks: u32,
    }
}

/// What the lengths of [`SortBuffers`] follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SortSizes {
    capacity: u64,
    bits: u32,
}

impl SortSizes {
    /// Up to `capacity` pairs, of whose keys the `bits` lowest bits count, all from 32 on.
    #[must_use]
    pub const fn new(capacity: u64, bits: u32) -> Self {
        Self { capacity, bits: if bits < u32::BITS { bits } else { u32::BITS } }
    }

    const fn digits(&self) -> u32 {
        self.bits.div_ceil(DIGIT)
    }

    /// Bits of a digit: as even as can be, since fewer take less to count.
    const fn width(&self) -> u32 {
        if self.bits == 0 { 0 } else { self.bits.div_ceil(self.digits()) }
    }

    const fn blocks(&self) -> u64 {
        self.capacity.div_ceil(BLOCK as u64)
    }

    const fn counts(&self) -> u64 {
        self.blocks() << self.width()
    }
}

buffers! {
    /// Buffers of a [`RadixSort`].
    pub struct SortBuffers for SortSizes {
        /// Keys while they are moved.
        sorted_keys: [u32] = |s| s.capacity;
        /// Payloads while they are moved.
        sorted_payloads: [u32] = |s| s.capacity;
        /// Keys of each value of a digit in each block, those of one value side by side; then where the first of them goes.
        digit_counts: [u32] = SortSizes::counts;
    }
}

/// Sorts pairs of a key and a payload, both `u32`, by the lowest bits of the keys, equal ones in the order in which they come; twin
/// of [`indirect_core::sort::radix_sort_pairs`]. Five dispatches per digit of up to 8 bits, whatever the number of pairs; where the
/// digits are odd in number, one more copies the pairs. Integers alone: the result is the same on every device.
#[derive(Debug, Clone)]
pub struct RadixSort {
    /// The buffers.
    pub buffers: SortBuffers,
    sizes: SortSizes,
    scan: Scan,
    digits: Vec<Buffer>,
}

impl RadixSort {
    /// What it will allocate; keys, payloads and count left out.
    #[must_use]
    pub fn plan(sizes: &SortSizes) -> Plan {
        let mut plan = SortBuffers::plan(sizes).and(Scan::plan(sizes.counts()));
        (0..sizes.digits()).for_each(|_| plan.uniform::<SortDigit>("digit"));
        plan.index("pairs", sizes.capacity);
        plan
    }

    /// For up to `capacity` pairs, of whose keys the `bits` lowest bits count (all from 32 on).
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, capacity: u32, bits: u32) -> Result<Self, GpuError> {
        let sizes = SortSizes::new(capacity.into(), bits);
        Self::plan(&sizes).check(&device.limits())?;
        let digit = |i: u32| {
            let shift = i * sizes.width();
            let mask = low_bits(sizes.width().min(sizes.bits - shift));
            let value = SortDigit { shift, mask, capacity, blocks: sizes.blocks() as u32 };
            uniform_buffer(device, "digit", &value)
        };
        Ok(Self {
            buffers: SortBuffers::new(device, &sizes)?,
            sizes,
            scan: Scan::new(device, sizes.counts() as u32)?,
            digits: (0..sizes.digits()).map(digit).collect(),
        })
    }

    /// Number of pairs that fit.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        self.sizes.capacity as u32
    }

    /// Sorts in place. `list` binds `keys`, `payloads` and `count`, whose first `u32` says how many pairs there are; no more than
    /// [`Self::capacity`] are looked at, and what lies behind them is left as it is.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] where one of the names is missing.
    pub fn encode(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        let own = self.buffers.named();
        let at = |name| {
            let unbound = || GpuError::Unbound { kernel: "a sort".to_owned(), name };
            find(&[list, &own], name).cloned().ok_or_else(unbound)
        };
        // From the caller's buffers to those beside them, and back.
        let there: [Named<'_>; 0] = [];
        let back = [
            ("keys", at("sorted_keys")?),
            ("payloads", at("sorted_payloads")?),
            ("sorted_keys", at("keys")?),
            ("sorted_payloads", at("payloads")?),
        ];
        let mut away = false;
        if let Some(digit) = self.digits.first()
            && self.digits.len() % 2 == 1
        {
            // An odd number of moves would end beside the caller's buffers: so it begins there.
            let digit = [named("digit", digit)];
            pass.compute(pipelines, (&RADIX_SORT, "sort_copy"), self.sizes.capacity, &[list, &own, &digit])?;
            away = true;
        }
        let threads = self.sizes.blocks() * u64::from(THREADS);
        for digit in &self.digits {
            let (digit, way) = ([named("digit", digit)], if away { &back[..] } else { &there });
            let lists: [&[Named<'_>]; 4] = [list, &own, way, &digit];
            pass.compute(pipelines, (&RADIX_SORT, "sort_count"), threads, &lists)?;
            self.scan.encode(pipelines, pass, &[named("values", &self.buffers.digit_counts)])?;
            pass.compute(pipelines, (&RADIX_SORT, "sort_scatter"), threads, &lists)?;
            away = !away;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::{check, check_constant, check_workgroup_size};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        check::<SortDigit>(&RADIX_SORT).unwrap();
        check_constant(&RADIX_SORT, "SORT_BLOCK", BLOCK).unwrap();
        check_constant(&RADIX_SORT, "SORT_THREADS", THREADS).unwrap();
        for entry in ["sort_count", "sort_scatter", "sort_copy"] {
            check_workgroup_size(&RADIX_SORT, entry, [THREADS, 1, 1]).unwrap();
        }
    }

    #[test]
    fn digits_are_few_and_even() {
        for (bits, digits, width) in
            [(0, 0, 0), (1, 1, 1), (8, 1, 8), (9, 2, 5), (13, 2, 7), (20, 3, 7), (99, 4, 8)]
        {
            let sizes = SortSizes::new(2049, bits);
            assert_eq!(
                (sizes.digits(), sizes.width(), sizes.counts()),
                (digits, width, 2 << width),
                "{bits}"
            );
        }
    }
}
