// Patches of level 0 are the texels of a reflective shadow map and read from there, coarser ones are stored.
// Twin: Patches in crates/image-space-radiosity/src/cpu/patches.rs.

@group(0) @binding(10) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read> texels: array<Texel>;

const PATCH_EMPTY: Patch = Patch(vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0, 0.0, 0.0, 0.0);
const FRAC_1_PI: f32 = 0.318309886183791;

/// The patch of one texel: a disc.
fn texel_patch(i: u32) -> Patch {
    let texel = texels[i];
    if weight(texel.reflected) <= 0.0 {
        return PATCH_EMPTY;
    }
    let radius = sqrt(texel.area * FRAC_1_PI);
    return Patch(positions[i].xyz, texel.area, normals[i].xyz, radius, texel.reflected, 0.0, 0.0, 0.0, 0.0, 0.0);
}
