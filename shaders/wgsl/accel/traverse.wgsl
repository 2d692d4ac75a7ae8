// Closest-hit and any-hit queries by traversal of a binary tree. Needs accel/layout.wgsl, accel/opaque.wgsl or accel/masked.wgsl,
// and two variables at bindings of the module's choice:
//     var<storage, read> accel_nodes: array<AccelNode>;
//     var<storage, read> accel_triangles: array<AccelTriangle>;
// Twin: crates/accel/src/traverse.rs, which says why no ray leaks. After Woop, Benthin & Wald 2013, JCGT 2(1).

/// Share of the scene's extent by which boxes are moved towards the ray: 32·2⁻²³.
const ACCEL_SLAB_SLACK: f32 = 3.814697265625e-6;
/// Bound of an edge function's error: 16·2⁻²³.
const ACCEL_EDGE_SLACK: f32 = 1.9073486328125e-6;
/// Bound of a sheared vertex's error: 4·2⁻²³.
const ACCEL_POINT_SLACK: f32 = 4.76837158203125e-7;
/// Directions count whose longest component lies in this range, 2⁻⁶⁴ to 2⁶⁴.
const ACCEL_SHORTEST: f32 = 5.421010862427522e-20;
const ACCEL_LONGEST: f32 = 1.8446744073709552e19;
/// Shorter components than this share of the longest, 2⁻³⁰, are taken as that long where boxes are tested.
const ACCEL_LEAST_SLOPE: f32 = 9.313225746154785e-10;

/// A ray, prepared once for all boxes and triangles.
struct AccelPrepared {
    valid: bool,
    /// 0, 1, 2: the axis along which the direction is longest.
    axis: u32,
    /// Which components of the direction are negative.
    backward: vec3<bool>,
    origin: vec3<f32>,
    /// Origin of the near and of the far slab distances.
    near_origin: vec3<f32>,
    far_origin: vec3<f32>,
    inverse: vec3<f32>,
    /// Slopes along the first two turned axes, and the inverse of the third component.
    shear: vec3<f32>,
    /// The larger slope.
    lean: f32,
    /// The largest t that counts.
    limit: f32,
}

/// By its bits: WGSL may assume that NaN and infinity do not occur.
fn accel_is_finite(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u)) != vec3<u32>(0x7f800000u));
}

