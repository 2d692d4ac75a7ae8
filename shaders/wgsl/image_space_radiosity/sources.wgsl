// sources: what the coarsest lights tell before any is gathered: how bright it is about there, and where light bends.
// Twin: crates/image-space-radiosity/src/cpu/sources.rs.

/// The coarsest lights; one without flux where there are none.
@group(0) @binding(5) var<storage, read> sources: array<Patch>;
/// The reference irradiance.
@group(0) @binding(6) var<storage, read_write> reference: array<f32>;
@group(0) @binding(7) var<uniform> lengths: Lengths;

const SOURCES_PI: f32 = 3.14159265358979;

/// Irradiance that the lights would cast at a point if all faced it, and what it bends there across the distance 1.
fn sources_at(position: vec3<f32>) -> vec2<f32> {
    var sum = vec2(0.0);
    for (var i = 0u; i < arrayLength(&sources); i++) {
        let w = weight(sources[i].flux);
        if w > 0.0 {
            let v = sources[i].position - position;
            let radius = sources[i].radius;
            let d2 = dot(v, v) + radius * radius;
            let e = w / (3.0 * SOURCES_PI * d2);
            sum += vec2(e, e / d2);
        }
    }
    return sum;
}

/// The mean over what the camera sees; one thread.
@compute @workgroup_size(1)
fn reference_irradiance() {
    var sum = 0.0;
    var pixels = 0u;
    for (var i = lengths.first_receiver; i < lengths.first_receiver + lengths.receivers; i++) {
        let seen = block(i, lengths.pixels);
        if seen.pixels > 0u {
            sum += sources_at(seen.position).x * f32(seen.pixels);
            pixels += seen.pixels;
        }
    }
    reference[0] = select(0.0, sum / f32(pixels), pixels > 0u);
}
