#![allow(unsafe_code, reason = "AVX2 intrinsics behind a run-time check, and a stack without initialisation")]
//! The only module with `unsafe`: eight f32 lanes as an AVX2 register, the run-time choice of instruction set, and the
//! traversal stack.
//!
//! Every operation of [`Lanes`] is a single IEEE operation per lane in both implementations, nothing is fused, so both
//! give the same bits.
//!
//! Safety: a value of the AVX2 type is only made inside [`run_avx2`], which only runs when [`Isa::detect`] has seen AVX2. The stack's entries are only read after they were written, below its length.

use core::mem::MaybeUninit;

use crate::layout::{Row, WIDTH};

/// Instruction set of the queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Isa {
    /// Whatever the crate was compiled for.
    Portable,
    /// x86-64 with AVX2 and BMI.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Isa {
    /// The best that this processor has.
    pub(crate) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
        {
            return Self::Avx2;
        }
        Self::Portable
    }

    /// Runs a query with this instruction set.
    #[inline]
    pub(crate) fn run<Q: Query>(self, query: Q) -> Q::Answer {
        match self {
            Self::Portable => query.run::<[f32; WIDTH]>(),
            // Safety: `detect` saw the features.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { run_avx2(query) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2")]
unsafe fn run_avx2<Q: Query>(query: Q) -> Q::Answer {
    query.run::<x86::Avx2>()
}

/// What runs with any instruction set. Everything in [`Query::run`] must be `#[inline(always)]`, to be compiled for the chosen one.
pub(crate) trait Query {
    type Answer;
    fn run<L: Lanes>(self) -> Self::Answer;
}

/// Eight f32 lanes.
pub(crate) trait Lanes: Copy {
    fn splat(x: f32) -> Self;
    fn load(row: &Row) -> Self;
    fn store(self) -> Row;
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    /// `self < b ? self : b`: `b` where `self` is NaN.
    fn min(self, b: Self) -> Self;
    /// `self > b ? self : b`: `b` where `self` is NaN.
    fn max(self, b: Self) -> Self;
    /// Bit per lane: `self ≤ b`.
    fn le(self, b: Self) -> u32;
    /// Bit per lane: `self < b`.
    fn lt(self, b: Self) -> u32;
    /// Bit per lane: `self = b`.
    fn eq(self, b: Self) -> u32;
}

#[inline(always)]
fn map(a: [f32; WIDTH], b: [f32; WIDTH], f: impl Fn(f32, f32) -> f32) -> [f32; WIDTH] {
    let mut r = [0.0; WIDTH];
    for i in 0..WIDTH {
        r[i] = f(a[i], b[i]);
    }
    r
}

#[inline(always)]
fn bits(a: [f32; WIDTH], b: [f32; WIDTH], f: impl Fn(f32, f32) -> bool) -> u32 {
    let mut r = 0;
    for i in 0..WIDTH {
        r |= u32::from(f(a[i], b[i])) << i;
    }
    r
}

impl Lanes for [f32; WIDTH] {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        [x; WIDTH]
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        row.0
    }
    #[inline(always)]
    fn store(self) -> Row {
        Row(self)
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        map(self, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        map(self, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        map(self, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        map(self, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        map(self, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        map(self, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        bits(self, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        bits(self, b, |a, b| a < b)
    }
    #[inline(always)]
    fn eq(self, b: Self) -> u32 {
        bits(self, b, |a, b| a == b)
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use core::arch::x86_64::*;

    use super::{Lanes, Row};

    /// An AVX register.
    #[derive(Clone, Copy)]
    pub(super) struct Avx2(__m256);

    // Safety of every block: see the module.
    impl Lanes for Avx2 {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(row: &Row) -> Self {
            // `Row` is 32 bytes at an alignment of 32.
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> Row {
            let mut row = Row([0.0; 8]);
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            Self(unsafe { _mm256_add_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            Self(unsafe { _mm256_sub_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            Self(unsafe { _mm256_mul_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            Self(unsafe { _mm256_div_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)) as u32 }
        }
        #[inline(always)]
        fn lt(self, b: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0)) as u32 }
        }
        #[inline(always)]
        fn eq(self, b: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, b.0)) as u32 }
        }
    }
}

/// An entry of the traversal stack: a child link and the ray parameter at which the ray enters its box.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) link: u32,
    pub(crate) near: f32,
}

/// A traversal stack in memory that nobody had to initialise.
pub(crate) struct Stack<'a> {
    entries: &'a mut [MaybeUninit<Entry>],
    length: usize,
}

impl Stack<'_> {
    /// Runs `f` with a stack that can hold `size` entries.
    #[inline(always)]
    pub(crate) fn with<R>(size: usize, f: impl FnOnce(Stack<'_>) -> R) -> R {
        /// Holds a balanced tree of any size; deeper trees are rare enough to pay for an allocation.
        const INLINE: usize = 128;
        let mut inline = [const { MaybeUninit::uninit() }; INLINE];
        let mut heap = Vec::new();
        let entries = if size <= INLINE {
            &mut inline[..]
        } else {
            heap.resize_with(size, MaybeUninit::uninit);
            &mut heap[..]
        };
        f(Stack { entries, length: 0 })
    }

    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.length
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, entry: Entry) {
        self.entries[self.length].write(entry);
        self.length += 1;
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        self.length = self.length.checked_sub(1)?;
        // Safety: every entry below the length has been written.
        Some(unsafe { self.entries[self.length].assume_init() })
    }

    /// Pushes `entry`, then moves it below all entries from `base` on that are nearer.
    #[inline(always)]
    pub(crate) fn insert(&mut self, base: usize, entry: Entry) {
        self.push(entry);
        let mut i = self.length - 1;
        while i > base {
            // Safety: every entry below the length has been written.
            let below = unsafe { self.entries[i - 1].assume_init() };
            if below.near >= entry.near {
                break;
            }
            self.entries[i].write(below);
            i -= 1;
        }
        self.entries[i].write(entry);
    }
}
