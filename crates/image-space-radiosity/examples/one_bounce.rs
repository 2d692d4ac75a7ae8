//! One bounce of a spot light in a corner: prints the mean indirect radiance and what it was made from.

#![allow(clippy::print_stdout, reason = "an example's output")]

use glam::{Vec2, Vec3};
use image_space_radiosity::{ImageSpaceRadiosity, Output, Setup, cpu::Frame};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{Light, LightKind, Material, Projection, Scene, View};
use indirect_technique::cpu::run;

fn main() {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    scene.mesh.push_polygon(&[-x + z, x + z, x - z, -x - z], 0);
    scene.mesh.push_polygon(&[-x - z, x - z, x - z + 2.0 * y, -x - z + 2.0 * y], 0);
    scene.lights.push(Light {
        name: "spot".into(),
        kind: LightKind::Spot { position: y * 2.0, direction: -y, inner_angle: 0.2, outer_angle: 0.4 },
        power: Vec3::splat(10.0),
        range: None,
    });

    let accel = Accel::build(&scene, BuildPreset::Fast);
    let projection = Projection::Perspective { tan_half: Vec2::splat(0.6) };
    let view = View::look_to(Vec3::new(0.0, 1.0, 3.0), -z, y, projection, 0.1, 10.0);
    let camera = cast::gbuffer(&accel, &view, [256, 256]);

    let (setup, mut light) = (Setup::default(), Output::default());
    let passes = run::<ImageSpaceRadiosity>(&Frame::new(&accel, &view, &camera, &setup), &mut light);
    println!("mean indirect radiance {:.4} W/(sr·m²)", light.image.mean().x);
    let pixels = (0..camera.len()).filter(|i| camera.is_surface(*i)).count();
    println!("{} fragments for {pixels} pixels that see a surface", light.fragments.nodes.len());
    let cuts: f64 = light.cuts.iter().map(|c| f64::from(*c)).sum();
    let texels = light.rsm.maps.iter().flat_map(|m| &m.texels).filter(|t| t.reflected.x > 0.0).count();
    println!("{:.0} lights per fragment of {texels} texels", cuts / light.cuts.len() as f64);
    for pass in &passes {
        println!("{:>8} {:6.2} ms", pass.name, pass.ms);
    }
}
