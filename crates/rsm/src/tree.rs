//! What the twins of the tree over a list of lights share: where its branches lie and how they are linked.

/// The levels of a binary tree over a list of lights, from the single root down to the lights: level `k` has a branch
/// for every `2^k` neighbours in the list, the last of them for fewer. Links follow from the number of lights alone.
///
/// Coarse levels come first and siblings lie side by side, so that a traversal touches few cache lines.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TreeLayout {
    /// Offset and number of branches per level, that of the lights (0) first.
    levels: Vec<[u32; 2]>,
}

impl TreeLayout {
    /// Most lights: what a storage binding of any WebGPU device, 128 MiB, holds the branches of.
    pub const MAX_LIGHTS: u32 = 1 << 20;
    /// Most branches that stand for the light of all in the reference irradiance.
    pub const SOURCES: u32 = 64;
    /// Most receivers that the reference irradiance is a mean over.
    pub const SAMPLES: u32 = 256;

    /// For up to [`Self::MAX_LIGHTS`] lights (more are cut down to that); none have no branches.
    #[must_use]
    pub fn new(lights: u32) -> Self {
        let mut levels = Vec::new();
        let mut count = lights.min(Self::MAX_LIGHTS);
        while count > 0 {
            levels.push([0, count]);
            count = if count > 1 { count.div_ceil(2) } else { 0 };
        }
        let mut offset = 0;
        for level in levels.iter_mut().rev() {
            level[0] = offset;
            offset += level[1];
        }
        Self { levels }
    }

    /// Number of levels.
    #[must_use]
    pub const fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Index of the first branch of a level; that of the first light for level 0, 0 beyond the root.
    #[must_use]
    pub fn offset(&self, level: usize) -> u32 {
        self.levels.get(level).map_or(0, |l| l[0])
    }

    /// Number of branches of a level; 0 beyond the root.
    #[must_use]
    pub fn count(&self, level: usize) -> u32 {
        self.levels.get(level).map_or(0, |l| l[1])
    }

    /// Number of all branches: less than twice that of lights, and one more per level.
    #[must_use]
    pub fn len(&self) -> u32 {
        self.inner() + self.count(0)
    }

    /// Whether there are no lights.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Number of branches that have children, which come first.
    #[must_use]
    pub fn inner(&self) -> u32 {
        self.offset(0)
    }

    /// The branch that follows branch `i` of a level and all beneath it; [`Self::len`] after the last.
    #[must_use]
    pub fn next(&self, level: usize, i: u32) -> u32 {
        let following = i + 1;
        if following >= self.count(level) {
            return self.len();
        }
        // The largest subtree that begins there.
        let up = following.trailing_zeros();
        self.offset(level + up as usize) + (following >> up)
    }

    /// The first child of branch `i` of a level; 0 for a light.
    #[must_use]
    pub fn child(&self, level: usize, i: u32) -> u32 {
        if level > 0 { self.offset(level - 1) + 2 * i } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_that_always_descends_meets_every_branch_and_skipping_leaves_its_subtree() {
        for lights in [0, 1, 2, 3, 5, 8, 13, 64, 100] {
            let t = TreeLayout::new(lights);
            let place = |branch: u32| {
                let level = (0..t.levels()).find(|&k| branch >= t.offset(k)).unwrap();
                (level, branch - t.offset(level))
            };
            let walk = |skip: Option<u32>| {
                let (mut branch, mut met) = (0, Vec::new());
                while branch < t.len() {
                    met.push(branch);
                    let (level, i) = place(branch);
                    let descend = level > 0 && Some(branch) != skip;
                    branch = if descend { t.child(level, i) } else { t.next(level, i) };
                }
                met.sort_unstable();
                met
            };
            assert!(walk(None).into_iter().eq(0..t.len()), "{lights}");
            for skip in 0..t.len() {
                let (level, i) = place(skip);
                let kept = (0..t.len()).filter(|&branch| {
                    let (l, k) = place(branch);
                    !(l < level && k >> (level - l) == i)
                });
                assert!(walk(Some(skip)).into_iter().eq(kept), "{lights} {skip}");
            }
        }
    }

    #[test]
    fn levels_halve_to_one_root_and_the_largest_tree_fits_a_binding() {
        let t = TreeLayout::new(65_536);
        assert_eq!((t.levels(), t.len(), t.inner(), t.count(16)), (17, 131_071, 65_535, 1));
        let largest = TreeLayout::new(u32::MAX);
        assert_eq!(largest.count(0), TreeLayout::MAX_LIGHTS);
        assert!(u64::from(largest.len()) * size_of::<crate::Branch>() as u64 <= 128 << 20);
        assert!(TreeLayout::new(0).is_empty() && !largest.is_empty());
    }
}
