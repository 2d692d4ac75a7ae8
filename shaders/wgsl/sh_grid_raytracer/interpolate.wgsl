// The field at a point of a surface: from the 27 cells around it. Needs cell_index, field_cells, between(p, n, v).
// Twin: crates/sh-grid-raytracer/src/cpu/interpolate.rs.

/// How far in front of a surface a cell's centre lies from which on its weight is full, in cells.
const FULL_SIDE: f32 = 0.25;

/// A number that differs where other cells count.
var<private> choices: u32;

/// Which cells count: those that are visible, those on the side that the surface faces, all.
const RULE_VISIBLE: u32 = 0u;
const RULE_SIDE: u32 = 1u;
const RULE_AS_PRINTED: u32 = 2u;

var<private> coefficients: array<vec4<f32>, 16>;

/// Coefficients at the point p of a surface with the normal n. Where no cell counts, those do that the next less strict rule lets.
fn field_at(p: vec3<f32>, n: vec3<f32>) -> array<vec4<f32>, 16> {
    for (var rule = settings.weights; rule <= RULE_AS_PRINTED; rule++) {
        let total = add_cells(p, n, rule);
        if total > 0.0 {
            let scale = 1.0 / total;
            for (var c = 0u; c < settings.coefficients; c++) {
                coefficients[c] *= scale;
            }
            break;
        }
    }
    return coefficients;
}

/// Adds the cells that a rule lets count and returns the sum of their weights.
fn add_cells(p: vec3<f32>, n: vec3<f32>, rule: u32) -> f32 {
    let x = grid_local(p);
    // No cell is near; NaN is nowhere.
    if !(all(x >= vec3(-1.0)) && all(x <= vec3<f32>(settings.size) + 1.0)) {
        return 0.0;
    }
    let home = vec3<i32>(floor(x));
    let size = vec3<i32>(settings.size);
    var total = 0.0;
    for (var k = 0; k < 27; k++) {
        let cell = home + vec3(k % 3, k / 3 % 3, k / 9) - 1;
        if any(cell < vec3(0)) || any(cell >= size) {
            continue;
        }
        let place = cell_index[grid_number(vec3<u32>(cell), settings.size)];
        let v = vec3<f32>(cell) + 0.5 - x;
        let weight = cell_weight(v, n, rule);
        if place == NO_CELL || weight <= 0.0 || (rule == RULE_VISIBLE && !is_visible(p, n, v)) {
            continue;
        }
        for (var c = 0u; c < settings.coefficients; c++) {
            coefficients[c] += field_cells[place * settings.coefficients + c] * weight;
        }
        total += weight;
        choices += place + 1u;
    }
    return total;
}

/// Of a cell whose centre is v cells away.
fn cell_weight(v: vec3<f32>, n: vec3<f32>, rule: u32) -> f32 {
    let r = length(v) / settings.reach;
    if r >= 1.0 {
        return 0.0;
    }
    let near = (2.0 * r - 3.0) * r * r + 1.0;
    if rule == RULE_AS_PRINTED {
        return near;
    }
    return near * clamp(dot(n, v) / FULL_SIDE, 0.0, 1.0);
}
