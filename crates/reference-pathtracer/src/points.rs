//! Irradiance at points, for those who bake.

use core::f64::consts::PI;
use core::sync::atomic::AtomicU64;

use glam::{DVec3, Vec3};
use indirect_accel::Accel;
use indirect_sampling::rng::hash_combine;

use crate::{
    Error, Estimate, Settings, VirtualLights,
    estimate::Pixel,
    key,
    render::run,
    sampler::{PATHS, Sampler},
    surfaces::Vertex,
    tracer::Tracer,
};

/// Estimates the irradiance that arrives at points of surfaces, or of the air, from the side of their normals, W/m².
///
/// The result is an [`Estimate`] of an image of one row, a pixel per point: `direct` is what lights and emissive surfaces send there,
/// `indirect` what arrives after being reflected, as [`Settings::bounces`] counts it: with one bounce light → surface → point. Albedo plays no
/// part, so black surfaces have irradiance too. It is merged, stored and made of parts as images are. Normals of any length are accepted; a point
/// whose normal has none, or that is not finite, has no irradiance, and [`Estimate::surface`] is false there.
///
/// Points on a surface are moved off it by the offset of its rays. Runs on the current rayon pool; the result has the same bits on any number
/// of threads.
///
/// # Errors
/// [`Error::Size`] for no points or more than 2²⁸, [`Error::Points`] where there are not as many normals as points, [`Error::Settings`] for
/// settings that contradict themselves or that ask for virtual lights, which serve images.
pub fn irradiance(
    accel: &Accel<'_>,
    points: &[Vec3],
    normals: &[Vec3],
    settings: &Settings,
) -> Result<Estimate, Error> {
    irradiance_with(accel, points, normals, settings, &|_| ())
}

/// [`irradiance`] with a progress report: the share of the work that is done, `[0, 1]`, from any thread, now and then.
///
/// # Errors
/// As there.
pub fn irradiance_with(
    accel: &Accel<'_>,
    points: &[Vec3],
    normals: &[Vec3],
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, Error> {
    settings.validate()?;
    if settings.virtual_lights == VirtualLights::On {
        return Err(Error::Settings { message: "virtual lights serve images, not points" });
    }
    let size = [u32::try_from(points.len()).unwrap_or(u32::MAX), 1];
    if points.is_empty() || points.len() > 1 << 28 {
        return Err(Error::Size { size });
    }
    if points.len() != normals.len() {
        return Err(Error::Points { points: points.len(), normals: normals.len() });
    }
    let receivers: Vec<_> = points.iter().zip(normals).map(|(p, n)| receiver(*p, *n)).collect();
    let tracer = Tracer::new(accel, *settings);
    let mut pixels: Vec<Pixel> = vec![Pixel::default(); points.len()];
    for (pixel, receiver) in pixels.iter_mut().zip(&receivers) {
        pixel.surface = receiver.is_some();
    }
    let (seed, batch) = (hash_combine(settings.seed, PATHS), settings.samples.batch);
    let sample = |i: usize, index: u32, (): &(), _: &mut bool, traced: &mut u64| {
        let Some(receiver) = &receivers[i] else { return (DVec3::ZERO, DVec3::ZERO) };
        let exact =
            if settings.components.direct() { tracer.lit(receiver, traced).as_dvec3() } else { DVec3::ZERO };
        let (mut direct, mut indirect) = (DVec3::ZERO, DVec3::ZERO);
        if tracer.needs_paths() {
            let seed = hash_combine(hash_combine(seed, i as u32), index);
            for sample in 0..batch {
                let found = tracer.path(receiver, true, None, &mut Sampler::new(seed, sample), traced);
                direct += found.direct.as_dvec3();
                indirect += found.indirect.as_dvec3();
            }
        }
        // A white surface there would send E/π in every direction.
        let scale = PI / f64::from(batch);
        (exact * PI + direct * scale, indirect * scale)
    };
    let rays = AtomicU64::new(0);
    let batches = run(&mut pixels, settings, &rays, |_| (), sample, progress);
    progress(1.0);
    let key = key::of_points(accel.scene(), points, normals, settings);
    Ok(Estimate::new(size, pixels, batch, batches, rays.into_inner(), key))
}

/// A white surface, if there can be one.
fn receiver(position: Vec3, normal: Vec3) -> Option<Vertex> {
    let normal = normal.try_normalize()?;
    let vertex =
        Vertex { position, geometric: normal, shading: normal, albedo: Vec3::ONE, emission: Vec3::ZERO };
    position.is_finite().then_some(vertex)
}
