//! Hierarchical image-space radiosity.

use image_space_radiosity::{ImageSpaceRadiosity, Options};
use indirect_core::SceneProfile;

use super::model::{Adapter, Notes, Transport};
use super::notes;

/// What the harness says of the technique.
pub(super) struct Radiosity;

impl Adapter for Radiosity {
    type Technique = ImageSpaceRadiosity;

    const SUMMARY: &'static str = "one bounce of punctual lights at as many resolutions as camera and light need, without indirect visibility \
         or with shadow maps of coarse patches (Nichols, Shopf & Wyman 2009)";

    const TWINS: &'static [(&'static str, &'static [&'static str])] = &[
        ("", &["resolution=128"]),
        ("as printed: ", &["resolution=64", "bound=contribution", "margin=0", "form=point"]),
        ("basic: ", &["resolution=64", "lights=basic", "finest=32"]),
        ("splat: ", &["resolution=64", "lights=flat", "cells=8", "method=splat"]),
        (
            "shadows: ",
            &["resolution=64", "visibility=maps", "points=16384", "points-per-map=1024", "tile=32"],
        ),
        (
            "basic shadows: ",
            &[
                "resolution=64",
                "lights=basic",
                "visibility=maps",
                "points=4096",
                "points-per-map=512",
                "tile=16",
            ],
        ),
        ("bounded: ", &["resolution=64", "lights=flat", "cells=8", "method=bounded"]),
    ];

    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>> {
        let set = |pairs: &[&str]| pairs.iter().map(|p| (*p).to_owned()).collect::<Vec<_>>();
        let eye: &[&str] = if quick {
            &["bend=0.03", "bend=0.003"]
        } else {
            &["bend=0.03", "bend=0.003", "bend=0.0003", "block=0"]
        };
        let taus: &[&str] = if quick {
            &["tau=1", "tau=0.1"]
        } else {
            &["tau=1", "tau=0.3", "tau=0.1", "tau=0.03", "tau=0.01", "tau=0.003"]
        };
        let mut curves: Vec<_> =
            eye.iter().map(|e| taus.iter().map(|t| set(&[e, t])).collect::<Vec<_>>()).collect();
        let cells: &[&str] =
            if quick { &["cells=16"] } else { &["cells=8", "cells=16", "cells=32", "cells=64"] };
        curves.push(cells.iter().map(|c| set(&["lights=flat", c])).collect());
        let clusters: &[&str] =
            if quick { &["finest=64"] } else { &["finest=32", "finest=64", "finest=128"] };
        curves.push(clusters.iter().map(|c| set(&["lights=basic", c])).collect());
        let cells: &[&str] = if quick {
            &["shadow-cells=16"]
        } else {
            &["shadow-cells=8", "shadow-cells=16", "shadow-cells=32"]
        };
        curves.push(cells.iter().map(|c| set(&["visibility=maps", c])).collect());
        curves
    }

    fn notes(profile: &SceneProfile) -> Notes {
        let mut notes = notes::of_lights(profile);
        if profile.punctual_lights() > 0 {
            notes.skipped.push(
                "visibility of the first bounce: light passes through what stands between; with visibility=maps shadow maps of \
                 coarse patches tell it"
                    .into(),
            );
            notes.skipped.push("second and later bounces".into());
        }
        notes
    }

    fn transport(o: &Options) -> Transport {
        Transport { bounces: 1, occluded: o.has_shadows(), emitters: false }
    }
}
