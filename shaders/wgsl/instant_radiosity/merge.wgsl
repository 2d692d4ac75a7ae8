// merge: the pixels of a block put together, and with the frame before.
// Twin: crates/instant-radiosity/src/cpu/merge.rs.
// Source: thesis §3.4.1 and §3.5, equations 3.1 to 3.6.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
/// The camera of the frame before.
@group(0) @binding(1) var<uniform> previous_view: View;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> gathered: array<vec4<f32>>;
/// Irradiance of the frame before, and the view depth of its pixels.
@group(0) @binding(5) var<storage, read> past_irradiance: array<vec4<f32>>;
/// Normals of the frame before, and the frames that its irradiance is the mean of.
@group(0) @binding(6) var<storage, read> past_normals: array<vec4<f32>>;
/// Where the pixels' surfaces were in the frame before.
@group(0) @binding(7) var<storage, read> before: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> irradiance: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> merged_normals: array<vec4<f32>>;

const DEPTH_TOLERANCE: f32 = 0.02;

@compute @workgroup_size(64)
fn merge(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.width * settings.height {
        return;
    }
    let n = normals[i].xyz;
    if all(n == vec3(0.0)) {
        irradiance[i] = vec4(0.0);
        merged_normals[i] = vec4(0.0);
        return;
    }
    let now = box_filter(i, n);
    var p = positions[i].xyz;
    if settings.moving == 1u {
        p = before[i].xyz;
    }
    let blended = blend(i, now, p, n);
    irradiance[i] = vec4(blended.xyz, positions[i].w);
    merged_normals[i] = vec4(n, blended.w);
}

/// Tests the bits: a shader may assume that there is no NaN.
fn is_finite(v: vec4<f32>) -> bool {
    return all((bitcast<vec4<u32>>(v) & vec4(0x7f800000u)) != vec4(0x7f800000u));
}

/// Mean over the block's pixels of the same surface, and the standard error of its luminance.
fn box_filter(i: u32, normal: vec3<f32>) -> vec4<f32> {
    let n = settings.interleave;
    let x = i % settings.width;
    let y = i / settings.width;
    let p = positions[i].xyz;
    let out = settings.depth * positions[i].w;
    var sum = vec3(0.0);
    var squares = 0.0;
    var count = 0.0;
    for (var dy = 0u; dy < n; dy++) {
        for (var dx = 0u; dx < n; dx++) {
            // Wraps around below 0, and is beyond the image then.
            let qx = x + dx - n / 2u;
            let qy = y + dy - n / 2u;
            if qx >= settings.width || qy >= settings.height {
                continue;
            }
            let q = qy * settings.width + qx;
            let other = normals[q].xyz;
            if any(other != vec3(0.0)) && abs(dot(normal, positions[q].xyz - p)) <= out
                && dot(normal, other) >= settings.normal {
                let e = gathered[q].xyz;
                sum += e;
                let l = luminance(e);
                squares += l * l;
                count += 1.0;
            }
        }
    }
    if count == 0.0 {
        return vec4(gathered[i].xyz, 0x1.fffffep+127f);
    }
    let mean = sum * (1.0 / count);
    let l = luminance(mean);
    let variance = max(squares / count - l * l, 0.0) / max(count - 1.0, 1.0);
    return vec4(mean, select(0x1.fffffep+127f, sqrt(variance), count > 1.0));
}

/// Irradiance, and the number of frames that it is the mean of.
fn blend(i: u32, now: vec4<f32>, p: vec3<f32>, n: vec3<f32>) -> vec4<f32> {
    let alone = vec4(now.xyz, 1.0);
    let at = view_image_point(previous_view, p);
    if at.z <= 0.0 {
        return alone;
    }
    let expected = dot(previous_view.forward, p - previous_view.origin);
    let size = vec2<f32>(previous_view.size);
    let place = at.xy * size - 0.5;
    let lowest = floor(place);
    let t = place - lowest;
    var sum = vec4(0.0);
    var earlier_normal = vec4(0.0);
    var total = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let side = vec2(f32(corner & 1u), f32(corner >> 1u));
        let texel = lowest + side;
        if texel.x >= 0.0 && texel.y >= 0.0 && texel.x < size.x && texel.y < size.y {
            let k = u32(texel.y) * previous_view.size.x + u32(texel.x);
            let seen = past_irradiance[k];
            let past_normal = past_normals[k];
            if abs(seen.w - expected) <= DEPTH_TOLERANCE * abs(expected) && is_finite(seen)
                && past_normal.w > 0.0 && dot(past_normal.xyz, n) >= settings.normal {
                let part = 1.0 - abs(t - side);
                let weight = part.x * part.y;
                sum += seen * weight;
                earlier_normal += past_normal * weight;
                total += weight;
            }
        }
    }
    if total <= 0.0 {
        return alone;
    }
    var earlier = sum * (1.0 / total);
    let before_normal = earlier_normal * (1.0 / total);
    let new_light = luminance(now.xyz);
    let old_light = luminance(earlier.xyz);
    // Back to what the present pixels' spread allows.
    let most = settings.outliers * now.w;
    if settings.outliers > 0.0 && abs(old_light - new_light) > most {
        let share = most / abs(old_light - new_light);
        earlier = vec4(now.xyz + (earlier.xyz - now.xyz) * share, earlier.w);
    }
    // Equations 3.1 to 3.4, the light's change relative to the light.
    let here = vec2(f32(i % settings.width) + 0.5, f32(i / settings.width) + 0.5)
        / vec2(f32(settings.width), f32(settings.height));
    let depth = positions[i].w;
    let way = vec3(here - at.xy, (depth - earlier.w) / max(depth, 1.1754944e-38));
    let moved = sqrt(dot(way, way)) * settings.moved;
    let turned = (1.0 - dot(n, before_normal.xyz)) * settings.turned;
    let change = abs(new_light - old_light) / max(max(new_light, old_light), 1.1754944e-38);
    let changed = min(change * change * change, 1.0) * settings.changed;
    let confidence = settings.confidence * clamp(1.0 - max(max(moved, turned), changed), 0.0, 1.0);
    let share = min(confidence, before_normal.w / (before_normal.w + 1.0)) * total;
    return vec4(now.xyz + (earlier.xyz - now.xyz) * share, 1.0 / max(1.0 - share, 1e-3));
}
