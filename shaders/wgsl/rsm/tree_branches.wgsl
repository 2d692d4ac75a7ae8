// leaves, parents, reference, reach: the branches of a tree over a sorted list of lights, level by level.
// Twin: crates/rsm/src/cpu/tree.rs.

/// A level and the finer one below it.
struct TreeLevel {
    level: u32,
    offset: u32,
    count: u32,
    fine_offset: u32,
    fine_count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

/// Key and place in the list, sorted.
@group(0) @binding(3) var<storage, read> pairs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> branches: array<Branch>;
@group(0) @binding(5) var<uniform> pair: TreeLevel;
@group(0) @binding(6) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> normals: array<vec4<f32>>;
/// Number of receivers first.
@group(0) @binding(8) var<storage, read> receiver_count: array<u32>;
/// The reference irradiance.
@group(0) @binding(9) var<storage, read_write> reference: array<f32>;

const BRANCH_EMPTY: Branch = Branch(vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0u, 0u, 0u, 0.0, 0.0);
const FRAC_1_PI: f32 = 0.318309886183791;
const LEAST: f32 = 0x1p-126;
const SAMPLES: u32 = 256u;
const SOURCES: u32 = 64u;

var<workgroup> sums: array<f32, 256>;
var<workgroup> counts: array<u32, 256>;

/// The branch that follows branch `i` of a level of `in_level` and all beneath it.
fn next_of(level: u32, in_level: u32, i: u32) -> u32 {
    let following = i + 1u;
    if following >= in_level {
        return tree.branches;
    }
    // The largest subtree that begins there.
    let up = countTrailingZeros(following);
    let k = level + up;
    return tree.offsets[k / 4u][k % 4u] + (following >> up);
}

@compute @workgroup_size(64)
fn tree_leaves(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < tree.lights {
        var own = leaf(pairs[i].y);
        own.next = next_of(0u, tree.lights, i);
        branches[tree.offsets[0][0] + i] = own;
    }
}

/// The branch of a light: a disc.
fn leaf(i: u32) -> Branch {
    var own = BRANCH_EMPTY;
    if is_lit(i) {
        own.position = vpls[i].position;
        own.area = vpls[i].area;
        own.normal = vpls[i].normal;
        own.flux = vpls[i].flux;
        own.representative = i;
        own.radius = sqrt(max(own.area, 0.0) * FRAC_1_PI);
    }
    return own;
}

@compute @workgroup_size(64)
fn tree_parents(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.count {
        let first = branches[pair.fine_offset + 2u * i];
        var second = BRANCH_EMPTY;
        if 2u * i + 1u < pair.fine_count {
            second = branches[pair.fine_offset + 2u * i + 1u];
        }
        let u = unit_f32(hash_combine(tree.seed, pair.offset + i));
        var own = parent(first, second, u);
        own.next = next_of(pair.level, pair.count, i);
        own.child = pair.fine_offset + 2u * i;
        branches[pair.offset + i] = own;
    }
}

/// The branch above two, of which the second, or both, may be without flux. `u` draws the representative.
fn parent(a: Branch, b: Branch, u: f32) -> Branch {
    var light = BRANCH_EMPTY;
    light.flux = a.flux + b.flux;
    light.area = a.area + b.area;
    let total = weight(light.flux);
    if total <= 0.0 {
        return light;
    }
    let first = weight(a.flux);
    let second = weight(b.flux);
    light.representative = select(b.representative, a.representative, u * total < first);
    let sa = first / total;
    let sb = second / total;
    light.position = a.position * sa + b.position * sb;
    let axis = a.normal * sa + b.normal * sb;
    let length = sqrt(dot(axis, axis));
    let cancelled = length < 1e-3;
    light.normal = axis * (1.0 / length);
    if cancelled {
        // Normals that cancel: the brighter is better than none, the cone is everything.
        light.normal = b.normal;
        if first >= second {
            light.normal = a.normal;
        }
    }
    widen(&light, a);
    widen(&light, b);
    if cancelled {
        light.versine = 2.0;
    }
    light.reach = ALWAYS;
    return light;
}

/// Makes sphere and cone contain those of a child.
fn widen(light: ptr<function, Branch>, child: Branch) {
    if weight(child.flux) > 0.0 {
        let v = child.position - (*light).position;
        (*light).radius = max((*light).radius, sqrt(dot(v, v)) + child.radius);
        let offset = child.normal - (*light).normal;
        (*light).versine = max((*light).versine, versine_of_sum(0.5 * dot(offset, offset), child.versine));
    }
}

/// The mean over receivers of the irradiance that the sources would cast if all faced them; one workgroup.
@compute @workgroup_size(256)
fn tree_reference(@builtin(local_invocation_index) thread: u32) {
    let n = min(receiver_count[0], arrayLength(&positions));
    let samples = min(n, SAMPLES);
    let source = sources();
    var sum = 0.0;
    var counted = 0u;
    if thread < samples {
        let receiver = (thread * n + n / 2u) / samples;
        if any(normals[receiver].xyz != vec3(0.0)) {
            sum = irradiance_at(source, positions[receiver].xyz);
            counted = 1u;
        }
    }
    sums[thread] = sum;
    counts[thread] = counted;
    workgroupBarrier();
    for (var half = SAMPLES / 2u; half > 0u; half /= 2u) {
        if thread < half {
            sums[thread] += sums[thread + half];
            counts[thread] += counts[thread + half];
        }
        workgroupBarrier();
    }
    if thread == 0u {
        reference[0] = select(0.0, sums[0] / f32(counts[0]), counts[0] > 0u);
    }
}

/// The branches that stand for the light of all, the first and the one past the last: of the finest level where no
/// more than SOURCES have flux, those that do.
fn sources() -> vec2<u32> {
    // The lights with flux come first.
    var lit = 0u;
    var end = tree.lights;
    while lit < end {
        let middle = (lit + end) / 2u;
        if weight(branches[tree.inner + middle].flux) > 0.0 {
            lit = middle + 1u;
        } else {
            end = middle;
        }
    }
    var level = 0u;
    var used = lit;
    while used > SOURCES {
        level += 1u;
        used = (lit + (1u << level) - 1u) >> level;
    }
    let first = tree.offsets[level / 4u][level % 4u];
    return vec2(first, first + used);
}

/// Mean over the channels of the irradiance that the sources would cast at a point if all faced it.
fn irradiance_at(source: vec2<u32>, position: vec3<f32>) -> f32 {
    var sum = 0.0;
    for (var i = source.x; i < source.y; i++) {
        let w = weight(branches[i].flux);
        if w > 0.0 {
            let v = branches[i].position - position;
            let radius = branches[i].radius;
            let d2 = dot(v, v) + radius * radius;
            sum += w / (3.0 * REACH_PI * max(d2, LEAST));
        }
    }
    return sum;
}

@compute @workgroup_size(64)
fn tree_reach(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < tree.inner {
        var reach = 0.0;
        if weight(branches[i].flux) > 0.0 {
            reach = reach_of(branches[i], tree.bound, tree.tau * reference[0]);
        }
        branches[i].reach = reach;
    }
}
