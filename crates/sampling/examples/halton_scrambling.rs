//! Draws what scrambling repairs: the first 256 Halton points in bases 59 and 61, plain, with Faure's permutations, and
//! with Owen's scrambling.
//!
//! ```text
//! cargo run --release -p indirect-sampling --example halton_scrambling [FILE.png]
//! ```

use std::{env, error::Error, fs::File, io::BufWriter, path::PathBuf};

use indirect_sampling::halton::{Halton, Scrambling};

const PANEL: usize = 300;
const MARGIN: usize = 12;
const WIDTH: usize = 3 * PANEL + 4 * MARGIN;
const HEIGHT: usize = PANEL + 2 * MARGIN;

fn main() -> Result<(), Box<dyn Error>> {
    let in_docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/halton_scrambling.png");
    let path = env::args_os().nth(1).map_or_else(|| PathBuf::from(in_docs), PathBuf::from);
    let mut image = vec![225_u8; WIDTH * HEIGHT];
    let panels = [Scrambling::None, Scrambling::Faure, Scrambling::Owen(1)];
    for (panel, scrambling) in panels.into_iter().enumerate() {
        let left = MARGIN + panel * (PANEL + MARGIN);
        for row in image.chunks_mut(WIDTH).skip(MARGIN).take(PANEL) {
            row[left..left + PANEL].fill(255);
        }
        let [x, y] = [16, 17].map(|dimension| Halton::dimension(dimension, scrambling));
        for i in 0..256 {
            let at = |u: f32| u * PANEL as f32;
            disc(&mut image, left as f32 + at(x.sample(i)), MARGIN as f32 + at(1.0 - y.sample(i)));
        }
    }
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(&path)?), WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&image)?;
    eprintln!("{}", path.display());
    Ok(())
}

/// Darkens the pixels that a disc covers, those on its rim in part.
fn disc(image: &mut [u8], x: f32, y: f32) {
    const RADIUS: f32 = 2.6;
    for py in 0..HEIGHT {
        for px in 0..WIDTH {
            let distance = (px as f32 + 0.5 - x).hypot(py as f32 + 0.5 - y);
            let cover = (RADIUS + 0.5 - distance).clamp(0.0, 1.0);
            let pixel = &mut image[py * WIDTH + px];
            *pixel = (f32::from(*pixel) * (1.0 - cover) + 30.0 * cover) as u8;
        }
    }
}
