// A camera, a light's map or a cube face: what turns texels into rays and points into clip space.
// Twin: indirect_core::View; laid out by indirect_gpu::ViewUniform. Barycentrics: Woop, Benthin & Wald 2013, JCGT 2(1).

struct View {
    origin: vec3<f32>,
    near: f32,
    right: vec3<f32>,
    /// 1 for parallel rays, 0 for rays from the origin.
    orthographic: u32,
    up: vec3<f32>,
    /// Clip z = view depth · depth_scale + depth_offset.
    depth_scale: f32,
    forward: vec3<f32>,
    depth_offset: f32,
    /// Half the image plane: tangents (perspective) or metres (orthographic).
    half_extent: vec2<f32>,
    size: vec2<u32>,
    /// Index of this view's first texel in buffers that hold several views.
    first_texel: u32,
    /// Where in the render targets this view's image begins, texels.
    tile: vec2<u32>,
}

/// A world point along the view's right, up and forward axes. The origin is subtracted first: digits survive far from 0.
fn view_local(view: View, p: vec3<f32>) -> vec3<f32> {
    let d = p - view.origin;
    return vec3<f32>(dot(view.right, d), dot(view.up, d), dot(view.forward, d));
}

/// A world point in clip space with reversed depth.
fn view_clip(view: View, p: vec3<f32>) -> vec4<f32> {
    let local = view_local(view, p);
    let w = select(local.z, 1.0, view.orthographic != 0u);
    return vec4<f32>(local.xy / view.half_extent, local.z * view.depth_scale + view.depth_offset, w);
}

/// Where a world point falls on the image, [0, 1]² inside with (0, 0) at the top left, and 1; 0 at or behind the eye: twin of
/// View::image_point.
fn view_image_point(view: View, p: vec3<f32>) -> vec3<f32> {
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

/// The point of the image plane at depth 1 (perspective) or in metres (orthographic) for a continuous pixel coordinate.
fn view_plane_point(view: View, pixel: vec2<f32>) -> vec2<f32> {
    let ndc = vec2<f32>(2.0 * pixel.x / f32(view.size.x) - 1.0, 1.0 - 2.0 * pixel.y / f32(view.size.y));
    return ndc * view.half_extent;
}

/// Direction of the ray through a continuous pixel coordinate, of view depth 1.
fn view_direction(view: View, pixel: vec2<f32>) -> vec3<f32> {
    if view.orthographic != 0u {
        return view.forward;
    }
    let p = view_plane_point(view, pixel);
    return view.forward + (view.right * p.x + view.up * p.y);
}

/// Barycentric weights of the three corners where the ray through `pixel` meets their plane, and the view depth there: twin
/// of View::barycentrics, step by step. A rasteriser snaps corners to a fraction of a texel, so a ray may pass just outside
/// of the triangle that it was given: the weights are clamped to the triangle, which keeps the result finite and on the
/// surface, even edge-on.
fn view_barycentrics(view: View, pixel: vec2<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec4<f32> {
    let plane = view_plane_point(view, pixel);
    let la = view_local(view, a);
    let lb = view_local(view, b);
    let lc = view_local(view, c);
    let parallel = view.orthographic != 0u;
    // Corners in a frame in which the ray is the z axis.
    let pa = la.xy - plane * select(la.z, 1.0, parallel);
    let pb = lb.xy - plane * select(lb.z, 1.0, parallel);
    let pc = lc.xy - plane * select(lc.z, 1.0, parallel);
    var w = vec3<f32>(pc.x * pb.y - pc.y * pb.x, pa.x * pc.y - pa.y * pc.x, pb.x * pa.y - pb.y * pa.x);
    // Both faces are seen: the three weights share the sign of their sum.
    w = max(select(w, -w, w.x + w.y + w.z < 0.0), vec3<f32>(0.0));
    let sum = w.x + w.y + w.z;
    let uv = select(vec2<f32>(0.0), w.yz / sum, sum > 0.0);
    let v0 = 1.0 - uv.x - uv.y;
    return vec4<f32>(v0, uv, la.z * v0 + lb.z * uv.x + lc.z * uv.y);
}
