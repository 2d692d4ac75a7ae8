//! Flux and area of the maps against closed forms.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use core::f64::consts::{PI, TAU};

use common::{light, push_box, push_square, scene, spot};
use glam::{Mat3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{LightKind, Scene};
use rsm::{Rsm, cpu};

const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.2);
const POWER: Vec3 = Vec3::new(3.0, 2.0, 1.0);

fn maps(scene: &Scene, resolution: u32) -> Rsm {
    scene.validate().unwrap();
    let accel = Accel::build(scene, BuildPreset::Fast);
    cpu::generate(&accel, resolution).unwrap()
}

/// The maps' incident flux is `flux` per unit of power, their reflected flux the albedo's share of it, both to `tolerance`.
fn assert_flux(rsm: &Rsm, flux: f64, tolerance: f64) {
    for (channel, (power, albedo)) in POWER.to_array().into_iter().zip(ALBEDO.to_array()).enumerate() {
        let expected = flux * f64::from(power);
        let incident: f64 = rsm.maps.iter().map(|m| m.incident()[channel]).sum();
        println!("channel {channel}: flux off by {:+.1e}", incident / expected - 1.0);
        assert!((incident / expected - 1.0).abs() < tolerance, "incident {incident}, expected {expected}");
        // One rounding of the product per texel.
        assert!((rsm.reflected()[channel] / (incident * f64::from(albedo)) - 1.0).abs() < 1e-6);
    }
}

/// Flux of a spot light of unit power, from the falloff of KHR_lights_punctual.
///
/// With `c = cosθ` and `s = max(0.001, cos inner − cos outer)` the intensity is `((c − cos outer)/s)²` up to
/// `c = cos outer + s` and 1 from there to the axis: `∫ I 2π dc = 2π (s/3 + 1 − cos outer − s)`.
fn spot_flux(inner_degrees: f64, outer_degrees: f64) -> f64 {
    let (ci, co) = (inner_degrees.to_radians().cos(), outer_degrees.to_radians().cos());
    let s = (ci - co).max(0.001);
    assert!(co + s <= 1.0);
    TAU * (s / 3.0 + 1.0 - co - s)
}

/// 0.1 % at 512². The midpoint rule over the cone is far below it where the falloff is smooth; a hard edge (inner = outer)
/// crosses about π·512 texels whose coverage is 0 or 1: √1600·0.3 of 2·10⁵ texels, 6e-5.
const TOLERANCE: f64 = 1e-3;

#[test]
fn spot_flux_is_the_cones_and_does_not_see_the_slope() {
    for (inner, outer) in [(0.0, 30.0), (20.0, 35.0), (40.0, 40.0), (10.0, 55.0)] {
        for tilt in [0.0_f32, 20.0, 30.0] {
            let mut s = scene(ALBEDO);
            push_square(&mut s, Vec3::ZERO, 100.0, Mat3::from_rotation_x(tilt.to_radians()));
            let direction = Vec3::new(0.05, -1.0, 0.02);
            s.lights.push(light(spot(Vec3::Y, direction, inner, outer), POWER));
            assert_flux(&maps(&s, 512), spot_flux(f64::from(inner), f64::from(outer)), TOLERANCE);
        }
    }
}

#[test]
fn wide_spots_spread_over_cube_faces() {
    for (inner, outer) in [(30.0_f32, 70.0_f32), (80.0, 90.0), (0.0, 90.0)] {
        let mut s = scene(ALBEDO);
        push_box(&mut s, 1.0);
        s.lights.push(light(spot(Vec3::new(0.1, 0.2, -0.1), Vec3::new(0.3, -1.0, 0.2), inner, outer), POWER));
        let rsm = maps(&s, 512);
        assert_eq!(rsm.maps.len(), 5);
        assert_flux(&rsm, spot_flux(f64::from(inner), f64::from(outer)), TOLERANCE);
    }
}

#[test]
fn point_light_in_a_closed_box_sends_four_pi() {
    let mut s = scene(ALBEDO);
    push_box(&mut s, 1.0);
    s.lights.push(light(LightKind::Point { position: Vec3::new(0.3, -0.2, 0.4) }, POWER));
    let rsm = maps(&s, 512);
    assert_eq!(rsm.maps.len(), 6);
    // Exact solid angles: nothing but rounding.
    assert_flux(&rsm, 4.0 * PI, 1e-5);
}

