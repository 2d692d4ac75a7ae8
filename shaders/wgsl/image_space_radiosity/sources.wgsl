// sources: what the coarsest lights tell before any is gathered: how bright it is about there, and where light bends.
// Twin: crates/image-space-radiosity/src/cpu/sources.rs.

/// Where the coarsest lights, and the blocks that see them, lie.
struct Sources {
    maps: u32,
    /// Patches of each map, the first of the coarse level and their number.
    per_map: u32,
    first: u32,
    count: u32,
    /// The first block and their number.
    first_receiver: u32,
    receivers: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(2) var<storage, read> blocks: array<Block>;
@group(0) @binding(5) var<uniform> sources: Sources;
@group(0) @binding(6) var<storage, read> patches: array<Patch>;
/// The reference irradiance.
@group(0) @binding(7) var<storage, read_write> reference: array<f32>;

const SOURCES_PI: f32 = 3.14159265358979;

/// Irradiance that the lights would cast at a point if all faced it, and what it bends there across the distance 1.
fn sources_at(position: vec3<f32>) -> vec2<f32> {
    var sum = vec2(0.0);
    for (var map = 0u; map < sources.maps; map++) {
        let first = map * sources.per_map + sources.first;
        for (var i = first; i < first + sources.count; i++) {
            let w = weight(patches[i].flux);
            if w > 0.0 {
                let v = patches[i].position - position;
                let radius = patches[i].radius;
                let d2 = dot(v, v) + radius * radius;
                let e = w / (3.0 * SOURCES_PI * d2);
                sum += vec2(e, e / d2);
            }
        }
    }
    return sum;
}

/// The mean over what the camera sees; one thread.
@compute @workgroup_size(1)
fn reference_irradiance() {
    var sum = 0.0;
    var pixels = 0u;
    for (var i = sources.first_receiver; i < sources.first_receiver + sources.receivers; i++) {
        if blocks[i].pixels > 0u {
            sum += sources_at(blocks[i].position).x * f32(blocks[i].pixels);
            pixels += blocks[i].pixels;
        }
    }
    reference[0] = select(0.0, sum / f32(pixels), pixels > 0u);
}
