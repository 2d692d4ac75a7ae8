// flux: how much light each texel of a map carries, and how much of it the surface reflects.
// Twin: crates/rsm/src/cpu/flux.rs, which holds the derivations.
// Solid angle: Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle".

@group(0) @binding(0) var<uniform> map: LightMap;
@group(0) @binding(1) var<storage, read> triangles: array<u32>;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> albedos: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> texels: array<Texel>;

const MIN_FOOTPRINT_COSINE: f32 = 0.015625;
const MIN_POSITIVE: f32 = 1.17549435e-38;

@compute @workgroup_size(64)
fn flux(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= arrayLength(&texels) {
        return;
    }
    if triangles[i] == NO_TRIANGLE {
        texels[i] = Texel();
    } else {
        texels[i] = flux_texel(i, positions[i].w, normals[i].xyz, albedos[i].xyz);
    }
}

fn flux_texel(i: u32, depth: f32, normal: vec3<f32>, albedo: vec3<f32>) -> Texel {
    let n = map.resolution;
    let x = f32(i % n);
    let y = f32(i / n);
    let inverse = 1.0 / f32(n);
    let step_x = 2.0 * map.half_width * inverse;
    let step_y = 2.0 * map.half_height * inverse;
    // Upper left corner and centre on the image plane.
    let left = (2.0 * x * inverse - 1.0) * map.half_width;
    let top = (1.0 - 2.0 * y * inverse) * map.half_height;
    let cx = left + 0.5 * step_x;
    let cy = top - 0.5 * step_y;

    var incident: vec3<f32>;
    var across: f32;
    var cos_theta: f32;
    if map.orthographic == 1u {
        across = step_x * step_y;
        incident = map.power * across;
        cos_theta = -dot(normal, map.forward);
    } else {
        let solid_angle = texel_solid_angle(left, top, step_x, step_y);
        // Distance per unit of view depth, and the unit direction of the texel's centre.
        let slant = sqrt(1.0 + cx * cx + cy * cy);
        let w = (map.forward + map.right * cx + map.up * cy) * (1.0 / slant);
        let d = depth * slant;
        let s = d * map.inverse_range;
        let window = clamp(1.0 - s * s * s * s, 0.0, 1.0);
        let a = clamp((dot(map.axis, w) - map.cos_outer) * map.spot_scale, 0.0, 1.0);
        incident = map.power * (a * a * window * solid_angle);
        across = solid_angle * d * d;
        cos_theta = -dot(normal, w);
    }
    let area = across / max(cos_theta, MIN_FOOTPRINT_COSINE);
    return Texel(incident, 0.0, incident * albedo, area);
}

/// Exact solid angle of the rectangle [left, left + step_x] × [top − step_y, top] in the plane at distance 1.
fn texel_solid_angle(left: f32, top: f32, step_x: f32, step_y: f32) -> f32 {
    let x0 = left;
    let x1 = left + step_x;
    let y0 = top - step_y;
    let y1 = top;
    let twice_area = step_x * step_y;
    let l00 = sqrt(1.0 + x0 * x0 + y0 * y0);
    let l10 = sqrt(1.0 + x1 * x1 + y0 * y0);
    let l01 = sqrt(1.0 + x0 * x0 + y1 * y1);
    let l11 = sqrt(1.0 + x1 * x1 + y1 * y1);
    let d00_10 = 1.0 + x0 * x1 + y0 * y0;
    let d10_11 = 1.0 + x1 * x1 + y0 * y1;
    let d11_01 = 1.0 + x0 * x1 + y1 * y1;
    let d01_00 = 1.0 + x0 * x0 + y0 * y1;
    let d00_11 = 1.0 + x0 * x1 + y0 * y1;
    let lower = l00 * l10 * l11 + d00_10 * l11 + d10_11 * l00 + d00_11 * l10;
    let upper = l00 * l11 * l01 + d00_11 * l01 + d11_01 * l00 + d01_00 * l11;
    return 2.0 * (arctangent(twice_area, lower) + arctangent(twice_area, upper));
}

/// atan2(y, x) for y ≥ 0, to 1e-6; WGSL's own promises 4096 ulp.
fn arctangent(y: f32, x: f32) -> f32 {
    let length = sqrt(x * x + y * y);
    var half: f32;
    if x >= 0.0 {
        half = y / max(x + length, MIN_POSITIVE);
    } else {
        half = (length - x) / y;
    }
    let quarter = half / (1.0 + sqrt(1.0 + half * half));
    let t = quarter / (1.0 + sqrt(1.0 + quarter * quarter));
    let s = t * t;
    let series = 1.0
        + s * (-1.0 / 3.0
            + s * (0.2 + s * (-1.0 / 7.0 + s * (1.0 / 9.0 + s * (-1.0 / 11.0 + s * (1.0 / 13.0))))));
    return 8.0 * t * series;
}
