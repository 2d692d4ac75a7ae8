//! `bake`: light that does not move, as files that engines read: probes on a grid and light maps, made by the path tracer.

mod check;
mod grid;
mod irradiance;
mod lightmap;
mod probes;

use indirect_accel::{Accel, BuildPreset};
use indirect_scene::{LoadOptions, fixtures};
use reference_pathtracer::{Bounces, Components, Samples, Settings};

use crate::cli::{BakeArgs, BakeFormat, Component};
use crate::failure::{self, Failure, Outcome};
use crate::technique::REFERENCE;
use crate::warn;

use check::Points;
use grid::Grid;
use irradiance::Made;

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
