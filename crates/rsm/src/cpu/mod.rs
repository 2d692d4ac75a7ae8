//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod flux;
mod gather;
mod pyramid;
mod simd;
mod vpls;

use std::time::Instant;

use glam::Vec3;
use indirect_accel::{Accel, cast};
use indirect_core::{GBuffer, Image};

pub use flux::{MIN_FOOTPRINT_COSINE, flux, texel_solid_angle};
pub use gather::{CHUNK, Receivers, gather, shade};
pub use pyramid::pyramid;
pub use vpls::{compact, vpls};

use crate::{
    Error,
    layout::{LightMap, Vpl},
    params::{Options, Params},
    rsm::{Map, Rsm},
    views::views,
};

/// Time that a pass took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Wall time, milliseconds.
    pub ms: f64,
}

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
    /// The maps.
    pub rsm: Rsm,
    /// One VPL per slot of the selection, unlit slots included.
    pub slots: Vec<Vpl>,
    /// The VPLs with flux.
    pub vpls: Vec<Vpl>,
    /// The pixels that see a surface, as indices into the camera's G-buffer.
    pub texels: Vec<u32>,
    /// Irradiance on each of them, W/m².
    pub irradiance: Vec<Vec3>,
    /// Time per pass, in order.
    pub passes: Vec<PassTime>,
}

/// Runs passes and notes their time.
#[derive(Default)]
struct Clock(Vec<PassTime>);

impl Clock {
    fn time<T>(&mut self, name: &'static str, pass: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = pass();
        let ms = start.elapsed().as_secs_f64() * 1e3;
        match self.0.iter_mut().find(|p| p.name == name) {
            Some(p) => p.ms += ms,
            None => self.0.push(PassTime { name, ms }),
        }
        result
    }
}

/// The reflective shadow maps of all lights of the scene.
///
/// # Errors
/// [`Error::BadOption`] where `options` are out of range.
pub fn generate(accel: &Accel<'_>, options: &Options) -> Result<Rsm, Error> {
    options.validate()?;
    Ok(generate_timed(accel, options.resolution, &mut Clock::default()))
}

fn generate_timed(accel: &Accel<'_>, resolution: u32, clock: &mut Clock) -> Rsm {
    let scene = accel.scene();
    let maps = clock.time("views", || views(scene));
    let maps = maps
        .into_iter()
        .map(|v| {
            let surface = clock.time("surface", || cast::gbuffer(accel, &v.view, [resolution; 2]));
            let map = LightMap::new(&scene.lights[v.light], &v.view, resolution);
            let texels = clock.time("flux", || flux(&map, &surface));
            let pyramid = clock.time("pyramid", || pyramid(&surface, &texels));
            Map { light: v.light, view: v.view, surface, texels, pyramid }
        })
        .collect();
    Rsm { resolution, maps }
}

/// One bounce of all lights of the scene, gathered at the pixels of `camera` without indirect visibility.
///
/// # Errors
/// [`Error::BadOption`] where `options` are out of range.
pub fn indirect(
    accel: &Accel<'_>,
    camera: &GBuffer,
    options: &Options,
    params: &Params,
) -> Result<Output, Error> {
    options.validate()?;
    let mut clock = Clock::default();
    let rsm = generate_timed(accel, options.resolution, &mut clock);
    let slots = clock.time("vpls", || vpls(&rsm, options.selection, &options.selection.points(params.seed)));
    let vpls = clock.time("compact", || compact(&slots));
    let (texels, irradiance) = clock.time("gather", || {
        let (receivers, texels) = Receivers::of_surface(camera);
        (texels, gather(&vpls, &receivers, params.form))
    });
    let image = clock.time("shade", || shade(camera, &texels, &irradiance));
    Ok(Output { image, rsm, slots, vpls, texels, irradiance, passes: clock.0 })
}
