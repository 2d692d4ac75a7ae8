// Octahedral unit vectors: two numbers for a direction, exact at the axes, no lost sign.
// Twin: indirect_core::octahedral. Source: Cigolle et al. 2014, JCGT 3(2).

fn octahedral_sign(v: vec2<f32>) -> vec2<f32> {
    // Like copysign, so that -0 keeps its sign: select(… v >= 0) would not.
    return bitcast<vec2<f32>>((bitcast<vec2<u32>>(v) & vec2<u32>(0x80000000u)) | vec2<u32>(0x3f800000u));
}

/// Maps a direction of any length to [-1, 1]²; zero maps to (0, 0), that is +Z.
fn octahedral_encode(n: vec3<f32>) -> vec2<f32> {
    let l1 = abs(n.x) + abs(n.y) + abs(n.z);
    if l1 <= 0.0 {
        return vec2<f32>(0.0);
    }
    let p = n.xy / l1;
    if n.z >= 0.0 {
        return p;
    }
    return (vec2<f32>(1.0) - abs(p.yx)) * octahedral_sign(p);
}

/// The unit vector of a point of [-1, 1]².
fn octahedral_decode(e: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(e.x) - abs(e.y);
    var xy = e;
    if z < 0.0 {
        xy = (vec2<f32>(1.0) - abs(e.yx)) * octahedral_sign(e);
    }
    return normalize(vec3<f32>(xy, z));
}

/// `octahedral_encode` in two signed normalized 16-bit numbers, x in the low half.
fn octahedral_pack(n: vec3<f32>) -> u32 {
    return pack2x16snorm(octahedral_encode(n));
}

/// The unit vector of `octahedral_pack`.
fn octahedral_unpack(p: u32) -> vec3<f32> {
    return octahedral_decode(unpack2x16snorm(p));
}
