//! The estimator's parts against each other and against brute force.

mod common;

use common::*;
use glam::{Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{
    AlphaMode, Light, LightKind, Material, Mesh, Ray, Scene, Texture, TextureRef, View, Wrap, math,
};
use reference_pathtracer::{
    Bounces, Components, EmitterSampling, PixelFilter, Samples, Settings, VirtualLights, render,
};

/// Šidák's threshold for `n` two-sided tests at 1 % altogether with normal scores, n ≤ 16.
const SIGMAS: f64 = 3.5;

#[test]
fn ways_to_sample_emitters_agree() {
    let (scene, view) = (room(true), room_view());
    let run = |emitters, virtual_lights, spp| {
        run(&scene, &view, [24, 24], &Settings { emitters, virtual_lights, ..samples(spp, 32) }).mean()
    };
    let mis = run(EmitterSampling::Mis, VirtualLights::Off, 128);
    for (what, other) in [
        ("virtual lights", run(EmitterSampling::Mis, VirtualLights::On, 64)),
        ("light", run(EmitterSampling::Light, VirtualLights::Off, 128)),
        ("surface", run(EmitterSampling::Surface, VirtualLights::Off, 512)),
    ] {
        assert_agree(&format!("{what}: direct"), mis[0], other[0], SIGMAS, 0.01);
        assert_agree(&format!("{what}: indirect"), mis[1], other[1], SIGMAS, 0.01);
    }
}

#[test]
fn roulette_virtual_lights_and_filters_keep_the_mean() {
    for panel in [false, true] {
        let (scene, view) = (room(panel), room_view());
        let base =
            Settings { bounces: Bounces::Count(4), virtual_lights: VirtualLights::Off, ..samples(128, 32) };
        let [_, indirect] = run(&scene, &view, [24, 24], &base).mean();
        let without = Settings { roulette: false, ..base };
        let [_, other] = run(&scene, &view, [24, 24], &without).mean();
        assert_agree(&format!("panel {panel}: no roulette"), indirect, other, SIGMAS, 0.015);
        let shared = Settings { virtual_lights: VirtualLights::On, ..base };
        let [_, other] = run(&scene, &view, [24, 24], &shared).mean();
        assert_agree(&format!("panel {panel}: virtual lights"), indirect, other, SIGMAS, 0.015);
        // The same integral over the film: 24² pixels of the box filter against 480² centres, a midpoint rule whose error is some
        // 2000 edge pixels of random share among 230 000, far below the noise. Emitters would add noise of their own.
        let boxed = Settings { pixel_filter: PixelFilter::Box, ..base };
        let direct = Settings { components: Components::Direct, ..boxed };
        if !panel {
            // Rolled, so that edges do not run along the grid.
            let view = View::look_to(
                view.origin,
                view.forward,
                Vec3::new(0.3, 1.0, 0.0),
                view.projection,
                0.01,
                1e9,
            );
            let [drawn, _] = run(&scene, &view, [24, 24], &direct).mean();
            let [fine, _] = run(&scene, &view, [480, 480], &samples_of(Components::Direct)).mean();
            assert_closed_form("box filter, direct", drawn, fine.value, 2e-4);
        }
        let [_, boxed] = run(&scene, &view, [24, 24], &boxed).mean();
        let [_, fine] = run(&scene, &view, [96, 96], &with_batch(&base, 8)).mean();
        assert_agree(&format!("panel {panel}: box filter"), boxed, fine, SIGMAS, 0.015);
    }
}

fn samples_of(components: Components) -> Settings {
    Settings { components, ..samples(1, 1) }
}

fn with_batch(base: &Settings, batch: u32) -> Settings {
    Settings { samples: Samples { batch, ..base.samples }, ..*base }
}

/// Components are the same numbers alone or together.
#[test]
fn components_apart_are_components_together() {
    let (scene, view) = (room(true), room_view());
    let of = |components| run(&scene, &view, [16, 16], &Settings { components, ..samples(64, 16) });
    let (both, direct, indirect) = (of(Components::Both), of(Components::Direct), of(Components::Indirect));
    assert_agree("direct", both.mean()[0], direct.mean()[0], SIGMAS, 0.01);
    assert_agree("indirect", both.mean()[1], indirect.mean()[1], SIGMAS, 0.02);
    assert_eq!((direct.mean()[1].value, indirect.mean()[0].value), (0.0, 0.0));
    assert_eq!(both.full().pixels[7], both.direct.pixels[7] + both.indirect.pixels[7]);
}

/// Two emitting walls, a textured emitter, and one whose back must stay dark.
#[test]
fn textured_one_and_two_sided_emitters() {
    let image = |texels: [[u16; 4]; 4]| Texture {
        name: String::new(),
        size: [2, 2],
        texels: texels.to_vec(),
        wrap: [Wrap::Clamp; 2],
    };
    let (on, off) = ([65535; 4], [0, 0, 0, 65535]);
    let mut scene = floor(2.0, 0.5);
    scene.textures.push(image([on, on, off, off]));
    let texture = Some(TextureRef { texture: 0, uv_transform: glam::Affine2::IDENTITY });
    scene.materials.push(Material { emission_texture: texture, ..emitter(0.2, 4.0) });
    scene.materials.push(Material { double_sided: true, ..emitter(0.2, 1.0) });
    scene.mesh.uvs = vec![Vec2::ZERO; 4];
    // Front down, then front up: the second lights the floor only because it is two-sided.
    scene.mesh.push_polygon(&rectangle(Vec3::Y, Vec3::X, Vec3::Z), 1);
    scene.mesh.uvs[4..8].copy_from_slice(&[Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    scene.mesh.push_polygon(&rectangle(Vec3::new(0.0, 0.5, 0.0), Vec3::Z * 0.2, Vec3::X * 0.2), 2);
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 1.5, 0.1);
    let of = |emitters, spp| {
        run(&scene, &view, [16, 16], &Settings { emitters, bounces: Bounces::Count(2), ..samples(spp, 32) })
            .mean()
    };
    let (mis, light, surface) =
        (of(EmitterSampling::Mis, 64), of(EmitterSampling::Light, 64), of(EmitterSampling::Surface, 128));
    for k in 0..2 {
        assert_agree("light", mis[k], light[k], SIGMAS, 0.02);
        assert_agree("surface", mis[k], surface[k], SIGMAS, 0.02);
    }
    // Seen from behind, a one-sided emitter is dark and a two-sided one is not.
    for (material, expected) in [(1, 0.0), (2, 1.0)] {
        let mut alone = scene.clone();
        alone.mesh = Mesh::default();
        alone.mesh.push_polygon(&rectangle(Vec3::ZERO, Vec3::X, Vec3::Z), material);
        alone.mesh.uvs = vec![Vec2::ZERO; 4];
        let r = run(&alone, &view, [2, 2], &samples(1, 1));
        assert_eq!(r.direct.pixels[0].x, expected);
    }
}

/// A lamp of which an alpha mask cuts away one half lights as one that is half as large, however it is sampled.
#[test]
fn a_masked_emitter_emits_only_where_it_is_solid() {
    // A floor and a ceiling, so that indirect light has a share of its own, and a lamp between them that shines down.
    let with_lamp = |lamp: Material, centre: Vec3, half: Vec3| {
        let mut scene = floor(2.0, 0.5);
        scene.mesh.push_polygon(&rectangle(Vec3::Y * 2.0, Vec3::X * 2.0, Vec3::Z * 2.0), 0);
        scene.materials.push(lamp);
        scene.mesh.uvs = vec![Vec2::ZERO; 8];
        scene.mesh.push_polygon(&rectangle(centre, half.with_z(0.0), half.with_x(0.0)), 1);
        scene.mesh.uvs[8..].copy_from_slice(&[Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        scene
    };
    // Alpha rises from 0 to 1 between the centres of two rows of texels: the cutoff 1/2 lies in the middle.
    let mut masked = with_lamp(
        Material {
            base_color_texture: Some(TextureRef { texture: 0, uv_transform: glam::Affine2::IDENTITY }),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            ..emitter(0.2, 4.0)
        },
        Vec3::Y,
        Vec3::new(0.5, 0.0, 0.5),
    );
    masked.textures.push(Texture {
        name: String::new(),
        size: [1, 2],
        texels: vec![[65535, 65535, 65535, 0], [65535; 4]],
        wrap: [Wrap::Clamp; 2],
    });
    masked.validate().unwrap();
    let solid = with_lamp(emitter(0.2, 4.0), Vec3::new(0.0, 1.0, 0.25), Vec3::new(0.5, 0.0, 0.25));
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 1.5, 0.1);
    let of = |scene: &Scene, emitters, virtual_lights, spp| {
        let s = Settings { emitters, virtual_lights, bounces: Bounces::Count(2), ..samples(spp, 32) };
        run(scene, &view, [16, 16], &s).mean()
    };
    let half = of(&solid, EmitterSampling::Mis, VirtualLights::Off, 64);
    for (what, emitters, virtual_lights, spp) in [
        ("mis", EmitterSampling::Mis, VirtualLights::Off, 64),
        ("virtual lights", EmitterSampling::Mis, VirtualLights::On, 64),
        ("light", EmitterSampling::Light, VirtualLights::Off, 64),
        ("surface", EmitterSampling::Surface, VirtualLights::Off, 256),
    ] {
        let other = of(&masked, emitters, virtual_lights, spp);
        assert_agree(&format!("{what}: direct"), half[0], other[0], SIGMAS, 0.01);
        assert_agree(&format!("{what}: indirect"), half[1], other[1], SIGMAS, 0.02);
    }
}

/// 1000 lights, drawn among 16 candidates, against the sum over all of them.
#[test]
fn many_lights_are_unbiased() {
    let mut scene = floor(4.0, 0.5);
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / 16_777_216.0
    };
    for i in 0..1000 {
        let position = Vec3::new(random() * 8.0 - 4.0, 0.2 + random(), random() * 8.0 - 4.0);
        let kind = match i % 3 {
            0 => LightKind::Point { position },
            1 => LightKind::Spot { position, direction: Vec3::NEG_Y, inner_angle: 0.3, outer_angle: 1.0 },
            _ => LightKind::Directional {
                direction: Vec3::new(random() - 0.5, -1.0, random() - 0.5).normalize(),
            },
        };
        scene.lights.push(Light { range: (i % 2 == 0).then_some(3.0), ..light(kind, random() * 1e-2) });
    }
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 3.0, 0.1);
    // At pixel centres all lights are summed; through the box filter they are drawn.
    let exact = run(&scene, &view, [64, 64], &samples(1, 1)).mean()[0].value;
    let s = Settings { pixel_filter: PixelFilter::Box, components: Components::Direct, ..samples(16, 32) };
    let drawn = run(&scene, &view, [32, 32], &s).mean()[0];
    // 64² midpoints under lights at least 0.2 above: 3 cells per height, second order, about 0.1 %.
    assert_closed_form("1000 lights", drawn, exact, 1e-3);
    // Light paths draw them too: onto a ceiling, by one bounce.
    scene.mesh.push_polygon(&rectangle(Vec3::Y * 3.0, Vec3::X * 4.0, Vec3::Z * 4.0), 0);
    scene.lights.retain(|l| !matches!(l.kind, LightKind::Directional { .. }));
    let up = onto(Vec3::Y * 3.0, Vec3::Y, Vec3::Z, 3.0, 0.1);
    let of = |virtual_lights| {
        let s = Settings { bounces: Bounces::Count(1), virtual_lights, ..samples(64, 32) };
        run(&scene, &up, [24, 24], &s).mean()[1]
    };
    assert_agree("virtual lights", of(VirtualLights::Off), of(VirtualLights::On), SIGMAS, 0.01);
}

/// A floor lit by a spot, a wall beside it and a screen between them.
fn screened(screen: bool) -> Scene {
    let mut scene = floor(1.0, 0.7);
    scene.mesh.push_polygon(&rectangle(Vec3::new(-1.0, 1.0, 0.0), Vec3::Y, Vec3::Z), 0);
    if screen {
        scene.mesh.push_polygon(&rectangle(Vec3::new(-0.7, 0.5, 0.0), Vec3::Y * 0.45, Vec3::Z * 2.0), 0);
    }
    let kind = LightKind::Spot {
        position: Vec3::new(0.3, 2.0, 0.1),
        direction: Vec3::NEG_Y,
        inner_angle: 0.2,
        outer_angle: 0.3,
    };
    scene.lights.push(light(kind, 5.0));
    scene
}

#[test]
fn virtual_lights_keep_the_mean_without_occlusion() {
    let view = room_view();
    for (what, scene) in [("room", room(false)), ("emitter", room(true))] {
        let of = |virtual_lights, spp| {
            let unoccluded =
                Settings { bounces: Bounces::Count(1), unoccluded: true, virtual_lights, ..samples(spp, 32) };
            run(&scene, &view, [24, 24], &unoccluded).mean()[1]
        };
        assert_agree(what, of(VirtualLights::Off, 128), of(VirtualLights::On, 64), SIGMAS, 0.01);
    }
}

/// One bounce without occlusion against brute force: all texels of a fine grid over the lit floor as virtual point lights.
#[test]
fn unoccluded_is_the_sum_over_virtual_point_lights() {
    let view = onto(Vec3::new(-1.0, 1.0, 0.0), Vec3::NEG_X, Vec3::Y, 0.6, 0.05);
    let size = [12, 12];
    let settings = |unoccluded| Settings { unoccluded, bounces: Bounces::Count(1), ..samples(64, 32) };
    // Nothing in the way: the same with and without.
    let open = screened(false);
    let [_, free] = run(&open, &view, size, &settings(false)).mean();
    let [_, off] = run(&open, &view, size, &settings(true)).mean();
    assert_agree("open", free, off, SIGMAS, 0.01);
    // The screen hides the floor from the wall, but not when occlusion is off.
    let scene = screened(true);
    let accel = Accel::build(&scene, BuildPreset::Balanced);
    let estimate = render(&accel, &view, size, &settings(true)).unwrap();
    let [_, occluded] = run(&scene, &view, size, &settings(false)).mean();
    let spot = &scene.lights[0];
    // n² cells over the square that holds the lit disc, radius 2·tan 0.3 = 0.62.
    let n = 400;
    let cell = 1.4 / n as f32;
    let mut vpls = Vec::new();
    for i in 0..n * n {
        let p = Vec3::new(0.3 - 0.7, 0.0, 0.1 - 0.7)
            + Vec3::new((i % n) as f32 + 0.5, 0.0, (i / n) as f32 + 0.5) * cell;
        let s = spot.sample(p);
        if s.irradiance.x > 0.0 && s.direction.y > 0.0 && p.x.abs() < 1.0 && p.z.abs() < 1.0 {
            let origin = math::offset_ray_origin_scaled(p, Vec3::Y, accel.unit());
            let to_light = Ray { origin, direction: s.direction * s.distance, t_max: 0.999 };
            assert!(!accel.any_hit(&to_light));
            vpls.push((p, 0.7 * s.irradiance.x * s.direction.y * cell * cell));
        }
    }
    let mut expected = 0.0_f64;
    for i in 0..size[0] * size[1] {
        let pixel = Vec2::new((i % size[0]) as f32, (i / size[0]) as f32) + 0.5;
        let x = view.ray(pixel, size).at(0.05);
        for &(p, flux) in &vpls {
            let (to, pi) = (p - x, core::f32::consts::PI);
            let d2 = to.length_squared();
            let (cos_x, cos_p) = (to.x / d2.sqrt(), -to.y / d2.sqrt());
            expected += f64::from(0.7 / pi * flux / pi * cos_x.max(0.0) * cos_p.max(0.0) / d2);
        }
    }
    expected /= f64::from(size[0] * size[1]);
    // 400² midpoints over a smooth bump with a C¹ rim: second order, below 1e-4.
    assert_closed_form("unoccluded", estimate.mean()[1], expected, 1e-4);
    assert!(occluded.value < 0.5 * expected, "the screen must matter: {occluded:?} {expected}");
}

/// A point that is lit from behind adds nothing to the front: the screen's far side is lit, its near side is seen.
#[test]
fn unoccluded_respects_the_lit_side() {
    let mut scene = floor(1.0, 0.7);
    // A sheet above the floor, lit from above: the floor below sees its dark side.
    scene.mesh.push_polygon(&rectangle(Vec3::Y, Vec3::X, Vec3::Z), 0);
    scene.lights.push(light(LightKind::Point { position: Vec3::Y * 2.0 }, 5.0));
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 0.5, 0.1);
    let s = Settings { unoccluded: true, ..samples(64, 4) };
    assert_eq!(run(&scene, &view, [8, 8], &s).mean()[1].value, 0.0);
}

