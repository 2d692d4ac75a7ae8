//! Octahedral unit vectors: two numbers for a direction, exact at the axes, no lost sign (Cigolle et al. 2014, "A Survey
//! of Efficient Representations for Independent Unit Vectors", JCGT 3(2)).

use glam::{Vec2, Vec3};

fn sign_not_zero(v: Vec2) -> Vec2 {
    Vec2::new(1.0_f32.copysign(v.x), 1.0_f32.copysign(v.y))
}

/// Maps a direction, which does not need to be normalized, to the square `[-1, 1]²`. Zero maps to `(0, 0)`, that is +Z.
#[must_use]
#[inline]
pub fn encode(n: Vec3) -> Vec2 {
    let l1 = n.x.abs() + n.y.abs() + n.z.abs();
    if l1 <= 0.0 {
        return Vec2::ZERO;
    }
    let p = Vec2::new(n.x, n.y) / l1;
    if n.z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * sign_not_zero(p) }
}

/// The unit vector of a point of the square `[-1, 1]²`; the inverse of [`encode`].
#[must_use]
#[inline]
pub fn decode(e: Vec2) -> Vec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let xy = if z >= 0.0 { e } else { (Vec2::ONE - Vec2::new(e.y.abs(), e.x.abs())) * sign_not_zero(e) };
    Vec3::new(xy.x, xy.y, z).normalize()
}

/// [`encode`] packed into two signed normalized 16-bit numbers, x in the low half: WGSL's `pack2x16snorm`.
#[must_use]
pub fn pack(n: Vec3) -> u32 {
    let e = encode(n);
    let q = |v: f32| u32::from(((0.5 + 32767.0 * v.clamp(-1.0, 1.0)).floor() as i16).cast_unsigned());
    q(e.x) | (q(e.y) << 16)
}

/// The unit vector of [`pack`]; its angle to the packed direction is below 7e-5 rad.
#[must_use]
pub fn unpack(p: u32) -> Vec3 {
    let q = |v: u32| (f32::from((v as u16).cast_signed()) / 32767.0).max(-1.0);
    decode(Vec2::new(q(p), q(p >> 16)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn axes_round_trip_exactly() {
        for n in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_eq!(decode(encode(n)), n);
            assert_eq!(unpack(pack(n)), n);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]

        #[test]
        fn round_trip(v in prop::array::uniform3(-1.0_f32..1.0)) {
            let v = Vec3::from(v);
            prop_assume!(v.length() > 1e-3);
            let n = v.normalize();
            // A few roundings of values below 1.
            prop_assert!((decode(encode(v)) - n).length() < 1e-6);
            // Half a step of 1/32767 on x and y moves z by the sum of both: √6 half steps on the octahedron, whose face
            // centres are √3 closer than the sphere: √18/2/32767 = 6.5e-5.
            prop_assert!((unpack(pack(v)) - n).length() < 7e-5);
        }
    }
}
