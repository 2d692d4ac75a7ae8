// project: where a world point falls on a view's image.
// Twin: plane_project in crates/radiance-hints/src/cpu/look.rs.

/// The place on the image, [0, 1]² inside, and 1; the last is 0 at or behind the eye.
fn plane_project(view: View, p: vec3<f32>) -> vec3<f32> {
    let local = view_local(view, p);
    var plane: vec2<f32>;
    if view.orthographic != 0u {
        plane = local.xy / view.half_extent;
    } else {
        if local.z <= 0.0 {
            return vec3(0.0);
        }
        plane = local.xy / local.z / view.half_extent;
    }
    return vec3(0.5 + 0.5 * plane.x, 0.5 - 0.5 * plane.y, 1.0);
}
