// pyramid: bounds and sums over the lit texels of a map, level by level; large levels a dispatch each, the small ones
// at the top one dispatch for all: encoding is paid by the dispatch.
// Twin: crates/rsm/src/cpu/pyramid.rs.

/// Where the levels lie in `nodes`, and which of them a dispatch makes.
struct PyramidLevels {
    /// Offset, width and height of each.
    levels: array<vec4<u32>, 16>,
    /// The finest that is read.
    first: u32,
    /// How many are made.
    count: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> pyramid: PyramidLevels;
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> texels: array<Texel>;
@group(0) @binding(4) var<storage, read_write> nodes: array<Node>;

const NODE_EMPTY: Node = Node(vec3(0.0), 0x1.fffffep+127, vec3(0.0), 0.0, vec3(0.0), 0.0);

@compute @workgroup_size(64)
fn pyramid_leaf(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < arrayLength(&texels) {
        nodes[i] = leaf(positions[i].w, normals[i].xyz, texels[i]);
    }
}

/// One level.
@compute @workgroup_size(64)
fn pyramid_parent(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let coarse = pyramid.levels[pyramid.first + 1u];
    if i < coarse.y * coarse.z {
        nodes[coarse.x + i] = parent(pyramid.levels[pyramid.first], i % coarse.y, i / coarse.y);
    }
}

/// All levels that are left, by one workgroup: what it reads it has made itself, or a dispatch before.
@compute @workgroup_size(64)
fn pyramid_top(@builtin(local_invocation_index) local_index: u32) {
    for (var k = 0u; k < pyramid.count; k++) {
        let fine = pyramid.levels[pyramid.first + k];
        let coarse = pyramid.levels[pyramid.first + k + 1u];
        for (var i = local_index; i < coarse.y * coarse.z; i += 64u) {
            nodes[coarse.x + i] = parent(fine, i % coarse.y, i / coarse.y);
        }
        storageBarrier();
    }
}

/// The node of one texel. What is not finite counts as unlit: one such texel would be in every sum above it.
fn leaf(depth: f32, normal: vec3<f32>, texel: Texel) -> Node {
    if max(max(texel.incident.x, texel.incident.y), texel.incident.z) <= 0.0
        || !is_finite3(texel.incident) || !is_finite3(texel.reflected) {
        return NODE_EMPTY;
    }
    return Node(texel.reflected, depth, texel.incident, depth, normal, 0.0);
}

/// By the bits: shader compilers may assume that there is nothing else.
fn is_finite3(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3(0x7f800000u)) != vec3(0x7f800000u));
}

/// The node above the up to four children at (2x, 2y)…(2x+1, 2y+1) of the level `fine`: offset, width, height.
fn parent(fine: vec4<u32>, x: u32, y: u32) -> Node {
    var node = NODE_EMPTY;
    var axis = vec3(0.0);
    let x_end = min(2u * x + 2u, fine.y);
    let y_end = min(2u * y + 2u, fine.z);
    for (var cy = 2u * y; cy < y_end; cy++) {
        for (var cx = 2u * x; cx < x_end; cx++) {
            let child = nodes[fine.x + cy * fine.y + cx];
            node.reflected += child.reflected;
            node.incident += child.incident;
            node.depth_min = min(node.depth_min, child.depth_min);
            node.depth_max = max(node.depth_max, child.depth_max);
            axis += child.cone_axis;
        }
    }
    if node.depth_min > node.depth_max {
        return node;
    }
    let length = sqrt(dot(axis, axis));
    if length < 1e-3 {
        // Normals that cancel: no axis is better than another, the cone is everything.
        node.cone_axis = vec3(0.0, 0.0, 1.0);
        node.cone_versine = 2.0;
        return node;
    }
    node.cone_axis = axis * (1.0 / length);
    for (var cy = 2u * y; cy < y_end; cy++) {
        for (var cx = 2u * x; cx < x_end; cx++) {
            let child = nodes[fine.x + cy * fine.y + cx];
            if child.depth_min <= child.depth_max {
                let offset = child.cone_axis - node.cone_axis;
                // |a − b|²/2 is 1 − cos of the angle between unit vectors, without its cancellation.
                let versine = versine_of_sum(0.5 * dot(offset, offset), child.cone_versine);
                node.cone_versine = max(node.cone_versine, versine);
            }
        }
    }
    return node;
}
