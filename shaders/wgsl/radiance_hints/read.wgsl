// read: the irradiance that the field casts on a point.
// Twin: irradiance in crates/radiance-hints/src/cpu/reconstruct.rs, which holds the equation.
// Papaioannou 2011, §5; orthonormal basis: Duff et al. 2017, JCGT 6(1).

const RING_SINE: f32 = 0.98480775;
const RING_COSINE: f32 = 0.17364818;
const TURN_SINE: f32 = 0.8660254;
const TURN_COSINE: f32 = -0.5;
const NEAR_RADIUS: f32 = 0.3;
const NEAR_LIFT: f32 = 0.08;
const FAR_LIFT: f32 = 1.1;
const MOST_GAIN: f32 = 0.2;

/// Irradiance on the point p with the unit normal n.
fn field_irradiance(p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let diagonal = field_diagonal(p);
    let lobe = cosine_lobe(n);
    // Two unit vectors perpendicular to n and to each other.
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let c = n.x * n.y * a;
    let t = vec3(1.0 + sign * n.x * n.x * a, sign * c, -sign * n.x);
    let b = vec3(c, sign + n.y * n.y * a, -n.y);
    // A truncated series may fall below 0 where little light arrives.
    if settings.as_printed == 1u {
        let plane = Plane(vec3(0.0), 0.0, vec3(0.0));
        let base = p + n * (0.5 * diagonal);
        var ring = array<vec3<f32>, 3>(
            t, t * TURN_COSINE + b * TURN_SINE, t * TURN_COSINE - b * TURN_SINE,
        );
        var sum = field_weigh(base + n * diagonal, plane, lobe).xyz;
        for (var i = 0u; i < 3u; i++) {
            sum += field_weigh(base + (ring[i] * RING_SINE + n * RING_COSINE) * diagonal, plane, lobe).xyz;
        }
        return max(sum * 0.25, vec3(0.0));
    }
    let plane = Plane(p, 1.0, n);
    let base = p + n * (NEAR_LIFT * diagonal);
    let radius = NEAR_RADIUS * diagonal;
    var near = field_weigh(base + t * radius, plane, lobe);
    near += field_weigh(base + b * radius, plane, lobe);
    near += field_weigh(base - t * radius, plane, lobe);
    near += field_weigh(base - b * radius, plane, lobe);
    near *= 0.25;
    let far = field_weigh(p + n * (FAR_LIFT * diagonal), plane, lobe);
    let gap = max(far.w - near.w, near.w * (1.0 / MOST_GAIN));
    var gain = 0.0;
    if near.w > 0.0 {
        gain = near.w / gap;
    }
    return max(near.xyz + (near.xyz - far.xyz) * gain, vec3(0.0));
}
