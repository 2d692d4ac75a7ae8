// The light of a pixel's part of the virtual lights at a receiver. The module declares `settings`, `vpls` and `summary`, and
// a file that is included beside this one says what `shadow_visible` asks.
// Twin: Lights in crates/instant-radiosity/src/cpu/gather.rs.

/// The part of the virtual lights that a pixel takes.
fn part_of_pixel(pixel: u32) -> u32 {
    let n = settings.interleave;
    return (pixel / settings.width) % n * n + pixel % settings.width % n;
}

/// Virtual lights of each part and bounce.
fn run_length() -> u32 {
    return settings.per_bounce / (settings.interleave * settings.interleave);
}

/// The slot of the k-th light of a part.
fn slot_of(part: u32, k: u32) -> u32 {
    let run = run_length();
    return k / run * settings.per_bounce + part * run + k % run;
}

/// Factor between flux and irradiance if nothing stood in between, for a light bounded by `area`.
fn unshadowed_factor(vpl: Vpl, area: f32, p: vec3<f32>, n: vec3<f32>) -> f32 {
    let v = vpl.position - p;
    let d2 = dot(v, v);
    let cosines = max(dot(n, v), 0.0) * max(-dot(vpl.normal, v), 0.0);
    let kernel = cosines * FRAC_1_PI / (d2 * d2);
    // False for NaN too: a light that coincides with the receiver gives nothing.
    if !(kernel > 0.0 && kernel < 0x1.fffffep+127f) {
        return 0.0;
    }
    return bounded(kernel, area);
}

/// What a light would give a receiver if nothing stood in between, W/m².
fn unshadowed(slot: u32, p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let vpl = vpls[slot];
    let area = select(vpl.area, summary.area, settings.compensated == 1u);
    let is_last = slot >= settings.per_bounce * (settings.bounces - 1u);
    let flux = select(vpl.flux, vpl.flux * summary.tail, is_last);
    return flux * unshadowed_factor(vpl, area, p, n);
}

/// What the pixel decided, in 24 bits that a float holds: which lights it asked, and what stood in between.
var<private> choices: u32 = 0u;

fn note(choice: u32) {
    choices = (choices * 31u + choice) & 0x00ffffffu;
}

fn asks(slot: u32, p: vec3<f32>, n: vec3<f32>) -> bool {
    let visible = shadow_visible(slot, vpls[slot].position, vpls[slot].normal, p, n);
    note(2u * slot + u32(visible));
    return visible;
}

/// Irradiance that the lights `first .. end` of a part, each scaled to all parts, cast on a receiver, W/m²; `tests` of them
/// are asked, or all where that is 0.
fn lights_at(
    part: u32, first: u32, end: u32, p: vec3<f32>, n: vec3<f32>, tests: u32, u: f32,
) -> vec3<f32> {
    let scale = f32(settings.interleave * settings.interleave);
    var sum = vec3(0.0);
    if tests == 0u {
        for (var k = first; k < end; k++) {
            let slot = slot_of(part, k);
            let e = unshadowed(slot, p, n);
            if any(e != vec3(0.0)) {
                if asks(slot, p, n) {
                    sum += e;
                }
            }
        }
        return sum * scale;
    }
    var total = 0.0;
    for (var k = first; k < end; k++) {
        total += luminance(unshadowed(slot_of(part, k), p, n));
    }
    if total <= 0.0 {
        return sum;
    }
    // Evenly spaced places on the running sum: a light is tested in proportion to what it gives, and once at most.
    let step = total / f32(tests);
    var next = u * step;
    var running = 0.0;
    for (var k = first; k < end; k++) {
        let slot = slot_of(part, k);
        let e = unshadowed(slot, p, n);
        let weight = luminance(e);
        running += weight;
        if running > next {
            let times = ceil((running - next) / step);
            next += times * step;
            if asks(slot, p, n) {
                sum += e * (times * step / weight);
            }
        }
    }
    return sum * scale;
}
