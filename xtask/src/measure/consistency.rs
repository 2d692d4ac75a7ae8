//! The check that the gather is right: with every texel a light it converges to the reference that makes the same
//! assumptions.

use indirect_core::GBuffer;
use indirect_metrics::{Reference as MetricsReference, compare};
use reference_pathtracer::{Bounces, Components, PixelFilter};
use rsm_gather::{Options, Params, Select, Setup, cpu};

use super::data::{Consistency, ConsistencyPoint};
use crate::failure::{Failure, Outcome};
use crate::progress;
use crate::stage::{Source, Stage};
use crate::technique::{Reference, ReferenceOptions};

const SCENE: &str = "plane_wall";

/// Measures the curve on the CPU.
pub(crate) fn measure(quick: bool) -> Outcome<Consistency> {
    let source = Source::load(SCENE)?;
    let camera = source.camera(None)?;
    let stage = Stage::new(&source, camera, Source::size(camera, 48), None);
    let options = ReferenceOptions {
        components: Components::Indirect,
        bounces: Bounces::Count(1),
        unoccluded: true,
        // Few pixels and many samples: the curve goes down to a few tenths of a percent, and so must the reference's noise.
        spp: if quick { 1 << 15 } else { 1 << 17 },
        noise_target: None,
        seed: 0,
        pixel_filter: PixelFilter::Center,
    };
    let truth = Reference::cached(&stage, &options, "matched reference")?;
    let mut error = truth.indirect_variance.clone();
    error.pixels.iter_mut().for_each(|v| *v = v.map(f32::sqrt));
    let camera = indirect_accel::cast::gbuffer(&stage.accel, &stage.view, stage.size);
    let away = away_from_corners(&stage, &camera);
    let resolutions: &[u32] = if quick { &[4, 8, 16, 32, 64] } else { &[4, 8, 16, 32, 64, 128, 256] };
    let bar = progress::bar(resolutions.len() as u64, "consistency");
    let mut points = Vec::new();
    let mut noise_floor = 0.0;
    let failed = |e: &dyn std::fmt::Display| Failure::Check(format!("{SCENE}: {e}"));
    for &resolution in resolutions {
        let options = Options { resolution, select: Select::All, ..Options::default() };
        let setup = Setup { options, params: Params::default() };
        let output = cpu::indirect(&cpu::Frame::new(&stage.accel, &stage.view, &camera, &setup))
            .map_err(|e| failed(&e))?;
        let against = |surface: &[bool]| {
            let standard_error = Some(&error);
            let reference =
                MetricsReference { standard_error, ..MetricsReference::exact(&truth.indirect, surface) };
            compare(&output.image, &reference).map_err(|e| failed(&e))
        };
        let clear = against(&away)?;
        noise_floor = clear.noise_floor.rel_rmse;
        points.push(ConsistencyPoint {
            resolution,
            vpls: output.vpls.len(),
            rel_rmse: against(&truth.surface)?.luminance.rel_rmse,
            rel_rmse_away: clear.luminance.rel_rmse,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Consistency { scene: SCENE, points, noise_floor })
}

/// The pixels at least a tenth of the scene's diagonal away from every plane but their own.
fn away_from_corners(stage: &Stage<'_>, camera: &GBuffer) -> Vec<bool> {
    let mesh = &stage.scene.mesh;
    let least = 0.1 * stage.accel.unit();
    let planes: Vec<_> =
        (0..mesh.triangles.len() as u32).map(|t| (mesh.corners(t)[0], mesh.geometric_normal(t))).collect();
    let clear = |i: usize| {
        let (p, n) = (camera.position[i], camera.normal[i]);
        planes.iter().all(|(on, m)| m.dot(n).abs() > 0.9 || (p - *on).dot(*m).abs() >= least)
    };
    (0..camera.len()).map(|i| camera.is_surface(i) && clear(i)).collect()
}
