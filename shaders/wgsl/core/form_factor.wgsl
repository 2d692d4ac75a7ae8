// Form factors from a differential receiver to a small patch; 0 where the two do not face each other.
// Twin: indirect_core::form_factor. Source: Wallace, Elmquist & Haines 1989; docs/errata.md.

const FORM_FACTOR_PI: f32 = 3.14159265358979;
const FORM_FACTOR_MIN_D2: f32 = 1.1754944e-38;

/// Receiver cosine, patch cosine and squared distance; cosines 0 where receiver and patch do not face each other.
fn form_factor_cosines(
    receiver: vec3<f32>, n_receiver: vec3<f32>, centre: vec3<f32>, n_patch: vec3<f32>,
) -> vec3<f32> {
    let v = centre - receiver;
    let d2 = dot(v, v);
    if !(d2 >= FORM_FACTOR_MIN_D2) {
        return vec3<f32>(0.0, 0.0, 1.0);
    }
    let w = v * (1.0 / sqrt(d2));
    let cos_receiver = dot(n_receiver, w);
    let cos_patch = -dot(n_patch, w);
    if !(cos_receiver > 0.0 && cos_patch > 0.0) {
        return vec3<f32>(0.0, 0.0, 1.0);
    }
    return vec3<f32>(min(cos_receiver, 1.0), min(cos_patch, 1.0), d2);
}

/// A cosθi cosθj / (π d²): the virtual point light. Unbounded as the distance goes to 0.
fn point_to_point(
    receiver: vec3<f32>, n_receiver: vec3<f32>, centre: vec3<f32>, n_patch: vec3<f32>, area: f32,
) -> f32 {
    let c = form_factor_cosines(receiver, n_receiver, centre, n_patch);
    return c.x * c.y * area * (1.0 / FORM_FACTOR_PI) / c.z;
}

/// A cosθi cosθj / (π d² + A): bounded by 1, exact for a disc on the receiver's axis that faces it.
fn point_to_disc(
    receiver: vec3<f32>, n_receiver: vec3<f32>, centre: vec3<f32>, n_patch: vec3<f32>, area: f32,
) -> f32 {
    let c = form_factor_cosines(receiver, n_receiver, centre, n_patch);
    return c.x * c.y * area / (FORM_FACTOR_PI * c.z + area);
}

/// θ / sin θ for x = cos θ in [0, 1].
fn angle_over_sine(x: f32) -> f32 {
    var p = -0.02708122;
    p = p * x + 0.13752762;
    p = p * x + -0.32613634;
    p = p * x + 0.5105887;
    p = p * x + -0.64917785;
    p = p * x + 0.7833927;
    p = p * x + -0.99990976;
    return p * x + 1.5707956;
}

/// Lambert's edge term: the angle from `a` to `b` times the cosine between `n` and the normal of their plane.
fn edge_term(n: vec3<f32>, a: vec3<f32>, b: vec3<f32>) -> f32 {
    let c = cross(a, b);
    let lengths = sqrt(dot(a, a) * dot(b, b));
    let sine = length(c);
    if sine <= FORM_FACTOR_MIN_D2 {
        return 0.0;
    }
    let x = dot(a, b) / lengths;
    if x >= 0.0 {
        return angle_over_sine(min(x, 1.0)) / lengths * dot(n, c);
    }
    return (FORM_FACTOR_PI / sine - angle_over_sine(-max(x, -1.0)) / lengths) * dot(n, c);
}

/// A parallelogram `centre ± s ± t`, clipped at the receiver's horizon; it emits to the side `s × t` points to.
fn point_to_parallelogram(
    receiver: vec3<f32>, n_receiver: vec3<f32>, centre: vec3<f32>, s: vec3<f32>, t: vec3<f32>,
) -> f32 {
    let v = centre - receiver;
    if dot(cross(s, t), v) >= 0.0 {
        return 0.0;
    }
    var corners = array<vec3<f32>, 4>(v - s - t, v + s - t, v + s + t, v - s + t);
    var sum = 0.0;
    var entry = vec3<f32>(0.0);
    var exit = vec3<f32>(0.0);
    var a = corners[3];
    var ha = dot(n_receiver, a);
    for (var i = 0u; i < 4u; i += 1u) {
        let b = corners[i];
        let hb = dot(n_receiver, b);
        if ha > 0.0 || hb > 0.0 {
            var p = a;
            var q = b;
            if ha <= 0.0 {
                p = a + (b - a) * (ha / (ha - hb));
                entry = p;
            } else if hb <= 0.0 {
                q = a + (b - a) * (ha / (ha - hb));
                exit = q;
            }
            sum += edge_term(n_receiver, p, q);
        }
        a = b;
        ha = hb;
    }
    sum += edge_term(n_receiver, exit, entry);
    return clamp(sum * (-0.5 / FORM_FACTOR_PI), 0.0, 1.0);
}

/// Distance, in units of the patch's side, from which `point_to_patch` takes the patch for a point.
const PATCH_FAR: f32 = 3.0;

/// A square patch of which only centre, normal and area are known; its sides follow Duff et al. 2017's basis.
fn point_to_patch(
    receiver: vec3<f32>, n_receiver: vec3<f32>, patch_centre: vec3<f32>, n_patch: vec3<f32>, area: f32,
) -> f32 {
    let v = patch_centre - receiver;
    if dot(v, v) >= PATCH_FAR * PATCH_FAR * area {
        return point_to_point(receiver, n_receiver, patch_centre, n_patch, area);
    }
    let sign = select(-1.0, 1.0, n_patch.z >= 0.0);
    let a = -1.0 / (sign + n_patch.z);
    let b = n_patch.x * n_patch.y * a;
    let s = vec3<f32>(1.0 + sign * n_patch.x * n_patch.x * a, sign * b, -sign * n_patch.x);
    let t = vec3<f32>(b, sign + n_patch.y * n_patch.y * a, -n_patch.y);
    let half_side = 0.5 * sqrt(area);
    return point_to_parallelogram(receiver, n_receiver, patch_centre, s * half_side, t * half_side);
}

/// The part of the kernel k (1/m²) that point lights carry where they are bounded: k/(1 + A k).
fn bounded(kernel: f32, area: f32) -> f32 {
    return kernel / (1.0 + area * kernel);
}

/// The share of the kernel that `bounded` leaves to paths; 1 for one too large to be a number.
fn unbounded_share(kernel: f32, area: f32) -> f32 {
    let carried = area * max(kernel, 0.0);
    return select(1.0, carried / (1.0 + carried), carried < 0x1.fffffep+127f);
}
