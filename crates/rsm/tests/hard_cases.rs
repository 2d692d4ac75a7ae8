//! Degenerate input of the maps alone; `rsm-gather` has those of whole frames.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{floor_and_wall, lights, scaled};
use glam::Vec2;
use indirect_accel::{Accel, BuildPreset};
use indirect_core::Projection;
use rsm::{Error, cpu, views::views};

/// A texel that is not finite counts as unlit: the sums are those without it, and nothing is drawn from it.
#[test]
fn a_poisoned_texel_does_not_spread() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let rsm = cpu::generate(&accel, 16).unwrap();
    let map = &rsm.maps[0];
    let lit = map.texels.iter().position(|t| t.reflected.min_element() > 0.0).unwrap();
    let top = |change: &dyn Fn(&mut rsm::Texel)| {
        let mut texels = map.texels.clone();
        change(&mut texels[lit]);
        cpu::pyramid(&map.surface, &texels).top()
    };
    let without = top(&|t| *t = rsm::Texel::default());
    assert!(without.reflected.min_element() > 0.0 && without != map.pyramid.top());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(top(&|t| t.reflected.y = bad), without, "reflected {bad}");
        assert_eq!(top(&|t| t.incident.z = bad), without, "incident {bad}");
    }
}

/// Maps fit what their light can see: no vertex in front of it lies outside in depth, none at all outside a directional map.
#[test]
fn views_fit_the_bounds_at_any_scale() {
    for s in [1e-3, 1.0, 1e5] {
        for kind in lights() {
            let scene = floor_and_wall(scaled(kind, s), s);
            for v in views(&scene) {
                assert!(v.view.near < v.view.far);
                for &p in &scene.mesh.positions {
                    let depth = v.view.depth(p);
                    assert!(depth <= v.view.far);
                    if let Projection::Orthographic { half_size } = v.view.projection {
                        let d = p - v.view.origin;
                        let over = Vec2::new(d.dot(v.view.right), d.dot(v.view.up)).abs() / half_size;
                        assert!(over.max_element() <= 1.0 + 1e-5 && depth >= v.view.near);
                    }
                }
            }
        }
    }
}

#[test]
fn a_resolution_out_of_range_is_an_error() {
    let s = floor_and_wall(lights()[0], 1.0);
    let accel = Accel::build(&s, BuildPreset::Fast);
    for resolution in [0, 8193] {
        assert!(
            matches!(cpu::generate(&accel, resolution), Err(Error::BadOption(b)) if b.option == "resolution")
        );
    }
}
