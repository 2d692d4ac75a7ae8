// splat: the baselines that add one light after the other by blending: a point per fragment and light (splat), or a rectangle of
// pixels per light (splat_bounded). splat_resolve moves the sums from the target to a buffer.
// Twin: crates/image-space-radiosity/src/cpu/splat.rs. Source: Nichols & Wyman 2009; Dachsbacher & Stamminger 2006.

@group(0) @binding(0) var<uniform> lengths: Lengths;
@group(0) @binding(1) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
/// The reference irradiance.
@group(0) @binding(4) var<storage, read> reference: array<f32>;
@group(0) @binding(5) var<uniform> camera_view: View;
@group(0) @binding(6) var target_texture: texture_2d<f32>;
@group(0) @binding(7) var<storage, read_write> sums: array<vec4<f32>>;
@group(0) @binding(8) var<uniform> settings: Settings;

const PI: f32 = 3.14159265358979;
const LEAST_DENOMINATOR: f32 = 1e-37;

struct SplatVertex {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat, either) light: u32,
}

/// One point per fragment (vertex) and light (instance).
@vertex
fn splat_vertex(@builtin(vertex_index) fragment: u32, @builtin(instance_index) light: u32) -> SplatVertex {
    let texel = vec2<f32>(vec2(fragment % lengths.splats.x, fragment / lengths.splats.x)) + 0.5;
    let ndc = texel / vec2<f32>(lengths.splats) * 2.0 - 1.0;
    return SplatVertex(vec4(ndc.x, -ndc.y, 0.0, 1.0), light);
}

@fragment
fn splat(v: SplatVertex) -> @location(0) vec4<f32> {
    let at = vec2<u32>(v.clip.xy);
    let i = at.y * lengths.splats.x + at.x;
    return vec4(light_at(v.light, positions[i].xyz, normals[i].xyz), 0.0);
}

/// Two triangles per light that cover its footprint.
@vertex
fn splat_bounded_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) light: u32) -> SplatVertex {
    let rectangle = footprint(vpls[light].position, sqrt(reach2(light)));
    var corners = array(vec2(0u, 0u), vec2(1u, 0u), vec2(0u, 1u), vec2(0u, 1u), vec2(1u, 0u), vec2(1u, 1u));
    let pixel = vec2<f32>(select(rectangle.xy, rectangle.zw, corners[corner] == vec2(1u)));
    let ndc = pixel / vec2<f32>(lengths.splats) * 2.0 - 1.0;
    return SplatVertex(vec4(ndc.x, -ndc.y, 0.0, 1.0), light);
}

@fragment
fn splat_bounded(vertex: SplatVertex) -> @location(0) vec4<f32> {
    let at = vec2<u32>(vertex.clip.xy);
    let i = at.y * lengths.splats.x + at.x;
    let v = vpls[vertex.light].position - positions[i].xyz;
    if dot(v, v) < reach2(vertex.light) {
        return vec4(light_at(vertex.light, positions[i].xyz, normals[i].xyz), 0.0);
    }
    return vec4(0.0);
}

@compute @workgroup_size(64)
fn splat_resolve(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < min(lengths.splats.x * lengths.splats.y, arrayLength(&sums)) {
        sums[i] = textureLoad(target_texture, vec2(i % lengths.splats.x, i / lengths.splats.x), 0);
    }
}

/// Squared distance at which a light falls below the cut-off: Φ/(πd² + A) of its mean channel.
fn reach2(i: u32) -> f32 {
    let flux = weight(vpls[i].flux) / 3.0;
    let cutoff = max(settings.cutoff * reference[0], 1.1754944e-38);
    return max((flux / cutoff - vpls[i].area) / PI, 0.0);
}

/// First and one past the last pixel of a rectangle that contains the image of a sphere.
fn footprint(centre: vec3<f32>, radius: f32) -> vec4<u32> {
    let v = centre - camera_view.origin;
    let local = vec3(dot(v, camera_view.right), dot(v, camera_view.up), dot(v, camera_view.forward));
    var lo = local.xy - radius;
    var hi = local.xy + radius;
    if camera_view.orthographic == 0u {
        let nearest = local.z - radius;
        let farthest = local.z + radius;
        if farthest <= 0.0 {
            return vec4(0u);
        }
        if nearest <= 0.0 {
            return vec4(vec2(0u), lengths.splats);
        }
        // The box around the sphere, seen at its nearest or farthest depth, whichever is further out.
        lo = lo / select(vec2(nearest), vec2(farthest), lo > vec2(0.0));
        hi = hi / select(vec2(farthest), vec2(nearest), hi > vec2(0.0));
    }
    lo = lo / camera_view.half_extent;
    hi = hi / camera_view.half_extent;
    let size = vec2<f32>(lengths.splats);
    let begin = clamp((vec2(lo.x, -hi.y) + 1.0) * 0.5 * size, vec2(0.0), size);
    let end = clamp((vec2(hi.x, -lo.y) + 1.0) * 0.5 * size, vec2(0.0), size);
    return vec4(vec2<u32>(floor(begin)), vec2<u32>(ceil(end)));
}

/// Irradiance from one light, W/m².
fn light_at(i: u32, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let v = vpls[i].position - position;
    let d2 = dot(v, v);
    let ci = dot(normal, v);
    let cj = -dot(vpls[i].normal, v);
    let denominator = d2 * (PI * d2 + vpls[i].area * settings.area_scale);
    return vpls[i].flux * (max(ci, 0.0) * max(cj, 0.0) / max(denominator, LEAST_DENOMINATOR));
}
