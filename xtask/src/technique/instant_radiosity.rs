//! Instant radiosity with interleaved sampling and temporal coherence.

use indirect_core::SceneProfile;
use instant_radiosity::{InstantRadiosity, Options, Switch, Visibility};

use super::model::{Adapter, Notes, Transport, curve};
use super::notes;

/// What the harness says of the technique.
pub(super) struct Instant;

impl Adapter for Instant {
    type Technique = InstantRadiosity;

    const SUMMARY: &'static str = "any number of bounces of punctual lights and emissive surfaces, from virtual lights with visibility, \
         interleaved over pixels and reused over frames (Knecht 2009; Keller 1997)";

    const TWINS: &'static [(&'static str, &'static [&'static str])] = &[
        ("", &["resolution=64", "vpls=64"]),
        (
            "printed: ",
            &[
                "resolution=64",
                "vpls=64",
                "bounces=2",
                "compensate=off",
                "tail=off",
                "sequence=halton",
                "outliers=0",
            ],
        ),
        ("flat: ", &["resolution=64", "vpls=60", "interleave=1", "bounces=2", "shadow-rays=0", "motion=on"]),
        ("open: ", &["resolution=64", "vpls=64", "bounces=1", "visibility=off", "history=off"]),
        ("maps: ", &["resolution=64", "vpls=64", "bounces=2", "visibility=maps"]),
    ];

    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>> {
        let still = ["history=off"];
        let vpls: &[u32] = if quick { &[64, 256, 1024] } else { &[64, 256, 1024, 4096] };
        let mut curves = vec![
            curve(&[], "vpls", if quick { &[256] } else { &[64, 256, 1024] }),
            curve(&still, "vpls", vpls),
            curve(&["history=off", "visibility=maps"], "vpls", if quick { &[256] } else { &[64, 256, 1024] }),
        ];
        if !quick {
            curves.push(curve(&["history=off", "tail=off"], "bounces", &[1, 2, 4, 8]));
            curves.push(curve(&still, "shadow-rays", &[1, 4, 16]));
            curves.push(curve(&["history=off", "vpls=1024"], "interleave", &[1, 2, 4, 8]));
        }
        curves
    }

    fn notes(profile: &SceneProfile) -> Notes {
        let mut notes = notes::of_lights_and_emitters(profile);
        if profile.punctual_lights() + profile.emissive_triangles > 0 {
            notes
                .modelled
                .push("visibility of all bounces; the last bounce stands for all later ones".into());
        }
        if profile.alpha_masked {
            notes.warnings.push("on the GPU rays take surfaces with alpha masks as solid".into());
        }
        notes
    }

    fn transport(o: &Options) -> Transport {
        let bounces = if o.tail == Switch::On && o.bounces > 1 { Transport::ALL } else { o.bounces };
        Transport { bounces, occluded: o.visibility != Visibility::Off, emitters: true }
    }

    fn settles(o: &Options) -> usize {
        if o.history == Switch::On { 32 } else { 1 }
    }
}
