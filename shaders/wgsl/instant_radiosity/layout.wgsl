// Data of instant radiosity.
// Twin: crates/instant-radiosity/src/layout.rs.

/// A triangle of the scene as light leaves it.
struct TriangleSurface {
    /// Unit normal of its front.
    normal: vec3<f32>,
    pad0: f32,
    albedo: vec3<f32>,
    pad1: f32,
}

/// What all virtual lights have in common.
struct Summary {
    /// What the flux of the last bounce is multiplied by, to stand for all that would follow.
    tail: vec3<f32>,
    /// Area that bounds the light of each near by, m².
    area: f32,
}

/// A frame and its settings.
struct FrameSettings {
    width: u32,
    height: u32,
    interleave: u32,
    /// Virtual lights of each bounce.
    per_bounce: u32,
    bounces: u32,
    /// Those that start at emitters.
    from_emitters: u32,
    /// Shadow tests for each receiver; 0: all.
    tests: u32,
    /// 1 where paths carry what the bound removes.
    compensated: u32,
    /// What the pixels' random numbers begin with.
    seed: u32,
    /// Punctual lights.
    lights: u32,
    /// Characteristic length of the scene, metres.
    unit: f32,
    /// In units of the mean area of a virtual light.
    bound: f32,
    /// 1 where the last bounce stands for all that follow.
    tail: u32,
    /// Luminance of the flux of all emitters, W.
    emitted: f32,
    confidence: f32,
    moved: f32,
    turned: f32,
    changed: f32,
    outliers: f32,
    depth: f32,
    normal: f32,
    /// Area of all triangles, m².
    area: f32,
    /// 1 where something moved: `before` holds where the pixels' surfaces were.
    moving: u32,
    /// Shadow tests where a path ends; 0: all.
    path_tests: u32,
    /// How often a path goes on, in units of the share that it carries.
    paths: f32,
    /// Bounces whose lights the end of a path is lit by.
    path_bounces: u32,
    /// Parts of the lights that the end of a path is lit by.
    path_parts: u32,
    /// Branches of the tree over all lights that have children, and all; 0 where pixels gather no cuts.
    inner: u32,
    branches: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

const FRAC_1_PI: f32 = 0.318309886183791;

/// A number in [0, 1) that belongs to a pixel, a seed of the frame and a use of it.
fn pixel_number(pixel: u32, seed: u32, salt: u32) -> f32 {
    return unit_f32(hash_combine(hash_combine(pixel, seed), salt));
}
