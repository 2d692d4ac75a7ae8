// depths: segments against depth images: where they cross a surface that a view sees.
// Twin: crates/radiance-hints/src/cpu/depths.rs. The including module declares `views` and `depths`.

const STEPS: u32 = 16u;
const REFINEMENTS: u32 = 5u;
/// Marks a point outside of a view's image.
const OUTSIDE: f32 = -1e38;

/// How far p lies behind what the view sees there; negative before it, OUTSIDE of the image.
fn behind(v: u32, p: vec3<f32>) -> f32 {
    let view = views[v];
    let size = view.size;
    let at = view_image_point(view, p);
    let texel = at.xy * vec2<f32>(size);
    if at.z <= 0.0 || !(texel.x >= 0.0 && texel.y >= 0.0 && texel.x < f32(size.x) && texel.y < f32(size.y)) {
        return OUTSIDE;
    }
    let seen = depths[view.first_texel + u32(texel.y) * size.x + u32(texel.x)];
    let depth = dot(view.forward, p - view.origin);
    return select(-depth, depth - seen, seen > 0.0);
}

/// The parameter, [0, 1], at which the segment from a to b crosses a surface that the view sees, searched from the step `first`
/// on; 1 where it does not.
fn crossing(v: u32, a: vec3<f32>, b: vec3<f32>, first: u32) -> f32 {
    let length = length(b - a);
    let step = 1.0 / f32(STEPS);
    var before = behind(v, a + (b - a) * (f32(first) * step));
    for (var i = first + 1u; i <= STEPS; i++) {
        let t = f32(i) * step;
        let now = behind(v, a + (b - a) * t);
        if before != OUTSIDE && now != OUTSIDE && (before < 0.0) != (now < 0.0) {
            // The segment changes sides here: bisect.
            var lo = t - step;
            var hi = t;
            var x = before;
            var y = now;
            for (var r = 0u; r < REFINEMENTS; r++) {
                let middle = 0.5 * (lo + hi);
                let m = behind(v, a + (b - a) * middle);
                if m == OUTSIDE {
                    break;
                }
                if (m < 0.0) == (x < 0.0) {
                    lo = middle;
                    x = m;
                } else {
                    hi = middle;
                    y = m;
                }
            }
            // On a surface the depth difference shrinks with the step; at a silhouette, where depth jumps, it does not.
            if abs(y - x) < 4.0 * (hi - lo) * length {
                return lo;
            }
        }
        before = now;
    }
    return 1.0;
}
