// gather: the irradiance that a pixel's part of the virtual lights casts on it, interleaved.
// Twin: crates/instant-radiosity/src/cpu/gather.rs.
// Source: Keller & Heidrich 2001, "Interleaved Sampling"; thesis §3.4.1.

/// Lights of each part, counted through the bounces, that a dispatch sums.
struct LightRange {
    first: u32,
    end: u32,
    /// Number of the dispatch.
    number: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> lights_range: LightRange;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(5) var<uniform> summary: Summary;
@group(0) @binding(6) var<storage, read_write> gathered: array<vec4<f32>>;

@compute @workgroup_size(64)
fn gather(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    // Pixels of one part follow each other, as in a split G-buffer: a workgroup reads the same lights.
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let n = settings.interleave;
    let across = (settings.width + n - 1u) / n;
    let down = (settings.height + n - 1u) / n;
    let part = i / (across * down);
    let within = i % (across * down);
    let x = within % across * n + part % n;
    let y = within / across * n + part / n;
    if part >= n * n || x >= settings.width || y >= settings.height {
        return;
    }
    let pixel = y * settings.width + x;
    var sum = vec3(0.0);
    if lights_range.number > 0u {
        sum = gathered[pixel].xyz;
        choices = u32(gathered[pixel].w);
    }
    let normal = normals[pixel].xyz;
    if any(normal != vec3(0.0)) {
        let u = pixel_number(pixel, settings.seed, lights_range.number);
        sum += lights_at(part, lights_range.first, lights_range.end, positions[pixel].xyz, normal, settings.tests, u);
    }
    gathered[pixel] = vec4(sum, f32(choices));
}
