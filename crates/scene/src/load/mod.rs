//! glTF 2.0 into a [`Scene`].

mod accessor;
mod file;
mod loaded;
mod material;
mod mesh;
mod node;
mod options;
mod texture;
mod warnings;

use std::path::Path;

use glam::Vec3;
use indirect_core::{Camera, CameraProjection, Light, LightKind, Scene, SceneProfile};

use crate::{SceneLoadError, fixtures};
use file::File;
use mesh::MeshBuilder;
use warnings::Warnings;

pub use loaded::{LoadStats, Loaded};
pub use options::LoadOptions;

/// Reads a `.gltf` or `.glb` file: the nodes of its default scene, expanded into world space.
///
/// A file without a camera gets one that frames the bounds from outside; one without light or emission a point light at
/// its first camera, of intensity `π r²` with `r` half the diagonal of the bounds. Both are warned about.
///
/// Memory and time are in proportion to the file and to the triangles its instances add up to, whatever the file claims:
/// every count is checked against the data behind it first.
///
/// # Errors
/// The first thing that keeps the file from becoming a scene that passes [`Scene::validate`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneLoadError> {
    let display = || path.display().to_string();
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    if !matches!(extension.as_deref(), Some("gltf" | "glb")) {
        return Err(SceneLoadError::NotGltf { path: display(), fixtures: fixtures::NAMES.join(", ") });
    }
    let bytes = std::fs::read(path).map_err(|source| SceneLoadError::Io { path: display(), source })?;
    load_bytes(&bytes, path, options)
}

/// [`load`] for a file that is already in memory. `path` names it in messages, and the files that it refers to are looked
/// for beside it.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Loaded, SceneLoadError> {
    let display = || path.display().to_string();
    let file = File::open(path, bytes)?;
    let mut warnings = Warnings::default();
    for name in &file.root.extensions_used {
        if let Some(message) = ignored_extension(name) {
            warnings.add(message, format!("`{name}`"));
        }
    }
    if !file.root.animations.is_empty() {
        warnings.add("animations are not modelled: the rest pose is used", "");
    }
    let nodes = node::read(&file, &mut warnings)?;
    let mut stats = LoadStats::default();
    let survey = mesh::survey(&file, &nodes.instances, options, &mut warnings, &mut stats)?;
    let materials = material::read(&file, &survey.used, options, &mut warnings)?;
    let mut builder = MeshBuilder::new(&file, &materials.uv_set, &survey, stats, options);
    for instance in &nodes.instances {
        builder.add(instance, &mut warnings)?;
    }
    let (mesh, stats, lightmap_uvs) = builder.finish();
    if stats.degenerate_triangles > 0 {
        warnings.add(format!("{} triangles without area were dropped", stats.degenerate_triangles), "");
    }
    if mesh.triangles.is_empty() {
        let hint = match stats {
            LoadStats { degenerate_triangles: n @ 1.., .. } => format!(", only {n} without area"),
            LoadStats { skipped_primitives: n @ 1.., .. } => {
                format!(", only {n} meshes of points, lines or nothing")
            }
            _ => String::new(),
        };
        return Err(SceneLoadError::NoTriangles { path: display(), hint });
    }
    let mut scene = Scene {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        mesh,
        materials: materials.materials,
        textures: materials.textures,
        lights: nodes.lights,
        cameras: nodes.cameras,
    };
    add_defaults(&mut scene, &mut warnings);
    scene.validate().map_err(|source| SceneLoadError::Invalid { path: display(), source })?;
    Ok(Loaded { scene, warnings: warnings.into_lines(), stats, lightmap_uvs })
}

/// What an optional extension that this crate skips does to the picture; `None` where nothing is lost.
fn ignored_extension(name: &str) -> Option<&'static str> {
    match name {
        "EXT_mesh_gpu_instancing" => Some("instances are not modelled: each mesh is drawn once"),
        "KHR_materials_pbrSpecularGlossiness" => {
            Some("specular-glossiness is not modelled: the metallic-roughness values are used")
        }
        "KHR_materials_unlit" => Some("unlit materials are read as diffuse ones"),
        "KHR_materials_transmission" => {
            Some("transmission is modelled by Whitted ray tracing alone: else the surface is opaque")
        }
        "KHR_materials_volume" | "KHR_materials_diffuse_transmission" => {
            Some("transmission is not modelled: the surface is opaque")
        }
        "KHR_materials_variants" => Some("variants are not modelled: the default materials are used"),
        "EXT_lights_image_based" | "EXT_lights_ies" => Some("these lights are not modelled"),
        _ => None,
    }
}

/// A file without a camera is framed from outside its bounds; one without any light gets a lamp where its first camera is,
/// which reaches the inside of rooms as well as the outside of objects.
fn add_defaults(scene: &mut Scene, warnings: &mut Warnings) {
    let Some(bounds) = scene.bounds() else { return };
    let radius = 0.5 * bounds.diagonal();
    if scene.cameras.is_empty() {
        const YFOV: f32 = 0.8;
        let forward = Vec3::new(-0.5, -0.4, -1.0).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let distance = 1.05 * radius / (0.5 * YFOV).sin();
        scene.cameras.push(Camera {
            name: "default".into(),
            position: bounds.centre() - forward * distance,
            forward,
            up: right.cross(forward),
            projection: CameraProjection::Perspective { yfov: YFOV },
            aspect: None,
            near: 0.01 * radius,
            far: f32::INFINITY,
        });
        warnings.add("no camera: a default one looks at the whole scene from outside", "");
    }
    if scene.lights.is_empty() && SceneProfile::of(scene).emissive_triangles == 0 {
        // Radiance of about albedo · (radius/distance)².
        let power = Vec3::splat(core::f32::consts::PI * radius * radius);
        let kind = LightKind::Point { position: scene.cameras[0].position };
        scene.lights.push(Light { name: "default".into(), kind, power, range: None });
        warnings.add("no light and no emission: a default point light shines at the first camera", "");
    }
}
