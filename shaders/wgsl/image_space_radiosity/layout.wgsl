// Data of image-space radiosity. Twin: crates/image-space-radiosity/src/layout.rs, compared field by field in its tests.

/// Mean and bounds of the surfaces in a block of 2^level × 2^level pixels; empty where pixels = 0.
struct Block {
    position: vec3<f32>,
    depth_min: f32,
    normal: vec3<f32>,
    depth_max: f32,
    versine: f32,
    pixels: u32,
    mixed: u32,
    radius: f32,
}

/// Texels of a reflective shadow map as one light.
struct Patch {
    position: vec3<f32>,
    area: f32,
    normal: vec3<f32>,
    radius: f32,
    flux: vec3<f32>,
    versine: f32,
    relief: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

/// A level of a pyramid and the finer one below it.
struct LevelPair {
    fine_offset: u32,
    fine_width: u32,
    fine_height: u32,
    /// Number of the coarser level.
    level: u32,
    coarse_offset: u32,
    coarse_width: u32,
    coarse_height: u32,
    /// First node of level 1: those of level 0 are not stored.
    first: u32,
    image_width: u32,
    image_height: u32,
    pad0: u32,
    pad1: u32,
}

/// Maps whose patches and branches share buffers: as many as a storage binding of any device holds.
struct Part {
    first_map: u32,
    maps: u32,
    /// Its first branch and the one past its end.
    first: u32,
    end: u32,
}

/// One map.
struct MapIndex {
    /// Among all, and within its part.
    map: u32,
    in_part: u32,
    pad0: u32,
    pad1: u32,
}

/// What may change from frame to frame.
struct Settings {
    /// Depth range of a block, relative to its greatest depth, from which on it is subdivided.
    depth: f32,
    /// Likewise the versine of the half angle of its cone of normals.
    versine: f32,
    /// Distance of a concave edge within which a block is subdivided, in its radii.
    margin: f32,
    /// Second differences of the irradiance across a block, as a share of the reference irradiance.
    bend: f32,
    /// Distance of a patch from its plane relative to its radius, from which on it is subdivided.
    patch_depth: f32,
    /// Likewise the versine of the half angle of its cone of normals.
    patch_versine: f32,
    /// Share of the reference irradiance from which on a patch is subdivided.
    tau: f32,
    /// What is compared with it. 0: the error of a patch; 1: the light that it sends. 2: nothing; patches
    /// without a discontinuity are not subdivided, others are.
    bound: u32,
    /// What a light's area is multiplied by: 1 for the disc form, 0 for the point form.
    area_scale: f32,
    /// Share of the reference irradiance at which a bounded splat ends.
    cutoff: f32,
    /// Draws where shadow maps stand.
    seed: u32,
    /// Level of the patches that have one; beyond all levels where none have.
    shadow_level: u32,
}

/// Lengths of lists and of the image.
struct Lengths {
    /// Pixels: the first node of level 1.
    pixels: u32,
    /// Nodes that have a state.
    nodes: u32,
    /// Entries of the order.
    entries: u32,
    /// Runs of RUN entries.
    runs: u32,
    /// Dispatches of the gather, one per chunk of lights.
    chunks: u32,
    /// Nodes that the reference irradiance is a mean over: the first and their number.
    first_receiver: u32,
    receivers: u32,
    /// Branches of each map, and those of them that are no texels.
    branches: u32,
    coarse_branches: u32,
    /// Patches of each map that are no texels.
    patches: u32,
    /// Width and height of the target of splats.
    splats: vec2<u32>,
}

/// State of a block.
const EMPTY: u32 = 0u;
const COVERED: u32 = 1u;
const VALID: u32 = 2u;
const SPLIT: u32 = 3u;
