// mapping: area-preserving mappings of the unit square, and their densities.
// Twin: crates/sampling/src/mapping.rs.
// Shirley & Chiu 1997 (concentric disc), Heitz 2019 (triangle).

const MAPPING_INV_PI: f32 = 0.31830988618;
const MAPPING_TAU: f32 = 6.28318530718;
const MAPPING_EPSILON: f32 = 0x1p-23;

/// A point of the concentric disc: unit vector and signed radius.
fn mapping_disc_polar(u: vec2<f32>) -> vec3<f32> {
    let a = 2.0 * u - 1.0;
    let x_leads = abs(a.x) > abs(a.y);
    let r = select(a.y, a.x, x_leads);
    let other = select(a.x, a.y, x_leads);
    // Only the centre has r = 0; any direction serves there.
    let t = select(other / select(r, 1.0, r == 0.0), 0.0, r == 0.0);
    let t2 = t * t;
    let sine = t * (0.7853981852531433 + t2 * (-0.080745436 + t2 * (0.0024900069 + t2 * -3.595429e-5)));
    let cosine = 1.0 + t2 * (-0.30842513 + t2 * (0.015854325 + t2 * (-3.259386e-4 + t2 * 3.5297971e-6)));
    return vec3(select(vec2(sine, cosine), vec2(cosine, sine), x_leads), r);
}

/// 1 − r² without cancellation, never 0.
fn mapping_one_minus_square(r: f32) -> f32 {
    return max((1.0 - r) * (1.0 + r), MAPPING_EPSILON);
}

/// A point of the unit disc; density 1/π.
fn disc_concentric(u: vec2<f32>) -> vec2<f32> {
    let p = mapping_disc_polar(u);
    return p.z * p.xy;
}

/// Barycentrics of a point of a triangle; density 2 per barycentric area.
fn triangle_uniform(u: vec2<f32>) -> vec2<f32> {
    if u.y > u.x {
        let x = 0.5 * u.x;
        return vec2(x, u.y - x);
    }
    let y = 0.5 * u.y;
    return vec2(u.x - y, y);
}

/// A direction of the upper hemisphere, in proportion to its cosine.
fn hemisphere_cosine(u: vec2<f32>) -> vec3<f32> {
    let p = mapping_disc_polar(u);
    return vec3(p.z * p.xy, sqrt(mapping_one_minus_square(p.z)));
}

fn hemisphere_cosine_pdf(d: vec3<f32>) -> f32 {
    return max(d.z, 0.0) * MAPPING_INV_PI;
}

/// A direction of the upper hemisphere; density 1/2π.
fn hemisphere_uniform(u: vec2<f32>) -> vec3<f32> {
    return cone_uniform(u, 1.0);
}

/// A direction; density 1/4π.
fn sphere_uniform(u: vec2<f32>) -> vec3<f32> {
    let p = mapping_disc_polar(u);
    let c2 = mapping_one_minus_square(p.z);
    return vec3(2.0 * p.z * sqrt(c2) * p.xy, 2.0 * c2 - 1.0);
}

/// A direction of the cone about z that is given by 1 − cos of its half angle.
fn cone_uniform(u: vec2<f32>, one_minus_cos: f32) -> vec3<f32> {
    let p = mapping_disc_polar(u);
    let h = p.z * p.z * one_minus_cos;
    return vec3(p.z * sqrt(one_minus_cos * max(2.0 - h, 0.0)) * p.xy, 1.0 - h);
}

fn cone_uniform_pdf(d: vec3<f32>, one_minus_cos: f32) -> f32 {
    return select(0.0, 1.0 / (MAPPING_TAU * one_minus_cos), d.z >= 1.0 - one_minus_cos);
}

/// A direction of the upper hemisphere, in proportion to the power n of its cosine.
fn phong_lobe(u: vec2<f32>, n: f32) -> vec3<f32> {
    let p = mapping_disc_polar(u);
    let cosine = pow(mapping_one_minus_square(p.z), 1.0 / (n + 1.0));
    return vec3(sign(p.z) * sqrt(max((1.0 - cosine) * (1.0 + cosine), 0.0)) * p.xy, cosine);
}

fn phong_lobe_pdf(d: vec3<f32>, n: f32) -> f32 {
    return select(0.0, (n + 1.0) / MAPPING_TAU * pow(max(d.z, MAPPING_EPSILON), n), d.z > 0.0);
}
