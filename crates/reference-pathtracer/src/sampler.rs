use glam::Vec2;
use indirect_sampling::{rng, sobol};

/// Tell the uses of one seed apart.
pub(crate) const PATHS: u32 = 0x7061_7468;
pub(crate) const LIGHT_PATHS: u32 = 0x6c69_6768;

/// The random numbers of one path: low-discrepancy pairs for its first decisions, hashed ones for the tail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampler {
    seed: u32,
    index: u32,
    state: u64,
}

impl Sampler {
    /// The path `index` of the point set `seed`.
    #[inline]
    pub(crate) fn new(seed: u32, index: u32) -> Self {
        Self { seed, index, state: u64::from(seed) << 32 | u64::from(index) }
    }

    /// The pair of dimension `pair`: over all indices of a seed a stratified point set of its own.
    #[inline]
    pub(crate) fn pair(&self, pair: u32) -> Vec2 {
        sobol::sample_2d(self.index, rng::hash_combine(self.seed, pair))
    }

    /// The single number of dimension `single`, likewise.
    #[inline]
    pub(crate) fn single(&self, single: u32) -> f32 {
        sobol::sample_1d(self.index, rng::hash_combine(self.seed, !single))
    }

    /// The next independent uniform number of `[0, 1)`. SplitMix64 (Steele, Lea & Flood 2014): the finalizer makes streams
    /// of neighbouring seeds independent, and 64 bits of state keep them from meeting within a long render.
    #[inline]
    pub(crate) fn next(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        rng::unit_f32((z >> 32) as u32)
    }

    #[inline]
    pub(crate) fn next_pair(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }
}
