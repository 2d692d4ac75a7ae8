// Spherical harmonics up to l = 3. Needs sh/sh.wgsl.
// Twin: sh_math::basis, whose order of operations it has.

fn field_basis(d: vec3<f32>) -> array<f32, 16> {
    let low = sh_basis_l2(d);
    var y: array<f32, 16>;
    for (var k = 0u; k < 9u; k++) {
        y[k] = low[k];
    }
    let z2 = d.z * d.z;
    let c2 = d.x * d.x - d.y * d.y;
    let s2 = 2.0 * d.x * d.y;
    let c3 = d.x * c2 - d.y * s2;
    let s3 = d.x * s2 + d.y * c2;
    let p31 = 0.45704579946446577 * (5.0 * z2 - 1.0);
    let p32 = 1.4453057213202769 * d.z;
    y[9] = 0.59004358992664352 * s3;
    y[10] = p32 * s2;
    y[11] = p31 * d.y;
    y[12] = 0.37317633259011540 * d.z * (5.0 * z2 - 3.0);
    y[13] = p31 * d.x;
    y[14] = p32 * c2;
    y[15] = 0.59004358992664352 * c3;
    return y;
}
