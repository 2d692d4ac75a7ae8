// Radiance that leaves a cell of the R-grid. Needs cell_index and faces: array<Faces>.
// Twin: crates/sh-grid-raytracer/src/cpu/lookup.rs.

/// Where a ray ends, as the R-grid sees it.
struct Look {
    /// Place of the boundary cell; NO_CELL where the ray leads out of the scene.
    place: u32,
    cell: vec3<u32>,
    /// Of the surface, towards the ray's origin.
    normal: vec3<f32>,
    /// In units of cells.
    origin: vec3<f32>,
    direction: vec3<f32>,
    /// Perpendicular to the direction, in faces of a cell.
    area: f32,
    /// In units of cells.
    distance: f32,
    /// A number of what was met: of a triangle or of a fine cell.
    mark: u32,
}

const FRAC_1_PI: f32 = 0.31830988618;
const LEAST_COSINE: f32 = 1e-3;
const LEAST: f32 = 1e-30;

fn look_radiance(look: Look) -> vec3<f32> {
    if settings.printed == 1u {
        return radiance_as_printed(look);
    }
    return radiance_by_area(look);
}

fn place_at(look: Look, level: u32) -> u32 {
    if level == 0u {
        return look.place;
    }
    let size = settings.grid_levels[level].size;
    let number = grid_number(look.cell >> vec3(level), size);
    return cell_index[settings.grid_levels[level].cube + number];
}

/// The level whose faces have an area, in those of level 0, with the share of the next.
fn level_of(area: f32) -> f32 {
    return min(0.5 * log2(max(area, 1.0)), f32(settings.levels - 1u));
}

fn radiance_by_area(look: Look) -> vec3<f32> {
    let cosine = max(-dot(look.normal, look.direction), LEAST_COSINE);
    let level = level_of(look.area / cosine);
    let share = fract(level);
    var sum = radiance_by_area_at(look, u32(level)) * (1.0 - share);
    if share > 0.0 {
        sum += radiance_by_area_at(look, u32(level) + 1u) * share;
    }
    return sum * FRAC_1_PI;
}

fn facing_sum(look: Look, level: u32) -> vec4<f32> {
    let place = place_at(look, level);
    let w = face_shares(look.normal);
    var sum = faces[place].faces[0] * w.below.x;
    sum += faces[place].faces[1] * w.above.x;
    sum += faces[place].faces[2] * w.below.y;
    sum += faces[place].faces[3] * w.above.y;
    sum += faces[place].faces[4] * w.below.z;
    sum += faces[place].faces[5] * w.above.z;
    return sum;
}

fn radiance_by_area_at(look: Look, level: u32) -> vec3<f32> {
    let side = settings.grid_levels[level].cell;
    let least = settings.least_area * side * side;
    let own = facing_sum(look, level);
    // What a surface only touches has few photons: the level after stands for what its area lacks.
    let lacking = max(least - own.w, 0.0);
    var flux = own.xyz;
    if lacking > 0.0 {
        let next = facing_sum(look, min(level + 1u, settings.levels - 1u));
        flux += next.xyz * (lacking / max(max(next.w, least), LEAST));
    }
    return flux / max(own.w + lacking, LEAST);
}

fn radiance_as_printed(look: Look) -> vec3<f32> {
    let centre = vec3<f32>(look.cell) + 0.5;
    var sum = vec3(0.0);
    var weights = 0.0;
    for (var j = 0u; j < 6u; j++) {
        var n = vec3(0.0);
        n[j / 2u] = select(-1.0, 1.0, (j & 1u) == 1u);
        let to = centre + n * 0.5 - look.origin;
        let distance = max(length(to), LEAST);
        let v = to / distance;
        let cos_beta = -dot(n, v);
        if cos_beta <= 0.0 {
            continue;
        }
        // The chord stands for the angle: it keeps its digits where that is small.
        let alpha = length(v - look.direction) * max(distance, 0.5) * 2.0;
        let g = max(exp(-0.5 * alpha * alpha), LEAST);
        let level = level_of(look.area / cos_beta);
        let share = fract(level);
        var l = face_radiance(look, u32(level), j) * (1.0 - share);
        if share > 0.0 {
            l += face_radiance(look, u32(level) + 1u, j) * share;
        }
        sum += l * (g * cos_beta);
        weights += g;
    }
    if weights > 0.0 {
        return sum * (FRAC_1_PI / weights);
    }
    return vec3(0.0);
}

fn face_radiance(look: Look, level: u32, face: u32) -> vec3<f32> {
    let f = faces[place_at(look, level)].faces[face];
    return f.xyz / max(f.w, LEAST);
}
