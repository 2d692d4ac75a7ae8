// reach: the distance from which the lights beneath a branch may be taken for one.
// Twin: crates/rsm/src/cpu/reach.rs. Source: Nichols, Shopf & Wyman 2009, §3.5, eq. 7–8; docs/errata.md.

const ALWAYS: f32 = 1e18;
const REACH_PI: f32 = 3.14159265358979;

/// The distance below which the bound of a branch exceeds the threshold. Bound 0: the error of taking its lights for
/// one; 1: the light that they send.
fn reach_of(own: Branch, bound: u32, threshold: f32) -> f32 {
    if threshold <= 0.0 {
        return ALWAYS;
    }
    let flux = weight(own.flux) / 3.0;
    var reach = 0.0;
    if bound == 0u {
        // Φ/(πd²)·(r²/d² + s) = T, a quadratic in 1/d².
        let s = own.versine;
        let r2 = own.radius * own.radius;
        let far = flux / (REACH_PI * threshold);
        reach = sqrt(0.5 * (far * s + sqrt(far * (far * (s * s) + 4.0 * r2))));
    } else {
        // Φ/(πd² + A) = T, for the nearest point of the patch.
        reach = own.radius + sqrt(max((flux / threshold - own.area) / REACH_PI, 0.0));
    }
    return min(reach, ALWAYS);
}
