// What the passes that make a tree over a list of lights share.
// Twin: crates/rsm/src/tree.rs and crates/rsm/src/cpu/tree.rs.

/// The tree and its settings.
struct Tree {
    /// Index of the first branch of each level, that of the lights first; four levels to a row.
    offsets: array<vec4<u32>, 6>,
    /// Places in the list: branches of level 0.
    lights: u32,
    /// That rounded up to what is sorted.
    padded: u32,
    /// Branches that have children, and all.
    inner: u32,
    branches: u32,
    /// Workgroups that look for the lights' bounds.
    partials: u32,
    /// Draws the representatives.
    seed: u32,
    /// What is compared with the threshold. 0: the error of a branch; 1: the light that it sends.
    bound: u32,
    /// The threshold, as a share of the reference irradiance.
    tau: f32,
}

@group(0) @binding(0) var<uniform> tree: Tree;
@group(0) @binding(1) var<storage, read> vpls: array<Vpl>;
/// Number of lights in the list.
@group(0) @binding(2) var<storage, read> count: array<u32>;

/// By the bits: shader compilers may assume that there is nothing else.
fn is_finite3(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3(0x7f800000u)) != vec3(0x7f800000u));
}

/// Whether the light of a place in the list takes part.
fn is_lit(i: u32) -> bool {
    if i >= min(count[0], tree.lights) {
        return false;
    }
    let own = vpls[i];
    return is_finite3(own.position) && is_finite3(own.normal) && is_finite3(own.flux) && is_finite3(vec3(own.area))
        && weight(own.flux) > 0.0;
}