#[test]
fn directional_flux_is_that_of_the_projected_area() {
    for (x, z) in [(0.0_f32, 0.0_f32), (30.0, 0.0), (60.0, 0.0), (40.0, 25.0), (75.0, 10.0)] {
        let rotation = Mat3::from_rotation_x(x.to_radians()) * Mat3::from_rotation_z(z.to_radians());
        let mut s = scene(ALBEDO);
        push_square(&mut s, Vec3::new(5.0, 1.0, -3.0), 2.0, rotation);
        s.lights.push(light(LightKind::Directional { direction: Vec3::NEG_Y }, POWER));
        let rsm = maps(&s, 512);
        let projected = 16.0 * f64::from((rotation * Vec3::Y).y);
        assert_flux(&rsm, projected, TOLERANCE);
        // The printed texel flux (Radiance Hints §4) multiplies by the cosine once more: the total would lose it.
        let printed: f64 = rsm.maps[0]
            .texels
            .iter()
            .zip(&rsm.maps[0].surface.normal)
            .map(|(t, n)| f64::from(t.incident.x * n.y))
            .sum();
        let lost = printed / (projected * f64::from(POWER.x));
        assert!((lost - f64::from((rotation * Vec3::Y).y)).abs() < 2e-3, "{lost}");
    }
}

#[test]
fn area_follows_the_slope() {
    // A 4 m × 4 m square at 60° to a directional light.
    let rotation = Mat3::from_rotation_x(60.0_f32.to_radians());
    let mut s = scene(ALBEDO);
    push_square(&mut s, Vec3::ZERO, 2.0, rotation);
    s.lights.push(light(LightKind::Directional { direction: Vec3::NEG_Y }, POWER));
    let area: f64 = maps(&s, 512).maps[0].texels.iter().map(|t| f64::from(t.area)).sum();
    assert!((area / 16.0 - 1.0).abs() < 1e-3, "{area}");

    // A plane at 60° under a spot light at height 1: its part inside the square frustum is a trapezoid. A ray of slope
    // (x, y) meets the plane `z = tan 60° · height` at the depth 1/(1 − t·y), the area element there is
    // √(1 + t²)/(1 − t·y)³ dx dy.
    let (t, half) = (60.0_f64.to_radians().tan(), 20.0_f64.to_radians().tan());
    let mut s = scene(ALBEDO);
    push_square(&mut s, Vec3::ZERO, 50.0, rotation);
    s.lights.push(light(spot(Vec3::Y, Vec3::NEG_Y, 10.0, 20.0), POWER));
    let rsm = maps(&s, 512);
    let area: f64 = rsm.maps[0].texels.iter().map(|t| f64::from(t.area)).sum();
    let exact = (1.0 + t * t).sqrt() * 2.0 * half * ((1.0 - t * half).powi(-2) - (1.0 + t * half).powi(-2))
        / (2.0 * t);
    // ω d²/cosθ at the texel's centre is a midpoint rule.
    assert!((area / exact - 1.0).abs() < 1e-4, "{area} {exact}");
    // Without the cosine (image-space radiosity's eq. 3 as printed) most of the area would be missing.
    let m = &rsm.maps[0];
    let printed: f64 = (0..m.texels.len())
        .map(|i| {
            let w = (m.surface.position[i] - Vec3::Y).normalize();
            f64::from(m.texels[i].area * -m.surface.normal[i].dot(w))
        })
        .sum();
    assert!(printed < 0.7 * exact, "{printed} {exact}");
}

#[test]
fn range_windows_the_flux() {
    // All surface at one distance: a far, tiny, facing square, so that the window is one number.
    let mut s = scene(ALBEDO);
    push_square(&mut s, Vec3::ZERO, 0.5, Mat3::IDENTITY);
    let mut l = light(LightKind::Point { position: Vec3::Y * 100.0 }, POWER);
    l.range = Some(200.0);
    s.lights.push(l.clone());
    let windowed = maps(&s, 256).reflected();
    l.range = None;
    s.lights[0] = l;
    let free = maps(&s, 256).reflected();
    assert!((windowed.x / free.x - (1.0 - 1.0 / 16.0)).abs() < 1e-5, "{windowed} {free}");
}
