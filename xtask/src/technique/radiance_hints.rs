//! Radiance hints: a lattice that samples reflective shadow maps.

use indirect_core::SceneProfile;
use radiance_hints::{Options, RadianceHints, Visibility};

use super::model::{Adapter, Notes, Transport, curve};
use super::notes;

/// What the harness says of the technique.
pub(super) struct Hints;

impl Adapter for Hints {
    type Technique = RadianceHints;

    const SUMMARY: &'static str = "any number of bounces of punctual lights, by a lattice of spherical harmonics that samples reflective shadow \
         maps (Papaioannou 2011)";

    const TWINS: &'static [(&'static str, &'static [&'static str])] = &[
        ("", &["resolution=128", "lattice=9", "samples=30", "bounce-samples=16", "scale=half"]),
        (
            "disc: ",
            &[
                "resolution=64",
                "lattice=6",
                "samples=20",
                "sampling=disc",
                "order=2",
                "bounces=2",
                "bounce-samples=9",
                "transport=sphere",
                "visibility=camera-depth",
                "scale=quarter",
            ],
        ),
        (
            "printed: ",
            &[
                "resolution=64",
                "lattice=7",
                "samples=12",
                "sampling=importance",
                "visibility=off",
                "transport=sphere-as-printed",
                "reconstruct=as-printed",
                "footprint=0",
                "jitter=1",
            ],
        ),
    ];

    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>> {
        let base = ["resolution=256"];
        let one = ["resolution=256", "bounces=1", "visibility=off"];
        let two = ["resolution=256", "order=2"];
        if quick {
            return vec![
                curve(&base, "lattice", &[8, 16, 32]),
                curve(&one, "lattice", &[8, 16]),
                curve(&one, "samples", &[12, 60, 200]),
                curve(&two, "lattice", &[8, 16]),
            ];
        }
        let half = ["resolution=256", "scale=half"];
        let lists = ["resolution=256", "bounces=1", "visibility=off", "sampling=importance"];
        let printed = [
            "resolution=256",
            "bounces=1",
            "visibility=off",
            "reconstruct=as-printed",
            "footprint=0",
            "jitter=1",
        ];
        vec![
            curve(&base, "lattice", &[8, 12, 16, 24, 32]),
            curve(&base, "samples", &[12, 30, 60, 200]),
            curve(&base, "bounces", &[1, 2, 3, 5]),
            curve(&one, "lattice", &[8, 12, 16, 24, 32]),
            curve(&one, "samples", &[12, 30, 60, 200]),
            curve(&lists, "samples", &[12, 30, 60, 200]),
            curve(&two, "lattice", &[8, 16, 32]),
            curve(&half, "lattice", &[8, 16, 32]),
            curve(&printed, "lattice", &[8, 16, 32]),
        ]
    }

    fn notes(profile: &SceneProfile) -> Notes {
        let mut notes = notes::of_lights(profile);
        if profile.punctual_lights() > 0 {
            notes.modelled.push(
                "second and later bounces, from hint to hint, with the mean albedo around the box".into(),
            );
            notes
                .modelled
                .push("visibility of all bounces where a light's map sees what is in the way".into());
            notes.skipped.push("what blocks a bounce and no light sees".into());
            notes
                .skipped
                .push("where the surfaces of later bounces are: they count as the box's walls".into());
        }
        notes
    }

    fn transport(options: &Options) -> Transport {
        Transport {
            bounces: options.bounces,
            occluded: options.visibility != Visibility::Off,
            emitters: false,
        }
    }
}
