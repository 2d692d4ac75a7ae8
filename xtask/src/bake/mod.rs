//! `bake`: light that does not move, as files that engines read: probes on a grid and light maps, made by the path tracer.

mod check;
mod grid;
mod lightmap;
mod probes;

use indirect_accel::{Accel, BuildPreset};
use indirect_scene::{LoadOptions, fixtures};
use reference_pathtracer::{Bounces, Components, Samples, Settings};
use serde::Serialize;

use crate::cli::{BakeArgs, BakeFormat, Component};
use crate::failure::{self, Failure, Outcome};
use crate::progress;
use crate::technique::REFERENCE;
use crate::warn;

use check::Points;
use grid::Grid;

/// What all files say of how they were made.
#[derive(Debug, Clone, Serialize)]
struct Made {
    /// Of the layout of this file.
    version: u32,
    scene: String,
    technique: &'static str,
    component: String,
    bounces: String,
    spp: u64,
    seed: u32,
}

pub(crate) fn run(args: &BakeArgs) -> Outcome {
    if args.technique != REFERENCE {
        let message = "only the reference bakes: techniques see what a camera sees";
        return Err(Failure::Input(format!("--technique {}: {message}", args.technique)));
    }
    let settings = settings(args)?;
    let probes = args.format.iter().any(|f| *f != BakeFormat::Lightmap);
    if args.probes.is_some() && args.spacing.is_some() {
        return Err(Failure::Input("--probes and --spacing: give one of them".into()));
    }
    failure::will_write(&args.out.join("bake.json"))?;
    let mut options = LoadOptions::default();
    options.lightmap_uvs = args.format.contains(&BakeFormat::Lightmap);
    let loaded = fixtures::resolve(&args.scene, &options).map_err(|e| Failure::Input(e.to_string()))?;
    loaded.warnings.iter().for_each(|w| warn(format!("{}: {w}", args.scene)));
    let accel = Accel::build(&loaded.scene, BuildPreset::Best);
    let made = Made {
        version: 1,
        scene: args.scene.clone(),
        technique: REFERENCE,
        component: format!("{:?}", args.component).to_lowercase(),
        bounces: args.bounces.clone().unwrap_or_else(|| "inf".to_owned()),
        spp: settings.samples.spp(),
        seed: args.seed,
    };
    if args.format.contains(&BakeFormat::Lightmap) {
        lightmap::run(&accel, &loaded.lightmap_uvs, &settings, args, &made)?;
    }
    if probes {
        let grid = Grid::new(&accel, args)?;
        let points = Points::new(&accel, &grid, args.check, &settings, args.component)?;
        probes::run(&accel, &grid, &settings, args, &made, &points)?;
    }
    Ok(())
}

fn settings(args: &BakeArgs) -> Outcome<Settings> {
    let bounces = match args.bounces.as_deref() {
        None | Some("inf") => Bounces::Infinite,
        Some(n) => Bounces::Count(
            n.parse()
                .map_err(|_| Failure::Input(format!("--bounces {n}: must be a whole number or `inf`")))?,
        ),
    };
    let components = match args.component {
        Component::Full => Components::Both,
        Component::Direct => Components::Direct,
        Component::Indirect => Components::Indirect,
    };
    Ok(Settings {
        components,
        bounces,
        samples: Samples::count(args.spp),
        seed: args.seed,
        ..Settings::default()
    })
}

/// Irradiance at points, W/m², of the component that is asked for, with a bar on a terminal.
fn irradiance(
    accel: &Accel<'_>,
    receivers: &[(glam::Vec3, glam::Vec3)],
    settings: &Settings,
    component: Component,
    message: &str,
) -> Outcome<(Vec<glam::Vec3>, f64)> {
    let (points, normals): (Vec<_>, Vec<_>) = receivers.iter().copied().unzip();
    let bar = progress::bar(1000, message.to_owned());
    let tell = |share: f64| bar.set_position((1000.0 * share) as u64);
    let made = reference_pathtracer::irradiance_with(accel, &points, &normals, settings, &tell)
        .map_err(|e| Failure::Check(e.to_string()))?;
    bar.finish_and_clear();
    let [direct, indirect] = made.noise();
    Ok(match component {
        Component::Full => (made.full().pixels, direct.max(indirect)),
        Component::Direct => (made.direct.pixels, direct),
        Component::Indirect => (made.indirect.pixels, indirect),
    })
}
