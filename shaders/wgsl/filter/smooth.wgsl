// smooth: a frame's irradiance blended with that of the frames before, reprojected.
// Twin: crates/filter/src/cpu/smooth.rs.
// Source: Papaioannou 2011, "Real-Time Diffuse Global Illumination Using Radiance Hints", §9.1.

struct Smoothing {
    /// Share of the past.
    factor: f32,
}

@group(0) @binding(0) var<uniform> smoothing: Smoothing;
/// The camera of the frame before.
@group(0) @binding(1) var<uniform> previous_view: View;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> irradiance: array<vec4<f32>>;
/// Smoothed irradiance of the frame before, and the view depth of its pixels.
@group(0) @binding(5) var<storage, read> history: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> smoothed: array<vec4<f32>>;

const DEPTH_TOLERANCE: f32 = 0.02;

@compute @workgroup_size(64)
fn smooth_pixels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < arrayLength(&smoothed) {
        smoothed[i] = vec4(smooth_pixel(i), positions[i].w);
    }
}

/// Tests the bits: a shader may assume that there is no NaN.
fn is_finite(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3(0x7f800000u)) != vec3(0x7f800000u));
}

fn smooth_pixel(i: u32) -> vec3<f32> {
    if all(normals[i].xyz == vec3(0.0)) {
        return vec3(0.0);
    }
    let now = irradiance[i].xyz;
    let p = positions[i].xyz;
    let at = view_image_point(previous_view, p);
    if at.z <= 0.0 {
        return now;
    }
    let expected = dot(previous_view.forward, p - previous_view.origin);
    let size = vec2<f32>(previous_view.size);
    // Between the centres of four pixels.
    let place = at.xy * size - 0.5;
    let lowest = floor(place);
    let t = place - lowest;
    var sum = vec3(0.0);
    var total = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let side = vec2(f32(corner & 1u), f32(corner >> 1u));
        let texel = lowest + side;
        if texel.x >= 0.0 && texel.y >= 0.0 && texel.x < size.x && texel.y < size.y {
            let past = history[u32(texel.y) * previous_view.size.x + u32(texel.x)];
            if abs(past.w - expected) <= DEPTH_TOLERANCE * abs(expected) && is_finite(past.xyz) {
                let part = 1.0 - abs(t - side);
                let weight = part.x * part.y;
                sum += past.xyz * weight;
                total += weight;
            }
        }
    }
    if total <= 0.0 {
        return now;
    }
    return now + (sum * (1.0 / total) - now) * (smoothing.factor * total);
}
