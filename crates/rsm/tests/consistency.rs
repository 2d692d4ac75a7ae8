//! The gather with every texel as a VPL against one bounce of unoccluded light by brute-force quadrature.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{floor_and_wall, spot};
use glam::{DVec3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Light, LightKind};
use rayon::prelude::*;
use rsm::{Form, Selection, Vpl, cpu};

const HEIGHT: f32 = 2.0;
/// The lit disc, of radius 2·tan 30° = 1.155 m, ends 1 cm before the wall at z = −2.
const LIGHT: Vec3 = Vec3::new(0.1, HEIGHT, -2.0 + 1.1547 + 0.01);

/// Points on the wall, at least `lowest` above the corner.
fn wall(lowest: f32) -> Vec<Vec3> {
    let at = |i: u32| (i as f32 + 0.5) / 12.0;
    (0..144).map(|i| Vec3::new(4.0 * at(i % 12) - 2.0, lowest + (4.0 - lowest) * at(i / 12), -2.0)).collect()
}

/// `∫ ρ/π E(y) cosθ_x cosθ_y / d² dA` over the lit disc of the floor, in f64: midpoints in polar coordinates below the light.
fn exact(light: &Light, albedo: f64, points: &[Vec3]) -> Vec<f64> {
    let LightKind::Spot { inner_angle, outer_angle, .. } = light.kind else { panic!("a spot light") };
    let (ci, co) = (f64::from(inner_angle).cos(), f64::from(outer_angle).cos());
    let (h, radius) = (f64::from(HEIGHT), f64::from(HEIGHT) * f64::from(outer_angle).tan());
    let (rings, sectors) = (500, 500);
    let (dr, dphi) = (radius / f64::from(rings), core::f64::consts::TAU / f64::from(sectors));
    points
        .par_iter()
        .map(|x| {
            let x = x.as_dvec3();
            let mut sum = 0.0;
            for i in 0..rings {
                let r = (f64::from(i) + 0.5) * dr;
                let cos = h / (h * h + r * r).sqrt();
                let a = ((cos - co) / (ci - co)).clamp(0.0, 1.0);
                let radiosity = f64::from(light.power.x) * a * a * cos.powi(3) / (h * h) * albedo;
                for k in 0..sectors {
                    let (sin, cos) = ((f64::from(k) + 0.5) * dphi).sin_cos();
                    let y = DVec3::new(f64::from(LIGHT.x) + r * cos, 0.0, f64::from(LIGHT.z) + r * sin);
                    let v = y - x;
                    // Normals: the wall's is +z, the floor's +y.
                    let (cx, cy) = (v.z, -v.y);
                    if cx > 0.0 && cy > 0.0 {
                        sum += radiosity * cx * cy / v.length_squared().powi(2) * r * dr * dphi;
                    }
                }
            }
            sum / core::f64::consts::PI
        })
        .collect()
}

fn rel_rmse(found: &[f64], exact: &[f64]) -> f64 {
    let n = exact.len() as f64;
    let square: f64 = found.iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum();
    (square / n).sqrt() / (exact.iter().sum::<f64>() / n)
}

#[test]
fn every_texel_as_vpl_converges_to_one_bounce() {
    let scene = floor_and_wall(spot(LIGHT, Vec3::NEG_Y, 20.0, 30.0), 1.0);
    let (light, albedo) = (&scene.lights[0], f64::from(scene.materials[0].base_color.x));
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let points = wall(0.25);
    let truth = exact(light, albedo, &points);
    let receivers = points.iter().map(|p| (*p, Vec3::Z)).collect();
    let error = |resolution| {
        let rsm = cpu::generate(&accel, resolution).unwrap();
        let vpls = cpu::compact(&cpu::vpls(&rsm, Selection::All, &[]));
        let e = cpu::gather(&vpls, &receivers, Form::Disc);
        rel_rmse(&e.iter().map(|e| f64::from(e.x)).collect::<Vec<_>>(), &truth)
    };
    let errors = [32, 64, 128, 256, 512].map(error);
    println!("rel_rmse over 32²…512²: {errors:?}");
    for pair in errors.windows(2) {
        // A midpoint rule over a C¹ integrand with a footprint of the texel's size: quarter the error per doubling. The
        // grid's luck with the cone's border leaves some of it.
        assert!(pair[1] < 0.6 * pair[0], "{errors:?}");
    }
    assert!(errors[4] < 1e-3, "{errors:?}");
    // Well below the bar of 1 % already at 128².
    assert!(errors[2] < 1e-2, "{errors:?}");
}

#[test]
fn the_subsets_converge_to_every_texel() {
    let scene = floor_and_wall(spot(LIGHT, Vec3::NEG_Y, 20.0, 30.0), 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let points = wall(0.25);
    let receivers: cpu::Receivers = points.iter().map(|p| (*p, Vec3::Z)).collect();
    let rsm = cpu::generate(&accel, 256).unwrap();
    let gather = |selection: Selection| -> Vec<f64> {
        let slots = cpu::vpls(&rsm, selection, &selection.points(3));
        let vpls: Vec<Vpl> = cpu::compact(&slots);
        cpu::gather(&vpls, &receivers, Form::Disc).iter().map(|e| f64::from(e.x)).collect()
    };
    let all = gather(Selection::All);
    let grid = [4, 16, 64].map(|cells| rel_rmse(&gather(Selection::Grid { cells }), &all));
    let importance = [64, 512, 4096].map(|count| rel_rmse(&gather(Selection::Importance { count }), &all));
    println!("grid {grid:?}, importance {importance:?}");
    for errors in [grid, importance] {
        assert!(errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1], "{errors:?}");
        assert!(errors[2] < 5e-3, "{errors:?}");
    }
}
