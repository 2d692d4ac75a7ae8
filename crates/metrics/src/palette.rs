//! Colours for error maps.

use glam::Vec3;
use indirect_core::Image;

use crate::flip::FlipMap;

/// Control points of the heat palette, sRGB, evenly spaced: black through violet, red and orange to pale yellow, with a
/// luminance that only rises, so that it also reads in grey and with colour-blind eyes.
const HEAT: [[u8; 3]; 9] = [
    [0, 0, 6],
    [30, 16, 74],
    [78, 20, 118],
    [128, 36, 128],
    [184, 54, 118],
    [228, 84, 96],
    [248, 136, 84],
    [252, 194, 120],
    [253, 250, 200],
];

/// The heat colour of `t`, clamped to `[0, 1]`, as sRGB bytes; NaN is the colour of 0.
#[must_use]
pub fn heat(t: f32) -> [u8; 3] {
    let last = HEAT.len() - 1;
    let p = t.clamp(0.0, 1.0) * last as f32;
    let i = (p as usize).min(last - 1);
    let f = if p.is_nan() { 0.0 } else { p - i as f32 };
    core::array::from_fn(|c| {
        let (a, b) = (f32::from(HEAT[i][c]), f32::from(HEAT[i + 1][c]));
        (a + (b - a) * f).round() as u8
    })
}

/// A FLIP map in [`heat`] colours as a linear image: encoded as sRGB at exposure 1 it has exactly those bytes.
#[must_use]
pub fn heat_map(map: &FlipMap) -> Image {
    let pixels = map.values.iter().map(|v| Vec3::from(heat(*v).map(linear_from_srgb))).collect();
    Image { size: map.size, pixels }
}

fn linear_from_srgb(byte: u8) -> f32 {
    let c = f32::from(byte) / 255.0;
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_only_rises() {
        let grey = |t: f32| {
            let [r, g, b] = heat(t).map(|v| (f32::from(v) / 255.0).powf(2.2));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..200 {
            assert!(grey((i + 1) as f32 / 200.0) >= grey(i as f32 / 200.0), "at {i}");
        }
        assert_eq!(heat(f32::NAN), heat(0.0));
        assert_eq!((heat(-1.0), heat(2.0)), (HEAT[0], HEAT[8]));
    }
}
