// Which emissive triangle, and where on it. Needs sampling/mapping.wgsl, photons/sources.wgsl, and a variable at a binding of the module's
// choice:
//     var<storage, read> emitters: array<Emitter>;
// Twin: crates/photon-tracing/src/cpu/draw.rs.

/// The largest f32 below 1.
const PHOTONS_BELOW_ONE: f32 = 0.99999994;

/// One of several things, and where in its share of [0, 1) a number lies, [0, 1).
struct Pick {
    index: u32,
    x: f32,
}

/// The first of `count` emitters, at least one, whose share reaches x.
fn emitter_pick(count: u32, x: f32) -> Pick {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if emitters[middle].upto <= x {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = min(low, count - 1u);
    var before = 0.0;
    if i > 0u {
        before = emitters[i - 1u].upto;
    }
    return Pick(i, clamp((x - before) / max(emitters[i].upto - before, 1.1754944e-38), 0.0, PHOTONS_BELOW_ONE));
}

struct EmitterPoint {
    position: vec3<f32>,
    normal: vec3<f32>,
}

/// A point of an emitter and the normal of a side that emits there; u.x chooses the side, too.
fn emitter_point(e: Emitter, u: vec2<f32>) -> EmitterPoint {
    var x = u.x;
    var turn = 1.0;
    if e.two_sided == 1u {
        x *= 2.0;
        if x >= 1.0 {
            x -= 1.0;
            turn = -1.0;
        }
    }
    let b = triangle_uniform(vec2(x, u.y));
    let normal = normalize(cross(e.edge_u, e.edge_v)) * turn;
    return EmitterPoint(e.corner + e.edge_u * b.x + e.edge_v * b.y, normal);
}
