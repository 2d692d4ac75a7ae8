// look: which samples a hint reads, and the point in its cell from which each is seen.
// Twin: crates/radiance-hints/src/cpu/look.rs.
// The including module declares `samples`, those of the lists and, behind them, those of the hints' windows; and `windows`.
// Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences".

/// The number of the list of samples that a hint reads.
fn list_of(hint: u32) -> u32 {
    if settings.sampling == 1u {
        return hint;
    }
    let place = lattice_place(hint) % INTERLEAVE;
    return spread(place.x) | (spread(place.y) << 1u) | (spread(place.z) << 2u);
}

/// A sample, and the factor of its flux and area.
struct Look {
    sample: Sample,
    scale: f32,
}

/// The window of a hint; an empty one where there are none.
fn window_of(hint: u32) -> Window {
    if settings.near == 0u {
        return Window();
    }
    return windows[hint];
}

/// Sample `k` of a hint with this window, whose list begins at `first`. A hint with a window takes that much fewer from its
/// list, each of which stands for more; the factor is 0 for those that lie within the window.
fn look(hint: u32, window: Window, first: u32, k: u32) -> Look {
    var far = settings.samples;
    if any(window.end != window.first) {
        far -= settings.near;
    }
    if k >= far {
        let lists = INTERLEAVE * INTERLEAVE * INTERLEAVE * settings.samples;
        return Look(samples[lists + hint * settings.near + (k - far)], 1.0);
    }
    let s = samples[first + k];
    let at = vec2(s.texel % settings.resolution, s.texel / settings.resolution);
    let within = s.map == window.map && all(at >= window.first) && all(at < window.end);
    return Look(s, select(f32(settings.samples) / f32(far), 0.0, within));
}

/// The two lowest bits, spread three apart.
fn spread(x: u32) -> u32 {
    return (x & 1u) | ((x & 2u) << 2u);
}

/// The offset of a hint in the recurrence.
fn shift_of(seed: u32, hint: u32) -> vec3<u32> {
    let h = hash_combine(seed, hint);
    return vec3(h, hash_combine(h, 1u), hash_combine(h, 2u));
}

/// The point in its cell from which a hint at `position` sees its sample `k`.
fn place_of(position: vec3<f32>, cell: vec3<f32>, jitter: f32, shift: vec3<u32>, k: u32) -> vec3<f32> {
    let bits = shift + k * vec3(3518319155u, 2882110345u, 2360945575u);
    let offset = vec3(unit_f32(bits.x), unit_f32(bits.y), unit_f32(bits.z)) - 0.5;
    return position + cell * offset * jitter;
}
