//! Frames on the CPU.

use indirect_accel::Accel;
use indirect_core::{GBuffer, PassTime, View};
use web_time::Instant;

use crate::{Frame, Technique};

/// A technique that is made ready for a scene on the CPU.
pub trait Fit: Technique {
    /// Settings with what the scene adds to them: bounds, what surrounds it, whatever rays tell.
    ///
    /// # Errors
    /// Where a setting is out of range.
    fn fit(
        accel: &Accel<'_>,
        options: Self::Options,
        params: Self::Params,
    ) -> Result<Self::Setup, Self::Error>;

    /// Follows a scene whose lights, cameras or vertices may have moved since the setup was made or followed last; their numbers
    /// are the same. For techniques that keep something of the geometry: most keep nothing.
    fn refit(_setup: &mut Self::Setup, _accel: &Accel<'_>) {}
}

impl<'a, S> Frame<'a, S> {
    /// A frame of what `view` sees, which is `camera`.
    #[must_use]
    pub fn new(accel: &'a Accel<'a>, view: &'a View, camera: &'a GBuffer, setup: &'a S) -> Self {
        Self { accel, scene: accel.scene(), view, camera, setup }
    }
}

/// Runs all passes of a frame and returns their times. `output` is that of the frame before, or a new one: a technique that looks
/// back finds its past there.
pub fn run<T: Technique>(frame: &Frame<'_, T::Setup>, output: &mut T::Output) -> Vec<PassTime> {
    run_without::<T>(frame, output, |_| false)
}

/// [`run`] for a caller that has put the maps of the lights into `output`.
pub fn run_from_maps<T: Technique>(frame: &Frame<'_, T::Setup>, output: &mut T::Output) -> Vec<PassTime> {
    run_without::<T>(frame, output, |pass| T::MAP_PASSES.contains(&pass))
}

/// [`run`] without the passes whose names `skip` accepts, whose results the caller has put into `output`, the maps for instance.
pub fn run_without<T: Technique>(
    frame: &Frame<'_, T::Setup>,
    output: &mut T::Output,
    skip: impl Fn(&str) -> bool,
) -> Vec<PassTime> {
    let mut times = Vec::new();
    for row in T::rows().into_iter().filter(|row| !skip(row.name())) {
        for number in 0..row.times(frame.setup) {
            let start = Instant::now();
            row.run_cpu(frame, output, number);
            PassTime::add(&mut times, row.name(), start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times
}
