// The area that a virtual light of a later bounce stands for. The module declares `settings`, `range` and `vpls`.
// Twin: footprint in crates/instant-radiosity/src/cpu/bounce.rs.

/// One bounce: which virtual lights send rays, and where those that the rays find go.
struct BounceRange {
    source_first: u32,
    target_first: u32,
    count: u32,
    point_first: u32,
}

/// Sources that a footprint asks.
const ASKED: u32 = 256u;

/// One over the density of all lights of the bounce there.
fn footprint(position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let step = (range.count + ASKED - 1u) / ASKED;
    var density = 0.0;
    for (var i = 0u; i < range.count; i += step) {
        let s = vpls[range.source_first + i];
        let v = s.position - position;
        let d2 = dot(v, v);
        if any(s.flux != vec3(0.0)) && d2 > 0.0 {
            let w = v * (1.0 / sqrt(d2));
            let cr = dot(normal, w);
            let cs = -dot(s.normal, w);
            if cr > 0.0 && cs > 0.0 {
                density += bounded(cr * cs * FRAC_1_PI / d2, s.area);
            }
        }
    }
    return 1.0 / max(density * f32(step), 1.0 / settings.area);
}
