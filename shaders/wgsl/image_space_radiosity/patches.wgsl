// patches: texels of a reflective shadow map put together to lights of any size; one dispatch per map and
// level, from level 1.
// Twin: crates/image-space-radiosity/src/cpu/patches.rs. Source: Nichols, Shopf & Wyman 2009, §3.3.

@group(0) @binding(0) var<uniform> pair: LevelPair;
/// Of this map, levels 1 and coarser.
@group(0) @binding(1) var<storage, read_write> patches: array<Patch>;
@group(0) @binding(2) var<uniform> map_index: MapIndex;
/// The coarse level that stands for the light of each map, one map after the other.
@group(0) @binding(3) var<storage, read_write> sources: array<Patch>;

@compute @workgroup_size(64)
fn patches_parent(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height {
        patches[pair.coarse_offset - pair.first + i] = parent(i % pair.coarse_width, i / pair.coarse_width);
    }
}

/// Copies the pair's coarser level; one workgroup.
@compute @workgroup_size(64)
fn patches_sources(@builtin(local_invocation_index) i: u32) {
    let count = pair.coarse_width * pair.coarse_height;
    if i < count {
        sources[map_index.map * count + i] = node(pair.coarse_offset + i);
    }
}

/// The patch of the up to four children at (2x, 2y)…(2x+1, 2y+1).
fn parent(x: u32, y: u32) -> Patch {
    let a = child(2u * x, 2u * y);
    let b = child(2u * x + 1u, 2u * y);
    let c = child(2u * x, 2u * y + 1u);
    let d = child(2u * x + 1u, 2u * y + 1u);
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

/// A patch of the finer level; empty outside the map.
fn child(x: u32, y: u32) -> Patch {
    if x < pair.fine_width && y < pair.fine_height {
        return node(pair.fine_offset + y * pair.fine_width + x);
    }
    return PATCH_EMPTY;
}

/// The patch of a node.
fn node(i: u32) -> Patch {
    if i < pair.first {
        return texel_patch(i);
    }
    return patches[i - pair.first];
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
