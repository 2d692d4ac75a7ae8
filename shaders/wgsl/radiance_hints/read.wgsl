// read: the irradiance that the field casts on a point.
// Twin: irradiance in crates/radiance-hints/src/cpu/reconstruct.rs, which holds the equation.
// Papaioannou 2011, §5; orthonormal basis: Duff et al. 2017, JCGT 6(1).

const RING_SINE: f32 = 0.98480775;
const RING_COSINE: f32 = 0.17364818;
const TURN_SINE: f32 = 0.8660254;
const TURN_COSINE: f32 = -0.5;

/// Irradiance on the point p with the unit normal n.
fn field_irradiance(p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let diagonal = field_diagonal(p);
    let lobe = cosine_lobe(n);
    let plane = Plane(p, settings.read_plane, n);
    let base = p + n * (settings.read_lift * diagonal);
    let radius = settings.read_radius * diagonal;
    // Two unit vectors perpendicular to n and to each other.
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let c = n.x * n.y * a;
    let t = vec3(1.0 + sign * n.x * n.x * a, sign * c, -sign * n.x);
    let b = vec3(c, sign + n.y * n.y * a, -n.y);
    let up = n * RING_COSINE;
    var sum = field_weigh(base + n * radius, plane, lobe);
    sum += field_weigh(base + (t * RING_SINE + up) * radius, plane, lobe);
    let u = t * TURN_COSINE;
    let v = b * TURN_SINE;
    sum += field_weigh(base + ((u + v) * RING_SINE + up) * radius, plane, lobe);
    sum += field_weigh(base + ((u - v) * RING_SINE + up) * radius, plane, lobe);
    // A truncated series may fall below 0 where little light arrives.
    return max(sum * 0.25, vec3(0.0));
}
