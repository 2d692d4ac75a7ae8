//! Photons, a radiance grid and a field of spherical harmonics.

use indirect_core::SceneProfile;
use sh_grid_raytracer::{Options, ShGridRaytracer};

use super::model::{Adapter, Notes, Transport, curve};
use super::notes;

/// What the harness says of the technique.
pub(super) struct ShGrid;

impl Adapter for ShGrid {
    type Technique = ShGridRaytracer;

    const SUMMARY: &'static str = "any number of bounces of punctual lights and emissive surfaces, from photons in a sparse grid and a field of \
         spherical harmonics around surfaces (Chang, Park & Ihm)";

    const TWINS: &'static [(&'static str, &'static [&'static str])] = &[
        ("", &["grid=16", "photons=16384", "directions=100", "bounces=4"]),
        (
            "printed: ",
            &[
                "grid=12",
                "photons=16384",
                // Among many rays through the corners of fine cells some fall to another side.
                "directions=12",
                "bounces=4",
                "traverse=voxels",
                "reconstruct=as-printed",
                "footprint=on",
                "turned=off",
                "open-points=0",
                "weights=as-printed",
                "gather=samples",
            ],
        ),
        ("final: ", &["grid=16", "photons=16384", "bounces=4", "gather=final", "samples=8"]),
    ];

    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>> {
        let grids: &[u32] = if quick { &[8, 16, 32] } else { &[8, 16, 24, 32, 48] };
        let mut curves = vec![
            curve(&[], "grid", grids),
            curve(&["traverse=voxels"], "grid", if quick { &[16] } else { &[16, 32] }),
            curve(&["gather=final"], "samples", if quick { &[8] } else { &[8, 32, 128] }),
        ];
        if !quick {
            curves.push(curve(&[], "directions", &[100, 200, 400, 800]));
            curves.push(curve(&[], "photons", &[65_536, 262_144, 1_048_576]));
            curves.push(curve(&[], "bounces", &[1, 2, 5, 16]));
            curves.push(curve(&["reconstruct=as-printed"], "grid", &[16, 32]));
        }
        curves
    }

    fn notes(profile: &SceneProfile) -> Notes {
        let mut notes = notes::of_photons(profile);
        if profile.punctual_lights() + profile.emissive_triangles > 0 {
            notes.modelled.push("visibility of all bounces; surfaces as coarse as the grid's cells".into());
        }
        if profile.alpha_masked {
            notes.warnings.push(
                "on the GPU all rays but those of photons take surfaces with alpha masks as solid".into(),
            );
        }
        notes
    }

    fn transport(o: &Options) -> Transport {
        // Roulette ends all but one photon in a hundred within sixteen reflections.
        let bounces = if o.bounces >= 16 { Transport::ALL } else { o.bounces };
        Transport { bounces, occluded: true, emitters: true }
    }
}
