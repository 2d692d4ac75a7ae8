//! Frames of a renderer, measured.

use std::time::Instant;

use indirect_core::Image;

use super::model::{Pass, Renderer};
use crate::failure::Outcome;
use crate::stage::Stage;

/// Frames of one renderer, measured.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) indirect: Image,
    /// Median.
    pub(crate) frame_ms: f64,
    pub(crate) frames: usize,
    pub(crate) passes: Vec<Pass>,
}

/// Renders a frame to warm up, then frames until the time is spent: at least `least`, at most 15. The image is that of frame number
/// `settled`, whatever the time that frames took, so that another run finds the same.
pub(crate) fn measure(
    renderer: &mut dyn Renderer,
    stage: &Stage<'_>,
    (least, settled): (usize, usize),
    seconds: f64,
) -> Outcome<Measured> {
    const MOST: usize = 15;
    // The first frame on a GPU may wait a second for its shaders: only one that takes much longer counts as a frame.
    const LONG_MS: f64 = 4e3;
    let start = Instant::now();
    let first = renderer.frame(stage)?;
    for _ in 1..settled {
        renderer.frame(stage)?;
    }
    let indirect = renderer.image()?;
    let start = if settled > 1 { Instant::now() } else { start };
    let mut times = if first > LONG_MS.max(seconds * 1e3) { vec![first] } else { Vec::new() };
    while times.len() < least || (times.len() < MOST && start.elapsed().as_secs_f64() < seconds) {
        times.push(renderer.frame(stage)?);
    }
    times.sort_by(f64::total_cmp);
    Ok(Measured {
        frame_ms: times[(times.len() - 1) / 2],
        frames: times.len(),
        indirect,
        passes: renderer.passes(stage)?,
    })
}
