// splat: points of the scene drawn into the paraboloid maps of virtual point lights. The greatest reciprocal depth wins; as a
// float that is not negative it is ordered as its bits are.
// Twin: crates/imperfect-shadow-maps/src/cpu/splat.rs, which holds the equations. Ritschel et al. 2008.

@group(0) @binding(0) var<uniform> ism: Ism;
@group(0) @binding(1) var<storage, read> vpls: array<Vpl>;
/// Number of VPLs.
@group(0) @binding(2) var<storage, read> count: array<u32>;
@group(0) @binding(3) var<storage, read> ism_points: array<IsmPoint>;
@group(0) @binding(4) var<storage, read_write> ism_atlas: array<atomic<u32>>;

const MAX_SHARE: f32 = 0.25;
const LIFT: f32 = 0.015625;
const NEAREST: f32 = 2.0;
const FRAC_1_PI: f32 = 0.31830988618;

/// Empties all maps, those without a VPL too.
@compute @workgroup_size(64)
fn splat_clear(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < ism.tiles * ism.tile * ism.tile {
        atomicStore(&ism_atlas[i], 0u);
    }
}

/// One point of one map.
@compute @workgroup_size(64)
fn splat(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let per_map = max(ism.points_per_map, 1u);
    let j = i / per_map;
    if j >= min(count[0], ism.tiles) || ism.points == 0u {
        return;
    }
    var index = j * ism.points_per_map % ism.points + i % per_map;
    if index >= ism.points {
        index -= ism.points;
    }
    draw(j, ism_points[index], vpls[j].position, vpls[j].normal);
}

fn draw(j: u32, p: IsmPoint, origin: vec3<f32>, normal: vec3<f32>) {
    let tile = f32(ism.tile);
    let half = 0.5 * tile;
    let most = max(MAX_SHARE * tile, 1.0);
    let frame = ism_frame(normal);
    let area = p.area * ism.area_scale;
    // The square of the radius.
    let r2 = area * FRAC_1_PI;
    let v = p.position - origin;
    let z = dot(normal, v);
    let facing = dot(p.normal, v);
    let k = abs(facing);
    if !(z > 0.0 && z * z > LIFT * LIFT * r2 && k > 0.0 && area > 0.0) {
        return;
    }
    let d2 = dot(v, v);
    let d = sqrt(d2);
    let c = 1.0 / (d + z);
    let x = dot(frame.tangent, v) * c * half + half;
    let y = dot(frame.bitangent, v) * c * half + half;
    let side = clamp(sqrt(area * k * d / (d2 + r2)) * c * half, 1.0, most);
    let x0 = first(x - 0.5 * side, tile);
    let x1 = first(x + 0.5 * side, tile);
    let y0 = first(y - 0.5 * side, tile);
    let y1 = first(y + 0.5 * side, tile);
    // The plane, over n·p.
    let over = 0.5 / facing;
    let nx = dot(frame.tangent, p.normal) * over;
    let ny = dot(frame.bitangent, p.normal) * over;
    let nz = dot(normal, p.normal) * over;
    let nearest = NEAREST * c;
    for (var ty = y0; ty < y1; ty++) {
        let qy = ism_middle(ty, ism.tile);
        for (var tx = x0; tx < x1; tx++) {
            let qx = ism_middle(tx, ism.tile);
            let u = min(2.0 * (nx * qx + ny * qy) + nz * (1.0 - (qx * qx + qy * qy)), nearest);
            if u > 0.0 {
                atomicMax(&ism_atlas[(j * ism.tile + ty) * ism.tile + tx], bitcast<u32>(u));
            }
        }
    }
}

/// The first texel whose middle is not below `x`, at most `tile`.
fn first(x: f32, tile: f32) -> u32 {
    return u32(clamp(x + 0.5, 0.0, tile));
}
