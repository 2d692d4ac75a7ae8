//! Reflective shadow maps and the plain gather.

use indirect_core::SceneProfile;
use rsm_gather::RsmGather;

use super::model::{Adapter, Notes, curve};
use super::notes;

/// What the harness says of the technique.
pub(super) struct Gather;

impl Adapter for Gather {
    type Technique = RsmGather;

    const SUMMARY: &'static str = "one bounce of punctual lights, gathered from reflective shadow maps without indirect visibility \
         (Dachsbacher & Stamminger 2005)";

    // All three selections and both forms.
    const TWINS: &'static [(&'static str, &'static [&'static str])] = &[
        ("", &["resolution=128"]),
        ("grid: ", &["resolution=64", "select=grid", "cells=16", "form=point"]),
        ("all: ", &["resolution=64", "select=all"]),
    ];

    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>> {
        let vpls: &[u32] = if quick { &[16, 64, 256, 1024] } else { &[16, 64, 256, 1024, 4096] };
        let cells: &[u32] = if quick { &[4, 8, 16, 32] } else { &[4, 8, 16, 32, 64] };
        vec![
            curve(&["resolution=256"], "vpls", vpls),
            curve(&["resolution=256", "select=grid"], "cells", cells),
        ]
    }

    fn notes(profile: &SceneProfile) -> Notes {
        let mut notes = notes::of_lights(profile);
        if profile.punctual_lights() > 0 {
            notes
                .skipped
                .push("visibility of the first bounce: light passes through what stands between".into());
            notes.skipped.push("second and later bounces".into());
        }
        notes
    }
}
