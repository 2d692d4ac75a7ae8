// bilateral: joint bilateral interpolation of an image of reduced resolution. Needs filter/reduced.wgsl.
// Twin: crates/filter/src/cpu/bilateral.rs, which defines the weights. Source: Kopf et al. 2007.
// The including module declares the G-buffer `positions` and `normals` per pixel, and the smaller image `low`.

/// The weighted sum of the four texels of `low` nearest to a pixel, and the sum of their weights.
fn bilateral(reduced: Reduced, pixel: u32) -> vec4<f32> {
    let p = positions[pixel].xyz;
    let n = normals[pixel].xyz;
    let step = reduced.step;
    let coordinates = vec2(pixel % reduced.size.x, pixel / reduced.size.x);
    let place = max((vec2<f32>(coordinates) - f32(step / 2u)) / f32(step), vec2(0.0));
    let lowest = floor(place);
    let t = place - lowest;
    var sum = vec3(0.0);
    var total = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let side = vec2(corner & 1u, corner >> 1u);
        let texel = min(vec2<u32>(lowest) + side, reduced.small - 1u);
        let k = reduced_pixel(reduced, texel);
        let d = positions[k].xyz - p;
        // How far it is out of the plane, as a share of its distance.
        let distance = sqrt(dot(d, d));
        let out = select(0.0, abs(dot(n, d)) / distance, distance > 0.0);
        let alike = max(dot(n, normals[k].xyz), 0.0);
        let alike2 = alike * alike;
        let part = select(1.0 - t, t, side == vec2(1u));
        let weight = part.x * part.y * max(1.0 - 4.0 * out, 0.0) * (alike2 * alike2);
        sum += low[texel.y * reduced.small.x + texel.x].xyz * weight;
        total += weight;
    }
    return vec4(sum, total);
}
