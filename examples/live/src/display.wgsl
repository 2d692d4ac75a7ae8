// Radiance to a picture: exposure, then Reinhard's curve per channel, and the sRGB curve where the target has none of its own.

struct Settings {
    size: vec2<u32>,
    exposure: f32,
    encode: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> image: array<vec4<f32>>;

@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers all.
    return vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i & 2u) * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(at.xy), settings.size - 1u);
    let radiance = image[pixel.y * settings.size.x + pixel.x].xyz * settings.exposure;
    var color = radiance / (1.0 + radiance);
    if settings.encode != 0u {
        color = select(1.055 * pow(color, vec3<f32>(1.0 / 2.4)) - 0.055, color * 12.92, color <= vec3<f32>(0.0031308));
    }
    return vec4<f32>(color, 1.0);
}
