use glam::Vec3;
use indirect_core::Image;
use rsm::{Branch, Rsm, Vpl};

use crate::fitted::Fitted;
use crate::layout::{Block, Patch};
use crate::settings::{Options, Params};

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct ImageSpaceRadiosity;

/// All settings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// Fixed.
    pub options: Options,
    /// Per frame.
    pub params: Params,
    /// What the scene has; made by `Fit::fit`. Without it nothing stands in the way with `visibility=maps` either.
    pub fitted: Fitted,
}

/// The valid blocks in Z order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fragments {
    /// The node of each fragment.
    pub nodes: Vec<u32>,
    /// World position of each fragment, metres.
    pub positions: Vec<Vec3>,
    /// Its unit normal.
    pub normals: Vec<Vec3>,
    /// The fragment of each valid node; 0 for any other node.
    pub slots: Vec<u32>,
}

/// Irradiance of nodes, W/m².
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Irradiance {
    /// Of the pixels, level 0.
    pub pixels: Vec<Vec3>,
    /// Of the blocks of level 1 and coarser ones.
    pub coarse: Vec<Vec3>,
}

impl Irradiance {
    /// Irradiance of a node.
    #[must_use]
    pub fn at(&self, node: usize) -> Vec3 {
        match node.checked_sub(self.pixels.len()) {
            None => self.pixels[node],
            Some(i) => self.coarse[i],
        }
    }
}

/// The indirect light of a frame and everything that was computed on the way. What the options do not ask for is empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// The maps.
    pub rsm: Rsm,
    /// Patches of each map, level 1 first: those of level 0 are the texels.
    pub patches: Vec<Vec<Patch>>,
    /// The coarsest lights of all maps, one map after the other.
    pub sources: Vec<Patch>,
    /// Blocks of pixels, level 1 first: those of level 0 are the pixels.
    pub blocks: Vec<Block>,
    /// The irradiance that thresholds are shares of, W/m².
    pub reference: f32,
    /// The traversal's tree: the branches of all maps, one map after the other.
    pub tree: Vec<Branch>,
    /// One light or none per slot, for lights that are a list.
    pub light_slots: Vec<Vpl>,
    /// The lights with flux.
    pub lights: Vec<Vpl>,
    /// Per block, level 1 first, 1 where it needs subdivision.
    pub needs: Vec<u32>,
    /// The [`state`](crate::layout::state) of each node, the pixels first.
    pub states: Vec<u32>,
    /// The valid blocks.
    pub fragments: Fragments,
    /// Irradiance on each fragment, W/m².
    pub gathered: Vec<Vec3>,
    /// The virtual point lights from which shadow maps look, one per patch that has a map or per light of a list.
    pub shadow_lights: Vec<Vpl>,
    /// Their maps.
    #[cfg(feature = "cpu")]
    pub shadows: imperfect_shadow_maps::cpu::Atlas,
    /// Lights in the cut of each tile of fragments.
    pub cuts: Vec<u32>,
    /// Irradiance of pixels and blocks.
    pub irradiance: Irradiance,
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
}
