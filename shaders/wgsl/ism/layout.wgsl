// Data of imperfect shadow maps. Twin: crates/imperfect-shadow-maps/src/layout.rs, compared field by field in its tests.

/// A point of the scene's surface in the world.
struct IsmPoint {
    position: vec3<f32>,
    area: f32,
    normal: vec3<f32>,
    pad0: f32,
    albedo: vec3<f32>,
    pad1: f32,
}

/// What all passes and queries read.
struct Ism {
    /// Texels along each side of a map.
    tile: u32,
    /// Maps for which there is room.
    tiles: u32,
    points: u32,
    points_per_map: u32,
    /// Coarser levels, and the texels of all of them in a map.
    levels: u32,
    coarse: u32,
    area_scale: f32,
    /// Factors of reciprocal depths.
    bias: f32,
    point_bias: f32,
    reach: f32,
    pad0: u32,
    pad1: u32,
}

/// The axes of a VPL's map, beside its normal.
struct IsmFrame {
    tangent: vec3<f32>,
    bitangent: vec3<f32>,
}

/// Orthonormal basis around a unit normal: Duff et al. 2017. Twin: indirect_core::math::orthonormal_basis.
fn ism_frame(n: vec3<f32>) -> IsmFrame {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return IsmFrame(
        vec3<f32>(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        vec3<f32>(b, sign + n.y * n.y * a, -n.y),
    );
}

/// The middle of a texel in the unit disc, along one axis.
fn ism_middle(i: u32, tile: u32) -> f32 {
    return (f32(i) + 0.5) * (2.0 / f32(tile)) - 1.0;
}
