// What a ray meets, through the two grids. Needs voxels: array<Voxel>, voxel_normals: array<u32>.
// Twins: Sight::look in crates/sh-grid-raytracer/src/cpu/field.rs, crates/sh-grid-raytracer/src/cpu/traverse.rs.

/// A boundary cell: a bit for each of its fine cells, and where their normals begin.
struct Voxel {
    low: u32,
    high: u32,
    first_normal: u32,
    pad0: u32,
}

const LEAST_SLOPE: f32 = 1e-9;
const CLEAR: f32 = 1.01;

/// Steps through a grid from cell to cell.
struct Walk {
    cell: vec3<i32>,
    step: vec3<i32>,
    next: vec3<f32>,
    delta: vec3<f32>,
    t: f32,
}

fn walk_from(
    origin: vec3<f32>,
    inverse: vec3<f32>,
    start: vec3<f32>,
    t: f32,
    side: f32,
    low: vec3<f32>,
    last: vec3<i32>,
) -> Walk {
    let cell = clamp(vec3<i32>(floor((start - low) / side)), vec3(0), last);
    let up = inverse >= vec3(0.0);
    let border = low + vec3<f32>(cell + select(vec3(0), vec3(1), up)) * side;
    return Walk(cell, select(vec3(-1), vec3(1), up), (border - origin) * inverse, abs(inverse) * side, t);
}

fn walk_advance(walk: Walk) -> Walk {
    var w = walk;
    if w.next.x <= w.next.y && w.next.x <= w.next.z {
        w.t = w.next.x;
        w.cell.x += w.step.x;
        w.next.x += w.delta.x;
    } else if w.next.y <= w.next.z {
        w.t = w.next.y;
        w.cell.y += w.step.y;
        w.next.y += w.delta.y;
    } else {
        w.t = w.next.z;
        w.cell.z += w.step.z;
        w.next.z += w.delta.z;
    }
    return w;
}

fn is_within(cell: vec3<i32>, size: vec3<i32>) -> bool {
    return all(cell >= vec3(0)) && all(cell < size);
}

fn voxel_rank(voxel: Voxel, bit: u32) -> u32 {
    if bit < 32u {
        return countOneBits(voxel.low & ((1u << bit) - 1u));
    }
    return countOneBits(voxel.low) + countOneBits(voxel.high & ((1u << (bit - 32u)) - 1u));
}

fn look_along(origin: vec3<f32>, direction: vec3<f32>, area: f32) -> Look {
    var look: Look;
    look.place = NO_CELL;
    look.origin = grid_local(origin);
    look.direction = direction;
    let size = abs(direction);
    let least = max(size.x, max(size.y, size.z)) * LEAST_SLOPE;
    let inverse = 1.0 / select(direction, vec3(least), size < vec3(least));
    let cells = vec3<i32>(settings.size);
    let fine_cells = vec3(i32(FINE));
    let side = 1.0 / f32(FINE);
    var walk = walk_from(look.origin, inverse, look.origin, 0.0, 1.0, vec3(0.0), cells - 1);
    while is_within(walk.cell, cells) {
        let cell = vec3<u32>(walk.cell);
        let place = cell_index[grid_number(cell, settings.size)];
        if place < settings.boundary {
            let voxel = voxels[place];
            let low = vec3<f32>(cell);
            let start = look.origin + direction * walk.t;
            var fine = walk_from(look.origin, inverse, start, walk.t, side, low, fine_cells - 1);
            while is_within(fine.cell, fine_cells) {
                let at = vec3<u32>(fine.cell);
                let bit = (at.z * FINE + at.y) * FINE + at.x;
                let word = select(voxel.high, voxel.low, bit < 32u);
                if ((word >> (bit & 31u)) & 1u) != 0u {
                    let centre = low + (vec3<f32>(fine.cell) + 0.5) * side;
                    let away = abs(centre - look.origin);
                    if max(away.x, max(away.y, away.z)) > CLEAR * side {
                        look.place = place;
                        look.mark = place * 64u + bit + 1u;
                        look.cell = cell;
                        let n = octahedral_unpack(voxel_normals[voxel.first_normal + voxel_rank(voxel, bit)]);
                        look.normal = select(n, -n, dot(n, direction) > 0.0);
                        look.distance = fine.t;
                        look.area = area * fine.t * fine.t;
                        return look;
                    }
                }
                fine = walk_advance(fine);
            }
        }
        walk = walk_advance(walk);
    }
    return look;
}
