// A node of a tree of lights. Twin: Branch in crates/rsm/src/layout.rs, compared field by field in its tests.

/// What is beneath a node as one light, linked to its children and past them.
struct Branch {
    position: vec3<f32>,
    area: f32,
    normal: vec3<f32>,
    reach: f32,
    flux: vec3<f32>,
    next: u32,
    child: u32,
    representative: u32,
    radius: f32,
    versine: f32,
}