/// The axes in cyclic order, `axis` last.
fn accel_turn(v: vec3<f32>, axis: u32) -> vec3<f32> {
    return select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn accel_prepare(origin: vec3<f32>, direction: vec3<f32>, t_max: f32) -> AccelPrepared {
    var ray: AccelPrepared;
    // Positive, infinity included: the number before it is the largest t that counts.
    let last = bitcast<u32>(t_max) - 1u;
    let size = abs(direction);
    let axis = select(select(2u, 1u, size.y > size.z), 0u, size.x > size.y && size.x > size.z);
    let turned = accel_turn(direction, axis);
    let longest = abs(turned.z);
    ray.valid = last < 0x7f800000u && accel_is_finite(origin) && accel_is_finite(direction)
        && longest >= ACCEL_SHORTEST && longest <= ACCEL_LONGEST;
    if !ray.valid {
        return ray;
    }
    ray.limit = bitcast<f32>(last);
    ray.axis = axis;
    ray.origin = origin;
    let inverse = 1.0 / turned.z;
    ray.shear = vec3<f32>(turned.xy * inverse, inverse);
    ray.lean = max(abs(ray.shear.x), abs(ray.shear.y));
    // No component is 0: no distance to a slab is 0/0.
    let least = vec3<f32>(longest * ACCEL_LEAST_SLOPE);
    ray.backward = direction < vec3<f32>(0.0);
    ray.inverse = 1.0 / select(direction, select(least, -least, ray.backward), size < least);
    let root = accel_nodes[0];
    let above = max(root.upper_0, root.upper_1) - origin;
    let below = origin - min(root.lower_0, root.lower_1);
    let farther = max(above, below);
    let reach = max(max(farther.x, farther.y), max(farther.z, 0.0));
    let margin = reach * ACCEL_SLAB_SLACK;
    ray.near_origin = select(origin + margin, origin - margin, ray.backward);
    ray.far_origin = select(origin - margin, origin + margin, ray.backward);
    return ray;
}

/// Parameters at which the ray enters and leaves a box within [0, limit]; it misses the box where the first is the larger.
fn accel_enter(ray: AccelPrepared, lower: vec3<f32>, upper: vec3<f32>, limit: f32) -> vec2<f32> {
    let near = (select(lower, upper, ray.backward) - ray.near_origin) * ray.inverse;
    let far = (select(upper, lower, ray.backward) - ray.far_origin) * ray.inverse;
    return vec2<f32>(max(max(near.x, near.y), max(near.z, 0.0)), min(min(far.x, far.y), min(far.z, limit)));
}

/// A vertex, moved and sheared so that the ray is the z axis.
fn accel_shear(ray: AccelPrepared, vertex: vec3<f32>) -> vec3<f32> {
    let p = accel_turn(vertex - ray.origin, ray.axis);
    return vec3<f32>(p.x - ray.shear.x * p.z, p.y - ray.shear.y * p.z, p.z);
}

/// The edge function from `p` to `q` at the ray.
fn accel_edge(p: vec3<f32>, q: vec3<f32>) -> f32 {
    return q.x * p.y - q.y * p.x;
}

/// Where the ray meets a triangle with 0 ≤ t ≤ limit; ACCEL_NONE where it does not.
fn accel_meet(ray: AccelPrepared, triangle: AccelTriangle, limit: f32) -> AccelHit {
    let none = AccelHit(0.0, 0.0, 0.0, ACCEL_NONE);
    let p = accel_shear(ray, triangle.a);
    let q = accel_shear(ray, triangle.b);
    let r = accel_shear(ray, triangle.c);
    let lower = min(p.xy, min(q.xy, r.xy));
    let upper = max(p.xy, max(q.xy, r.xy));
    let width = max(max(upper.x, -lower.x), max(upper.y, -lower.y));
    let depth = max(abs(p.z), max(abs(q.z), abs(r.z)));
    let spread = ray.lean * depth + width;
    // Outside of the triangle's rectangle: what lies on the line of an edge, but beyond its ends, is not met.
    let point = ACCEL_POINT_SLACK * spread;
    if (triangle.flags & ACCEL_VOID) != 0u || any(lower > vec2<f32>(point)) || any(upper < vec2<f32>(-point)) {
        return none;
    }
    let a = accel_edge(q, r);
    let b = accel_edge(r, p);
    let c = accel_edge(p, q);
    let slack = ACCEL_EDGE_SLACK * width * spread;
    if min(a, min(b, c)) < -slack && max(a, max(b, c)) > slack {
        return none;
    }
    // Weights of the nearest point that surely belongs to the triangle.
    let sign = select(1.0, -1.0, a + b + c < 0.0);
    let w = max(sign * vec3<f32>(a, b, c), vec3<f32>(0.0));
    let total = w.x + w.y + w.z;
    if !(total > 0.0) {
        return none;
    }
    let scale = 1.0 / total;
    let u = w.y * scale;
    let v = w.z * scale;
    let t = (p.z + (u * (q.z - p.z) + v * (r.z - p.z))) * ray.shear.z;
    if !(t >= 0.0 && t <= limit) {
        return none;
    }
    return AccelHit(t, u, v, triangle.index);
}

/// The nearest hit with 0 ≤ t < t_max; of equally near ones that of the triangle with the smallest index. ACCEL_NONE for a direction
/// of zero, a NaN, or infinity anywhere but in `t_max`.
fn accel_closest_hit(origin: vec3<f32>, direction: vec3<f32>, t_max: f32) -> AccelHit {
    let none = AccelHit(0.0, 0.0, 0.0, ACCEL_NONE);
    let ray = accel_prepare(origin, direction, t_max);
    if !ray.valid {
        return none;
    }
    var best = AccelHit(ray.limit, 0.0, 0.0, ACCEL_NONE);
    var stack: array<u32, ACCEL_STACK>;
    var height = 0u;
    var link = 0u;
    // One loop, a box pair or a triangle a round: its rounds are those of the slowest ray of a group, and can be counted.
    for (var round = 0u; round < ACCEL_ROUNDS; round++) {
        var next = 0u;
        if link >= ACCEL_LEAF {
            let triangle = accel_triangles[link - ACCEL_LEAF];
            let hit = accel_meet(ray, triangle, best.t);
            let nearer = hit.triangle != ACCEL_NONE && (hit.t < best.t || hit.triangle < best.triangle);
            if nearer && ((triangle.flags & ACCEL_MASKED) == 0u || accel_is_solid(hit.triangle, hit.u, hit.v)) {
                best = hit;
            }
            next = select(link + 1u, 0u, (triangle.flags & ACCEL_LAST) != 0u);
        } else {
            let node = accel_nodes[link];
            let first = accel_enter(ray, node.lower_0, node.upper_0, best.t);
            let second = accel_enter(ray, node.lower_1, node.upper_1, best.t);
            let child_0 = select(0u, node.child_0, first.x <= first.y);
            let child_1 = select(0u, node.child_1, second.x <= second.y);
            next = select(child_0, child_1, child_0 == 0u || (child_1 != 0u && second.x < first.x));
            if child_0 != 0u && child_1 != 0u {
                // The farther one waits.
                stack[height] = child_0 + child_1 - next;
                height += 1u;
            }
        }
        if next == 0u {
            if height == 0u {
                if best.triangle == ACCEL_NONE {
                    return none;
                }
                return best;
            }
            height -= 1u;
            next = stack[height];
        }
        link = next;
    }
    best.triangle = ACCEL_UNFINISHED;
    return best;
}

/// 1 where there is a hit with 0 ≤ t < t_max, 0 where not, 2 where that is not known (ACCEL_UNFINISHED).
fn accel_occlusion(origin: vec3<f32>, direction: vec3<f32>, t_max: f32) -> u32 {
    let ray = accel_prepare(origin, direction, t_max);
    if !ray.valid {
        return 0u;
    }
    var stack: array<u32, ACCEL_STACK>;
    var height = 0u;
    var link = 0u;
    for (var round = 0u; round < ACCEL_ROUNDS; round++) {
        var next = 0u;
        if link >= ACCEL_LEAF {
            let triangle = accel_triangles[link - ACCEL_LEAF];
            let hit = accel_meet(ray, triangle, ray.limit);
            if hit.triangle != ACCEL_NONE
                && ((triangle.flags & ACCEL_MASKED) == 0u || accel_is_solid(hit.triangle, hit.u, hit.v)) {
                return 1u;
            }
            next = select(link + 1u, 0u, (triangle.flags & ACCEL_LAST) != 0u);
        } else {
            let node = accel_nodes[link];
            let first = accel_enter(ray, node.lower_0, node.upper_0, ray.limit);
            let second = accel_enter(ray, node.lower_1, node.upper_1, ray.limit);
            let child_0 = select(0u, node.child_0, first.x <= first.y);
            let child_1 = select(0u, node.child_1, second.x <= second.y);
            next = select(child_0, child_1, child_0 == 0u);
            if child_0 != 0u && child_1 != 0u {
                stack[height] = child_1;
                height += 1u;
            }
        }
        if next == 0u {
            if height == 0u {
                return 0u;
            }
            height -= 1u;
            next = stack[height];
        }
        link = next;
    }
    return 2u;
}

/// Whether there is any hit with 0 ≤ t < t_max; true where that is not known, so that nothing shines through.
fn accel_any_hit(origin: vec3<f32>, direction: vec3<f32>, t_max: f32) -> bool {
    return accel_occlusion(origin, direction, t_max) != 0u;
}
