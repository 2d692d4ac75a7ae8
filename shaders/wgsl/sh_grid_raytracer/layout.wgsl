// What all passes share.
// Twins: crates/sh-grid-raytracer/src/{layout,grid,pyramid,voxels}.rs.

/// A photon as the R-grid takes it.
struct StoredPhoton {
    flux: vec3<f32>,
    /// Place of its cell among the boundary cells.
    cell: u32,
    /// Unit vector that shares it out among the faces of its cell.
    axis: vec3<f32>,
    /// Its number among those that were emitted.
    photon: u32,
}

/// For the faces −x, +x, −y, +y, −z, +z flux and area.
struct Faces {
    faces: array<vec4<f32>, 6>,
}

/// A level of the R-grid.
struct GridLevel {
    size: vec3<u32>,
    /// Where its cube begins in cell_index; that of level 0 at 0.
    cube: u32,
    /// Where its cells begin among those of all levels, and how many there are.
    first: u32,
    count: u32,
    /// Side of a cell.
    cell: f32,
    pad0: u32,
}

/// A frame and its settings.
struct FrameSettings {
    /// The SH-grid: corner, side of a cell, cells along each axis.
    origin: vec3<f32>,
    cell: f32,
    size: vec3<u32>,
    /// Boundary cells, and all active ones.
    boundary: u32,
    cells: u32,
    photons: u32,
    /// Photons that are stored at most.
    capacity: u32,
    levels: u32,
    store_reach: f32,
    unit: f32,
    least_area: f32,
    /// Distance of what leads out of the scene.
    far: f32,
    directions: u32,
    coefficients: u32,
    seed: u32,
    printed: u32,
    turned: u32,
    footprint: u32,
    /// RULE_VISIBLE, RULE_SIDE or RULE_AS_PRINTED of interpolate.wgsl.
    weights: u32,
    pixels: u32,
    /// Directions of a pixel, or its rays.
    samples: u32,
    reach: f32,
    /// 0: nothing is obscured.
    obscurance_range: f32,
    pad0: u32,
    grid_levels: array<GridLevel, 8>,
}

/// Directions that are spread evenly, and turns of them, three columns each.
struct DirectionSet {
    turns: array<vec4<f32>, 192>,
    directions: array<vec4<f32>, 2048>,
}

const NO_CELL: u32 = 0xffffffffu;
const TURNS: u32 = 64u;
const FINE: u32 = 4u;

fn grid_local(p: vec3<f32>) -> vec3<f32> {
    return (p - settings.origin) * (1.0 / settings.cell);
}

fn grid_number(cell: vec3<u32>, size: vec3<u32>) -> u32 {
    return (cell.z * size.y + cell.y) * size.x + cell.x;
}

fn grid_cell(number: u32) -> vec3<u32> {
    let rest = number / settings.size.x;
    return vec3(number % settings.size.x, rest % settings.size.y, rest / settings.size.y);
}

fn grid_centre(cell: vec3<u32>) -> vec3<f32> {
    return settings.origin + (vec3<f32>(cell) + 0.5) * settings.cell;
}

/// The six faces' shares of a direction: those of −x, −y, −z and of +x, +y, +z.
struct FaceShares {
    below: vec3<f32>,
    above: vec3<f32>,
}

fn face_shares(d: vec3<f32>) -> FaceShares {
    let below = max(-d, vec3(0.0));
    let above = max(d, vec3(0.0));
    return FaceShares(below * below, above * above);
}
