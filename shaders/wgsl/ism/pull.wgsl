// pull: coarser levels of every map, a workgroup to a map.
// Twin: crates/imperfect-shadow-maps/src/cpu/pull.rs. Ritschel et al. 2008, after Marroquim, Kraus & Cavalcanti 2007.

@group(0) @binding(0) var<uniform> ism: Ism;
/// Number of VPLs.
@group(0) @binding(1) var<storage, read> count: array<u32>;
@group(0) @binding(2) var<storage, read> ism_atlas: array<f32>;
@group(0) @binding(3) var<storage, read_write> ism_coarse: array<f32>;

const CLOSE: f32 = 0.1;

@compute @workgroup_size(64)
fn pull(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let map = workgroup_id.y * num_workgroups.x + workgroup_id.x;
    if map >= min(count[0], ism.tiles) {
        return;
    }
    let fine = map * ism.tile * ism.tile;
    var begin = map * ism.coarse;
    var end = begin;
    var side = ism.tile;
    var close = CLOSE;
    for (var level = 1u; level <= ism.levels; level++) {
        let above = side / 2u;
        for (var i = thread; i < above * above; i += 64u) {
            let at = 2u * (i / above) * side + 2u * (i % above);
            var u: vec4<f32>;
            if level == 1u {
                let f = fine + at;
                u = vec4(ism_atlas[f], ism_atlas[f + 1u], ism_atlas[f + side], ism_atlas[f + side + 1u]);
            } else {
                let f = begin + at;
                u = vec4(ism_coarse[f], ism_coarse[f + 1u], ism_coarse[f + side], ism_coarse[f + side + 1u]);
            }
            ism_coarse[end + i] = pull_texel(u, close);
        }
        storageBarrier();
        begin = end;
        end += above * above;
        side = above;
        close *= 2.0;
    }
}

/// The mean of those of four texels that are close to the second nearest, or to the only one.
fn pull_texel(u: vec4<f32>, close: f32) -> f32 {
    let a = max(u.x, u.y);
    let b = min(u.x, u.y);
    let c = max(u.z, u.w);
    let d = min(u.z, u.w);
    let second = max(min(a, c), max(b, d));
    let nearest = select(max(a, c), second, second > 0.0);
    let low = nearest / (1.0 + close);
    let high = nearest * (1.0 + close);
    var sum = 0.0;
    var n = 0.0;
    for (var i = 0u; i < 4u; i++) {
        if u[i] > 0.0 && u[i] >= low && u[i] <= high {
            sum += u[i];
            n += 1.0;
        }
    }
    if n > 0.0 {
        return sum / n;
    }
    return 0.0;
}
