//! The Cornell box in Bevy: Bevy draws direct light, radiance hints add three bounces of indirect light in a system of its render
//! schedule, after the main pass and before post-processing.

mod hints;

use std::f32::consts::PI;

use bevy::asset::RenderAssetUsages;
use bevy::camera::{Exposure, Hdr};
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use indirect_core::LightKind;

use hints::{HintsPlugin, StaticScene};

fn main() {
    let scene = indirect_scene::fixtures::cornell(indirect_scene::fixtures::CornellLight::Spot);
    App::new()
        .add_plugins(DefaultPlugins)
        .add_plugins(HintsPlugin(scene.clone()))
        .insert_resource(StaticScene(scene))
        .add_systems(Startup, spawn)
        .run();
}

/// The same scene as Bevy draws it.
fn spawn(
    mut commands: Commands,
    scene: Res<StaticScene>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let scene = &scene.0;
    for (i, material) in (0..).zip(&scene.materials) {
        let of_material = scene.mesh.triangles.iter().zip(&scene.mesh.materials).filter(|(_, m)| **m == i);
        let indices: Vec<u32> = of_material.flat_map(|(t, _)| *t).collect();
        let vectors = |of: &[Vec3]| of.iter().map(Vec3::to_array).collect::<Vec<_>>();
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vectors(&scene.mesh.positions))
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vectors(&scene.mesh.normals))
            .with_inserted_indices(Indices::U32(indices));
        let [r, g, b] = material.base_color.to_array();
        let diffuse = StandardMaterial {
            base_color: Color::linear_rgb(r, g, b),
            perceptual_roughness: 1.0,
            reflectance: 0.0,
            double_sided: true,
            cull_mode: None,
            ..default()
        };
        commands.spawn((Mesh3d(meshes.add(mesh)), MeshMaterial3d(materials.add(diffuse))));
    }
    for light in &scene.lights {
        if let LightKind::Spot { position, direction, inner_angle, outer_angle } = light.kind {
            // Bevy's lumens are those of a point light: 4π times its candela.
            let spot = SpotLight {
                intensity: 4.0 * PI * light.power.max_element(),
                inner_angle,
                outer_angle,
                range: 100.0,
                shadow_maps_enabled: true,
                ..default()
            };
            commands.spawn((spot, Transform::from_translation(position).looking_to(direction, Vec3::X)));
        }
    }
    let camera = &scene.cameras[0];
    commands.spawn((
        Camera3d::default(),
        Hdr,
        Msaa::Off,
        // Radiance of about 0.1 W/(sr·m²) is a dim room.
        Exposure { ev100: -3.0 },
        Transform::from_translation(camera.position).looking_to(camera.forward, camera.up),
    ));
}