/// Behind the first surface an emitter's light is found too, and only direct light passes through.
#[test]
fn unoccluded_with_emitters_and_more_bounces() {
    let mut scene = screened(true);
    scene.lights.clear();
    scene.materials.push(emitter(0.0, 20.0));
    scene.mesh.push_polygon(&rectangle(Vec3::new(0.4, 1.5, 0.0), Vec3::X * 0.2, Vec3::Z * 0.2), 1);
    let view = onto(Vec3::new(-1.0, 1.0, 0.0), Vec3::NEG_X, Vec3::Y, 0.6, 0.05);
    let of = |emitters, bounces, spp| {
        let s = Settings { unoccluded: true, emitters, bounces: Bounces::Count(bounces), ..samples(spp, 32) };
        run(&scene, &view, [12, 12], &s).mean()[1]
    };
    for bounces in [1, 3] {
        let mis = of(EmitterSampling::Mis, bounces, 128);
        assert_agree("light", mis, of(EmitterSampling::Light, bounces, 128), SIGMAS, 0.02);
        assert_agree("surface", mis, of(EmitterSampling::Surface, bounces, 512), SIGMAS, 0.02);
    }
}

/// The variance image is honest: over independent seeds, squared errors are what it says.
#[test]
fn variance_and_noise_are_honest() {
    for virtual_lights in [VirtualLights::Off, VirtualLights::On] {
        let (scene, view, size) = (room(true), room_view(), [16, 16]);
        let accel = Accel::build(&scene, BuildPreset::Balanced);
        let of =
            |seed| render(&accel, &view, size, &Settings { seed, virtual_lights, ..samples(8, 8) }).unwrap();
        let runs: Vec<_> = (0..24).map(of).collect();
        for (component, name) in [(0, "direct"), (1, "indirect")] {
            let image = |k: usize| if component == 0 { &runs[k].direct } else { &runs[k].indirect };
            let said =
                |k: usize| if component == 0 { &runs[k].direct_variance } else { &runs[k].indirect_variance };
            let (mut scatter, mut promised) = (0.0, 0.0);
            for p in 0..256 {
                let mean = (0..24).map(|k| f64::from(image(k).pixels[p].y)).sum::<f64>() / 24.0;
                scatter +=
                    (0..24).map(|k| (f64::from(image(k).pixels[p].y) - mean).powi(2)).sum::<f64>() / 23.0;
                promised += (0..24).map(|k| f64::from(said(k).pixels[p].y)).sum::<f64>() / 24.0;
            }
            println!("{virtual_lights:?} {name}: scatter / variance {:.3}", scatter / promised);
            // Both sides have thousands of degrees of freedom, fewer where light paths are shared (24 × 8 pools): heavy tails leave
            // some 10 %.
            assert!((scatter / promised - 1.0).abs() < 0.3, "{name}: {scatter} against {promised}");
        }
        let noise = runs[0].noise();
        assert!(noise.iter().all(|n| *n > 0.0 && *n < 1.0), "{noise:?}");
    }
}
