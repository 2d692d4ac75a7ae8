//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

pub(crate) mod bounce;
pub(crate) mod depths;
mod enclosure;
mod estimate;
pub(crate) mod field;
mod look;
pub(crate) mod near;
mod occlusion;
pub(crate) mod reconstruct;
mod sample;
pub(crate) mod stops;
mod upsample;

use std::time::Instant;

use glam::{Vec3, Vec4};
use indirect_accel::Accel;
use indirect_core::{GBuffer, Image, View};
use indirect_filter::{Reduced, cpu::shade};
use rsm::{Rsm, cpu::PassTime};

pub use bounce::{bounce, bounce_seed, visibility};
pub use enclosure::enclosure;
pub use estimate::{Estimate, estimate};
pub use field::{Field, Plane, nearest_hint, pack};
pub use look::Samples;
pub use near::{Near, near};
pub use occlusion::{occlusion, share_of_blocked, words};
pub use reconstruct::{irradiance, reconstruct};
pub use sample::sample;
pub use stops::stops;
pub use upsample::upsample;

use crate::{Error, Lattice, Options, Params, Sample, Surroundings};

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
    /// The maps.
    pub rsm: Rsm,
    /// The lists of samples, one after the other.
    pub samples: Vec<Sample>,
    /// What hints look at closely; empty for other samplings than [`Sampling::Nearby`](crate::Sampling::Nearby).
    pub near: Near,
    /// What stands between hints and samples, see [`occlusion`]; empty where nothing is tested.
    pub blocked: Vec<u32>,
    /// What ends the directions of later bounces, see [`stops`]; empty where nothing is tested.
    pub stops: Vec<u32>,
    /// The hints after each bounce, see [`Estimate::hints`].
    pub bounces: Vec<Vec<Vec4>>,
    /// What the hints know of their surroundings; empty for one bounce.
    pub surroundings: Vec<Surroundings>,
    /// Irradiance per texel of the buffer that [`reconstruct`] fills, W/m².
    pub low: Vec<Vec3>,
    /// Irradiance per pixel, W/m².
    pub irradiance: Vec<Vec3>,
    /// Time per pass, in order.
    pub passes: Vec<PassTime>,
}

impl Output {
    /// Bytes of the maps, the hints and the buffers of the image.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let hints: usize = self.bounces.iter().map(|b| size_of_val(b.as_slice())).sum();
        self.rsm.bytes()
            + size_of_val(self.samples.as_slice())
            + size_of_val(self.near.samples.as_slice())
            + size_of_val(self.near.windows.as_slice())
            + size_of_val(self.blocked.as_slice())
            + size_of_val(self.stops.as_slice())
            + hints
            + size_of_val(self.surroundings.as_slice())
            + size_of_val(self.low.as_slice())
            + size_of_val(self.irradiance.as_slice())
            + size_of_val(self.image.pixels.as_slice())
    }
}

/// The indirect light of all lights of the scene at the pixels of `camera`, which is what `view` sees.
///
/// # Errors
/// [`Error::BadOption`] where `options` or `params` are out of range.
pub fn indirect(
    accel: &Accel<'_>,
    view: &View,
    camera: &GBuffer,
    lattice: &Lattice,
    options: &Options,
    params: &Params,
) -> Result<Output, Error> {
    options.validate()?;
    params.validate()?;
    let mut passes = Vec::new();
    let rsm = timed(&mut passes, "maps", || rsm::cpu::generate(accel, &options.rsm()))?;
    let samples = timed(&mut passes, "sample", || sample(&rsm, lattice, options, params.seed));
    let near = timed(&mut passes, "near", || near(&rsm, lattice, options, params.seed));
    let looked = Samples { lists: &samples, near: &near };
    let blocked = timed(&mut passes, "occlusion", || {
        occlusion(&rsm, (view, camera), lattice, &looked, options, params)
    });
    let Estimate { hints, surroundings } =
        timed(&mut passes, "estimate", || estimate(lattice, &looked, &blocked, options, params));
    let stops = timed(&mut passes, "stops", || stops(&rsm, lattice, options, params));
    let mut bounces = vec![hints];
    timed(&mut passes, "bounce", || {
        for number in 2..=options.bounces {
            let (first, last) = (&bounces[0], &bounces[bounces.len() - 1]);
            let next = bounce(lattice, first, last, &surroundings, &stops, number, options, params);
            bounces.push(next);
        }
    });
    let field = Field { lattice, order: options.order, hints: &bounces[bounces.len() - 1] };
    let reduced = Reduced::new(camera.size, options.scale.step());
    let low =
        timed(&mut passes, "reconstruct", || reconstruct(&field, camera, &reduced, params.reconstruction));
    let irradiance =
        timed(&mut passes, "upsample", || upsample(&field, camera, &reduced, &low, params.reconstruction));
    let image = timed(&mut passes, "shade", || shade(camera, &irradiance));
    Ok(Output { image, rsm, samples, near, blocked, stops, bounces, surroundings, low, irradiance, passes })
}

fn timed<T>(passes: &mut Vec<PassTime>, name: &'static str, pass: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = pass();
    passes.push(PassTime { name, ms: start.elapsed().as_secs_f64() * 1e3 });
    result
}
