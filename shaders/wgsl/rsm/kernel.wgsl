// The light of one VPL at one receiver. Twin: crates/rsm/src/cpu/kernel.rs.
// Disc form: Wallace, Elmquist & Haines 1989; Nichols, Shopf & Wyman 2009, eq. 1.

const PI: f32 = 3.14159265358979;
const LEAST_DENOMINATOR: f32 = 1e-37;

/// cosθ_i cosθ_j / (π d² + A) for the vector v from receiver to patch.
fn form_factor_per_area(v: vec3<f32>, n_receiver: vec3<f32>, n_patch: vec3<f32>, area: f32) -> f32 {
    let d2 = dot(v, v);
    let ci = dot(n_receiver, v);
    let cj = -dot(n_patch, v);
    let denominator = d2 * (PI * d2 + area);
    return max(ci, 0.0) * max(cj, 0.0) / max(denominator, LEAST_DENOMINATOR);
}
