// upsample: irradiance at every pixel from that at one of 2 × 2 or 4 × 4, by a joint bilateral filter.
// Twin: crates/radiance-hints/src/cpu/upsample.rs, which says what counts.
// Papaioannou 2011, §9.3; Kopf et al. 2007, "Joint Bilateral Upsampling".

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> hints: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<uniform> image: Target;
@group(0) @binding(6) var<storage, read> low: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> irradiance: array<vec4<f32>>;

const LEAST_WEIGHT: f32 = 0.05;

@compute @workgroup_size(64)
fn upsample(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < image.size.x * image.size.y {
        irradiance[i] = vec4(upsample_pixel(i), 0.0);
    }
}

fn upsample_pixel(i: u32) -> vec3<f32> {
    let p = positions[i].xyz;
    let n = normals[i].xyz;
    if all(n == vec3(0.0)) {
        return vec3(0.0);
    }
    let step = image.step;
    let pixel = vec2(i % image.size.x, i / image.size.x);
    let place = max((vec2<f32>(pixel) - f32(step / 2u)) / f32(step), vec2(0.0));
    let lowest = floor(place);
    let t = place - lowest;
    var sum = vec3(0.0);
    var total = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let side = vec2(corner & 1u, corner >> 1u);
        let texel = min(vec2<u32>(lowest) + side, image.small - 1u);
        let at = pixel_of(texel);
        let k = at.y * image.size.x + at.x;
        let d = positions[k].xyz - p;
        // How far it is out of the plane, as a share of its distance.
        let distance = sqrt(dot(d, d));
        let out = select(0.0, abs(dot(n, d)) / distance, distance > 0.0);
        let alike = max(dot(n, normals[k].xyz), 0.0);
        let alike2 = alike * alike;
        let part = select(1.0 - t, t, side == vec2(1u));
        let weight = part.x * part.y * max(1.0 - 4.0 * out, 0.0) * (alike2 * alike2);
        sum += low[texel.y * image.small.x + texel.x].xyz * weight;
        total += weight;
    }
    if total < LEAST_WEIGHT {
        return field_irradiance(p, n);
    }
    return sum * (1.0 / total);
}
