// Cones of directions by the versine 1 − cos of their half angle, which keeps its digits where the cone is narrow.
// Twin: indirect_core::math::versine_of_sum.

/// 1 − cos(α + β) from 1 − cos α and 1 − cos β, 2 from half a turn on.
fn versine_of_sum(a: f32, b: f32) -> f32 {
    if a + b >= 2.0 {
        return 2.0;
    }
    let sines = sqrt(max(a * (2.0 - a) * b * (2.0 - b), 0.0));
    return min(a + b - a * b + sines, 2.0);
}
