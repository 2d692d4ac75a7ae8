// Real spherical harmonics, l <= 1 and l <= 2: basis, value, irradiance, projection, zonal lobes.
// Twin: `sh_math::twins`, the same names and the same order of operations.
// Basis: orthonormal, no Condon-Shortley phase, index l(l+1)+m; directions are unit vectors. See the `sh-math` crate.

const SH_COSINE = vec3<f32>(3.14159265358979, 2.09439510239320, 0.785398163397448); // A_l = pi, 2 pi/3, pi/4

/// The basis at `d`, l <= 1.
fn sh_basis_l1(d: vec3<f32>) -> array<f32, 4> {
    return array<f32, 4>(0.28209479177387814, 0.4886025119029199 * d.y, 0.4886025119029199 * d.z, 0.4886025119029199 * d.x);
}

/// The basis at `d`, l <= 2.
fn sh_basis_l2(d: vec3<f32>) -> array<f32, 9> {
    let b = sh_basis_l1(d);
    let z2 = d.z * d.z;
    let c2 = d.x * d.x - d.y * d.y;
    let s2 = 2.0 * d.x * d.y;
    let p21 = 1.0925484305920792 * d.z;
    let g2 = 1.5 * z2 - 0.5;
    return array<f32, 9>(
        b[0], b[1], b[2], b[3],
        0.5462742152960396 * s2, p21 * d.y, 0.6307831305050401 * g2, p21 * d.x, 0.5462742152960396 * c2,
    );
}

/// `sum sh_i w_i`, RGB, l <= 1: a value where `w` is the basis at a direction, an integral where it is another function.
fn sh_weigh_l1(sh: array<vec3<f32>, 4>, w: array<f32, 4>) -> vec3<f32> {
    return sh[0] * w[0] + sh[1] * w[1] + sh[2] * w[2] + sh[3] * w[3];
}

/// The value of `sh` at `d`, RGB, l <= 1.
fn sh_evaluate_l1(sh: array<vec3<f32>, 4>, d: vec3<f32>) -> vec3<f32> {
    return sh_weigh_l1(sh, sh_basis_l1(d));
}

/// The zonal kernel with one factor per band, turned toward `axis`, l <= 1.
fn sh_lobe_l1(factors: vec2<f32>, axis: vec3<f32>) -> array<f32, 4> {
    let w = sh_basis_l1(axis);
    return array<f32, 4>(factors.x * w[0], factors.y * w[1], factors.y * w[2], factors.y * w[3]);
}

/// Irradiance, RGB, on a surface with the normal `n` in the radiance field `sh`: E(n) = sum A_l L_lm Y_lm(n), l <= 1.
fn sh_irradiance_l1(sh: array<vec3<f32>, 4>, n: vec3<f32>) -> vec3<f32> {
    return sh_weigh_l1(sh, sh_lobe_l1(SH_COSINE.xy, n));
}

/// Adds a sample at `d` to a projection; `weighted` is its value times the solid angle it stands for, RGB, l <= 1.
fn sh_project_add_l1(sh: ptr<function, array<vec3<f32>, 4>>, d: vec3<f32>, weighted: vec3<f32>) {
    let w = sh_basis_l1(d);
    (*sh)[0] += weighted * w[0];
    (*sh)[1] += weighted * w[1];
    (*sh)[2] += weighted * w[2];
    (*sh)[3] += weighted * w[3];
}

/// `sum sh_i w_i`, RGB, l <= 2: a value where `w` is the basis at a direction, an integral where it is another function.
fn sh_weigh_l2(sh: array<vec3<f32>, 9>, w: array<f32, 9>) -> vec3<f32> {
    return sh[0] * w[0] + sh[1] * w[1] + sh[2] * w[2] + sh[3] * w[3] + sh[4] * w[4] + sh[5] * w[5]
        + sh[6] * w[6] + sh[7] * w[7] + sh[8] * w[8];
}

/// The value of `sh` at `d`, RGB, l <= 2.
fn sh_evaluate_l2(sh: array<vec3<f32>, 9>, d: vec3<f32>) -> vec3<f32> {
    return sh_weigh_l2(sh, sh_basis_l2(d));
}

/// The zonal kernel with one factor per band, turned toward `axis`, l <= 2.
fn sh_lobe_l2(factors: vec3<f32>, axis: vec3<f32>) -> array<f32, 9> {
    let w = sh_basis_l2(axis);
    return array<f32, 9>(
        factors.x * w[0],
        factors.y * w[1], factors.y * w[2], factors.y * w[3],
        factors.z * w[4], factors.z * w[5], factors.z * w[6], factors.z * w[7], factors.z * w[8],
    );
}

/// Irradiance, RGB, on a surface with the normal `n` in the radiance field `sh`: E(n) = sum A_l L_lm Y_lm(n), l <= 2.
fn sh_irradiance_l2(sh: array<vec3<f32>, 9>, n: vec3<f32>) -> vec3<f32> {
    return sh_weigh_l2(sh, sh_lobe_l2(SH_COSINE, n));
}

/// Adds a sample at `d` to a projection; `weighted` is its value times the solid angle it stands for, RGB, l <= 2.
fn sh_project_add_l2(sh: ptr<function, array<vec3<f32>, 9>>, d: vec3<f32>, weighted: vec3<f32>) {
    let w = sh_basis_l2(d);
    (*sh)[0] += weighted * w[0];
    (*sh)[1] += weighted * w[1];
    (*sh)[2] += weighted * w[2];
    (*sh)[3] += weighted * w[3];
    (*sh)[4] += weighted * w[4];
    (*sh)[5] += weighted * w[5];
    (*sh)[6] += weighted * w[6];
    (*sh)[7] += weighted * w[7];
    (*sh)[8] += weighted * w[8];
}
