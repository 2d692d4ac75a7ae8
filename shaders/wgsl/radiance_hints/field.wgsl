// field: interpolating the field between hints.
// Twin: crates/radiance-hints/src/cpu/field.rs.
// Papaioannou 2011, §5; the including module binds `settings`, `lattice` and `hints`.

const LEAST_SHARE: f32 = 1e-7;

/// A plane in front of which hints are read and behind which they are not; all are where strength is 0.
struct Plane {
    point: vec3<f32>,
    strength: f32,
    normal: vec3<f32>,
}

fn plane_share(plane: Plane, hint: vec3<f32>, cell: vec3<f32>) -> f32 {
    if plane.strength == 0.0 {
        return 1.0;
    }
    let side = dot(plane.normal, hint - plane.point);
    return clamp(8.0 * side / dot(abs(plane.normal), cell), LEAST_SHARE, 1.0);
}

/// The weight of a volume at a point: 0 outside, 1 from a cell within its border on.
fn volume_inside(v: u32, q: vec3<f32>) -> f32 {
    let volume = lattice.volume[v];
    let t = (q - volume.origin) / volume.cell;
    let border = min(t, vec3<f32>(volume.resolution) - t);
    return clamp(min(min(border.x, border.y), border.z), 0.0, 1.0);
}

/// The field of one hint, weighed coefficient by coefficient.
fn hint_weigh(hint: u32, low_band: vec4<f32>, high_band: vec4<f32>, last_band: f32) -> vec3<f32> {
    let first = hint * settings.vectors;
    var value = vec3(
        dot(hints[first], low_band), dot(hints[first + 1u], low_band), dot(hints[first + 2u], low_band),
    );
    if settings.vectors == 7u {
        value += vec3(
            dot(hints[first + 3u], high_band), dot(hints[first + 4u], high_band), dot(hints[first + 5u], high_band),
        ) + hints[first + 6u].xyz * last_band;
    }
    return value;
}

/// The hint whose cell holds q, in the first volume that has at least half of the weight there.
fn nearest_hint(q: vec3<f32>) -> u32 {
    var v = 0u;
    while v + 1u < lattice.volumes && volume_inside(v, q) < 0.5 {
        v += 1u;
    }
    let r = lattice.volume[v].resolution;
    let t = floor((q - lattice.volume[v].origin) / lattice.volume[v].cell);
    let place = vec3<u32>(clamp(t, vec3(0.0), vec3<f32>(r) - 1.0));
    return lattice.volume[v].first + (place.z * r.y + place.y) * r.x + place.x;
}

/// Diagonal of a cell at q, blended as the field is.
fn field_diagonal(q: vec3<f32>) -> f32 {
    var diagonal = 0.0;
    var rest = 1.0;
    for (var v = 0u; v < lattice.volumes; v++) {
        var weight = rest;
        if v + 1u < lattice.volumes {
            weight = rest * volume_inside(v, q);
        }
        if weight > 0.0 {
            diagonal += length(lattice.volume[v].cell) * weight;
        }
        rest -= weight;
    }
    return diagonal;
}

/// The field at q, weighed coefficient by coefficient, and the mean distance of the hints it is read from to the plane.
fn field_weigh(q: vec3<f32>, plane: Plane, w: array<f32, 9>) -> vec4<f32> {
    let low_band = vec4(w[0], w[1], w[2], w[3]);
    let high_band = vec4(w[4], w[5], w[6], w[7]);
    let last_band = w[8];
    var result = vec3(0.0);
    var height = 0.0;
    var rest = 1.0;
    for (var v = 0u; v < lattice.volumes; v++) {
        var weight = rest;
        if v + 1u < lattice.volumes {
            weight = rest * volume_inside(v, q);
        }
        if weight > 0.0 {
            let origin = lattice.volume[v].origin;
            let cell = lattice.volume[v].cell;
            let r = lattice.volume[v].resolution;
            let first = lattice.volume[v].first;
            let last = vec3<f32>(r) - 1.0;
            let g = clamp((q - origin) / cell - 0.5, vec3(0.0), last);
            let lowest = min(floor(g), max(last - 1.0, vec3(0.0)));
            let t = g - lowest;
            let low_place = vec3<u32>(lowest);
            var sum = vec3(0.0);
            var total = 0.0;
            var side = 0.0;
            for (var corner = 0u; corner < 8u; corner++) {
                let bit = vec3(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
                let part = select(1.0 - t, t, bit == vec3(1u));
                let trilinear = part.x * part.y * part.z;
                if trilinear > 0.0 {
                    let place = min(low_place + bit, r - 1u);
                    let position = origin + cell * (vec3<f32>(place) + 0.5);
                    let share = trilinear * plane_share(plane, position, cell);
                    side += dot(plane.normal, position - plane.point) * share;
                    let hint = first + (place.z * r.y + place.y) * r.x + place.x;
                    sum += hint_weigh(hint, low_band, high_band, last_band) * share;
                    total += share;
                }
            }
            result += sum * (weight / total);
            height += side * (weight / total);
        }
        rest -= weight;
    }
    return vec4(result, height);
}

/// The clamped cosine about n.
fn cosine_lobe(n: vec3<f32>) -> array<f32, 9> {
    return sh_lobe_l2(SH_COSINE, n);
}
