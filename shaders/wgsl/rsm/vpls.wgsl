// vpls: one virtual point light per slot, for each way to select texels.
// Twin: crates/rsm/src/cpu/vpls.rs.
// Importance: Dachsbacher & Stamminger 2006, "Splatting Indirect Illumination", by hierarchical warping of the flux.

/// One map among all maps, and the slots it fills.
struct Selection {
    resolution: u32,
    /// Number of this map, and of all maps.
    map: u32,
    maps: u32,
    /// First slot of this map and number of slots it fills (all, grid), or of all slots (importance).
    first_slot: u32,
    slots: u32,
    /// Cells along each side (grid).
    cells: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> selection: Selection;
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> texels: array<Texel>;
@group(0) @binding(4) var<storage, read_write> slots: array<Vpl>;
@group(0) @binding(5) var<storage, read> nodes: array<Node>;
@group(0) @binding(6) var<storage, read> tops: array<Node>;
@group(0) @binding(7) var<storage, read> points: array<vec2<f32>>;

const NONE: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn vpls_all(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < selection.slots {
        slots[selection.first_slot + i] = all_texels(i);
    }
}

@compute @workgroup_size(64)
fn vpls_grid(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < selection.slots {
        slots[selection.first_slot + i] = grid(selection.resolution, selection.cells, i);
    }
}

@compute @workgroup_size(64)
fn vpls_importance(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < selection.slots {
        importance(i, points[i]);
    }
}

fn has_flux(flux: vec3<f32>) -> bool {
    return flux.x + flux.y + flux.z > 0.0;
}

/// The VPL of one texel, its flux and area multiplied by scale.
fn vpl_of_texel(i: u32, scale: f32) -> Vpl {
    let t = texels[i];
    return Vpl(positions[i].xyz, t.area * scale, normals[i].xyz, 0.0, t.reflected * scale, 0.0);
}

/// The texel itself.
fn all_texels(texel: u32) -> Vpl {
    if has_flux(texels[texel].reflected) {
        return vpl_of_texel(texel, 1.0);
    }
    return Vpl();
}

/// Flux and area of the whole cell, at the reflecting texel nearest to the cell's centre.
fn grid(n: u32, cells: u32, cell: u32) -> Vpl {
    let column = cell % cells;
    let row = cell / cells;
    let x_begin = column * n / cells;
    let x_end = (column + 1u) * n / cells;
    let y_begin = row * n / cells;
    let y_end = (row + 1u) * n / cells;
    // Four times the cell's centre, nudged by turns: see the twin.
    let centre_x = i32(2u * (x_begin + x_end) - 1u + 2u * (column % 2u));
    let centre_y = i32(2u * (y_begin + y_end) - 1u + 2u * (row % 2u));
    var flux = vec3(0.0);
    var area = 0.0;
    var nearest = NONE;
    var texel = 0u;
    for (var y = y_begin; y < y_end; y++) {
        for (var x = x_begin; x < x_end; x++) {
            let i = y * n + x;
            let t = texels[i];
            if has_flux(t.reflected) {
                flux += t.reflected;
                area += t.area;
                let dx = i32(4u * x + 2u) - centre_x;
                let dy = i32(4u * y + 2u) - centre_y;
                let distance = u32(dx * dx + dy * dy);
                if distance < nearest {
                    nearest = distance;
                    texel = i;
                }
            }
        }
    }
    if nearest == NONE {
        return Vpl();
    }
    return Vpl(positions[texel].xyz, area, normals[texel].xyz, 0.0, flux, 0.0);
}

/// Draws a map in proportion to its reflected luminance and, if it is this one, a texel of it. The first map also clears
/// the slots that no map will fill.
fn importance(slot: u32, u: vec2<f32>) {
    var total = 0.0;
    for (var i = 0u; i < selection.maps; i++) {
        total += luminance(tops[i].reflected);
    }
    // The map in whose share of the total u.x falls; rounding at the end falls to the last map that has any.
    var chosen = NONE;
    var fraction = 0.0;
    var x = u.x * total;
    for (var i = 0u; i < selection.maps; i++) {
        let share = luminance(tops[i].reflected);
        if share > 0.0 {
            chosen = i;
            fraction = x / share;
            if x < share {
                break;
            }
            x -= share;
        }
    }
    if chosen == NONE && selection.map == 0u {
        slots[slot] = Vpl();
    }
    if chosen == selection.map {
        let sample = warp_sample(vec2(fraction, u.y), vec2(selection.resolution));
        let texel = sample.texel.y * selection.resolution + sample.texel.x;
        let p = luminance(tops[chosen].reflected) / total * sample.pdf;
        slots[slot] = vpl_of_texel(texel, 1.0 / (p * f32(selection.slots)));
    }
}

/// Importance of a node.
fn warp_weight(i: u32) -> f32 {
    return luminance(nodes[i].reflected);
}
