// Indirect radiance, added to what Bevy has drawn.

struct Settings {
    size: vec2<u32>,
    scale: f32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> image: array<vec4<f32>>;

@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(at.xy), settings.size - 1u);
    return vec4<f32>(image[pixel.y * settings.size.x + pixel.x].xyz * settings.scale, 0.0);
}
