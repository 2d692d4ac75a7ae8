// Data of the reflective shadow maps. Twin: crates/rsm/src/layout.rs, compared field by field in its tests.

/// A small diffuse patch that radiates the reflected flux `flux`, W.
struct Vpl {
    position: vec3<f32>,
    area: f32,
    normal: vec3<f32>,
    pad0: f32,
    flux: vec3<f32>,
    pad1: f32,
}

/// Light in one texel of a map.
struct Texel {
    incident: vec3<f32>,
    pad0: f32,
    reflected: vec3<f32>,
    area: f32,
}

/// Bounds and sums over the lit texels beneath a node of the pyramid; empty where depth_min > depth_max.
struct Node {
    reflected: vec3<f32>,
    depth_min: f32,
    incident: vec3<f32>,
    depth_max: f32,
    cone_axis: vec3<f32>,
    cone_versine: f32,
}

/// One light seen through one view.
struct LightMap {
    right: vec3<f32>,
    half_width: f32,
    up: vec3<f32>,
    half_height: f32,
    forward: vec3<f32>,
    orthographic: u32,
    power: vec3<f32>,
    inverse_range: f32,
    axis: vec3<f32>,
    cos_outer: f32,
    spot_scale: f32,
    resolution: u32,
    pad0: u32,
    pad1: u32,
}

/// Marks a texel that sees nothing.
const NO_TRIANGLE: u32 = 0xffffffffu;

/// Luminance of linear RGB with the BT.709 primaries.
fn luminance(rgb: vec3<f32>) -> f32 {
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}
