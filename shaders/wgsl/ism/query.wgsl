// query: whether light of a virtual point light reaches a receiver. Needs ism/layout.wgsl, and of the module that includes it
//     var<uniform> ism: Ism;
//     var<storage, read> ism_atlas: array<f32>;
// Twin: crates/imperfect-shadow-maps/src/cpu/atlas.rs, which holds the equations.

/// A receiver of unknown slope. `ism_visible_surface` errs about half as often.
fn ism_visible(index: u32, vpl_position: vec3<f32>, vpl_normal: vec3<f32>, receiver: vec3<f32>) -> bool {
    let v = receiver - vpl_position;
    let z = dot(vpl_normal, v);
    if !(z > 0.0) || index >= ism.tiles {
        return false;
    }
    let frame = ism_frame(vpl_normal);
    let c = 1.0 / (length(v) + z);
    let texel = ism_texel(vec2(dot(frame.tangent, v), dot(frame.bitangent, v)) * c);
    return ism_read(index, texel) <= c * ism.point_bias;
}

/// A receiver with a unit normal; false where either side faces away from the other.
fn ism_visible_surface(
    index: u32,
    vpl_position: vec3<f32>,
    vpl_normal: vec3<f32>,
    receiver: vec3<f32>,
    receiver_normal: vec3<f32>,
) -> bool {
    return ism_visible_in(index, ism_frame(vpl_normal), vpl_position, vpl_normal, receiver, receiver_normal);
}

/// The same for a loop that asks for many receivers of one VPL: the frame is `ism_frame(vpl_normal)`.
fn ism_visible_in(
    index: u32,
    frame: IsmFrame,
    vpl_position: vec3<f32>,
    vpl_normal: vec3<f32>,
    receiver: vec3<f32>,
    receiver_normal: vec3<f32>,
) -> bool {
    let v = receiver - vpl_position;
    let z = dot(vpl_normal, v);
    let k = -2.0 * dot(receiver_normal, v);
    if !(z > 0.0 && k > 0.0) || index >= ism.tiles {
        return false;
    }
    let c = 1.0 / (length(v) + z);
    let texel = ism_texel(vec2(dot(frame.tangent, v), dot(frame.bitangent, v)) * c);
    // The receiver's plane at the middle of the texel, times k.
    let x = ism_middle(texel.x, ism.tile);
    let y = ism_middle(texel.y, ism.tile);
    let nx = dot(frame.tangent, receiver_normal);
    let ny = dot(frame.bitangent, receiver_normal);
    let nz = dot(vpl_normal, receiver_normal);
    let plane = -(2.0 * (nx * x + ny * y) + nz * (1.0 - (x * x + y * y)));
    let near = k * c * ism.reach;
    let far = k * c / ism.reach;
    return ism_read(index, texel) * k <= clamp(plane, far, near) * ism.bias;
}

/// The texel of a place in the unit disc.
fn ism_texel(q: vec2<f32>) -> vec2<u32> {
    let half = 0.5 * f32(ism.tile);
    return min(vec2<u32>(q * half + half), vec2(ism.tile - 1u));
}

fn ism_read(index: u32, texel: vec2<u32>) -> f32 {
    return ism_atlas[(index * ism.tile + texel.y) * ism.tile + texel.x];
}
