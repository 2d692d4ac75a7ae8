// field: spherical harmonics of the radiance that arrives at the centres of the active cells, and of the distance from where. Some
// directions at a time: software renderers end a shader's loops after 65 535 rounds.
// Twin: crates/sh-grid-raytracer/src/cpu/field.rs.

/// Directions of a dispatch.
struct DirectionRange {
    first: u32,
    end: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> directions: DirectionSet;
@group(0) @binding(2) var<uniform> range: DirectionRange;
@group(0) @binding(3) var<storage, read> active_cells: array<u32>;
@group(0) @binding(4) var<storage, read> cell_index: array<u32>;
@group(0) @binding(5) var<storage, read> faces: array<Faces>;
@group(0) @binding(6) var<storage, read_write> field_cells: array<vec4<f32>>;

/// Of each cell a number that differs where its rays end elsewhere.
@group(0) @binding(10) var<storage, read_write> seen: array<u32>;

const PI: f32 = 3.14159265358979;

@compute @workgroup_size(64)
fn field(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.cells {
        return;
    }
    let number = active_cells[i];
    let origin = grid_centre(grid_cell(number));
    let weight = 4.0 * PI / f32(settings.directions);
    let area = select(0.0, weight, settings.footprint == 1u);
    let turn = 3u * (hash_combine(settings.seed, number) % TURNS);
    var sums: array<vec4<f32>, 16>;
    var places = 0u;
    if range.first > 0u {
        places = seen[i];
        for (var k = 0u; k < settings.coefficients; k++) {
            sums[k] = field_cells[i * settings.coefficients + k];
        }
    }
    for (var j = range.first; j < range.end; j++) {
        var d = directions.directions[j].xyz;
        if settings.turned == 1u {
            d = directions.turns[turn].xyz * d.x + directions.turns[turn + 1u].xyz * d.y
                + directions.turns[turn + 2u].xyz * d.z;
        }
        let look = look_along(origin, d, area);
        var value = vec4(0.0, 0.0, 0.0, settings.far);
        if look.place != NO_CELL {
            value = vec4(look_radiance(look), look.distance * settings.cell);
            places += look.mark;
        }
        value *= weight;
        let y = field_basis(d);
        for (var k = 0u; k < settings.coefficients; k++) {
            sums[k] += value * y[k];
        }
    }
    for (var k = 0u; k < settings.coefficients; k++) {
        field_cells[i * settings.coefficients + k] = sums[k];
    }
    seen[i] = places;
}
