// patches: texels of a reflective shadow map put together to lights of any size: level 1 in one dispatch per map, any coarser level
// in one for all maps of a part.
// Twin: crates/image-space-radiosity/src/cpu/patches.rs. Source: Nichols, Shopf & Wyman 2009, §3.3.

@group(0) @binding(0) var<uniform> pair: LevelPair;
/// Levels 1 and coarser of the maps of a part, one map after the other.
@group(0) @binding(1) var<storage, read_write> patches: array<Patch>;
@group(0) @binding(2) var<uniform> map_index: MapIndex;
/// The coarse level that stands for the light of each map, one map after the other.
@group(0) @binding(3) var<storage, read_write> sources: array<Patch>;
@group(0) @binding(4) var<uniform> part: Part;
@group(0) @binding(5) var<uniform> lengths: Lengths;

/// The pair's coarser level, level 1, of a map.
@compute @workgroup_size(64)
fn patches_texels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height {
        let at = 2u * vec2(i % pair.coarse_width, i / pair.coarse_width);
        patches[map_index.in_part * lengths.patches + i] =
            parent(texel(at), texel(at + vec2(1u, 0u)), texel(at + vec2(0u, 1u)), texel(at + 1u));
    }
}

/// The pair's coarser level, level 2 or coarser, of all maps of a part.
@compute @workgroup_size(64)
fn patches_parent(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let k = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let count = pair.coarse_width * pair.coarse_height;
    if k < part.maps * count {
        let i = k % count;
        let first = k / count * lengths.patches;
        let at = 2u * vec2(i % pair.coarse_width, i / pair.coarse_width);
        patches[first + pair.coarse_offset - pair.first + i] = parent(
            stored(first, at), stored(first, at + vec2(1u, 0u)), stored(first, at + vec2(0u, 1u)), stored(first, at + 1u),
        );
    }
}

/// Copies the pair's coarser level, level 1 or coarser, of all maps of a part; one thread per patch.
@compute @workgroup_size(64)
fn patches_sources(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let k = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let count = pair.coarse_width * pair.coarse_height;
    if k < part.maps * count {
        sources[part.first_map * count + k] =
            patches[k / count * lengths.patches + pair.coarse_offset - pair.first + k % count];
    }
}

/// Copies the texels of a map of no more than 4²; one workgroup.
@compute @workgroup_size(64)
fn patches_source_texels(@builtin(local_invocation_index) i: u32) {
    if i < pair.first {
        sources[map_index.map * pair.first + i] = texel_patch(i);
    }
}

/// The patch of a texel; empty outside the map.
fn texel(at: vec2<u32>) -> Patch {
    if all(at < vec2(pair.fine_width, pair.fine_height)) {
        return texel_patch(at.y * pair.fine_width + at.x);
    }
    return PATCH_EMPTY;
}

/// A patch of the finer level of the map whose first patch is given; empty outside the map.
fn stored(first: u32, at: vec2<u32>) -> Patch {
    if all(at < vec2(pair.fine_width, pair.fine_height)) {
        return patches[first + pair.fine_offset - pair.first + at.y * pair.fine_width + at.x];
    }
    return PATCH_EMPTY;
}

/// The patch of the up to four children at (2x, 2y), (2x+1, 2y), (2x, 2y+1) and (2x+1, 2y+1).
fn parent(a: Patch, b: Patch, c: Patch, d: Patch) -> Patch {
    var light = PATCH_EMPTY;
    light.flux = a.flux + b.flux + c.flux + d.flux;
    light.area = a.area + b.area + c.area + d.area;
    let total = weight(light.flux);
    if total <= 0.0 {
        return light;
    }
    let shares = vec4(weight(a.flux), weight(b.flux), weight(c.flux), weight(d.flux)) / total;
    light.position = a.position * shares.x + b.position * shares.y + c.position * shares.z + d.position * shares.w;
    let axis = a.normal * shares.x + b.normal * shares.y + c.normal * shares.z + d.normal * shares.w;
    let length = sqrt(dot(axis, axis));
    let cancelled = length < 1e-3;
    light.normal = axis * (1.0 / length);
    if cancelled {
        // Normals that cancel: the brightest is better than none, the cone is everything.
        var most = weight(a.flux);
        light.normal = a.normal;
        if weight(b.flux) > most {
            most = weight(b.flux);
            light.normal = b.normal;
        }
        if weight(c.flux) > most {
            most = weight(c.flux);
            light.normal = c.normal;
        }
        if weight(d.flux) > most {
            light.normal = d.normal;
        }
    }
    widen(&light, a);
    widen(&light, b);
    widen(&light, c);
    widen(&light, d);
    if cancelled {
        light.versine = 2.0;
    }
    return light;
}

/// Makes sphere, plane and cone contain those of a child.
fn widen(light: ptr<function, Patch>, child: Patch) {
    if weight(child.flux) > 0.0 {
        let v = child.position - (*light).position;
        (*light).radius = max((*light).radius, sqrt(dot(v, v)) + child.radius);
        let offset = child.normal - (*light).normal;
        let versine = 0.5 * dot(offset, offset);
        let sine = sqrt(max(versine * (2.0 - versine), 0.0));
        let relief = abs(dot((*light).normal, v)) + child.relief + child.radius * sine;
        (*light).relief = max((*light).relief, relief);
        (*light).versine = max((*light).versine, versine_of_sum(versine, child.versine));
    }
}
