//! Containers, meshes, nodes, cameras and lights, each through a tiny file built here.

mod common;

use common::{Asset, BYTE, SHORT, UBYTE, UINT, USHORT, file};
use glam::{Vec2, Vec3};
use indirect_core::{CameraProjection, LightKind, Scene};
use indirect_scene::{LoadOptions, load};
use serde_json::json;

/// Smallest cosine between geometric and shading normals over all corners.
fn least_agreement(scene: &Scene) -> f32 {
    let mesh = &scene.mesh;
    let corners = (0..mesh.triangles.len() as u32).flat_map(|t| {
        let n = mesh.geometric_normal(t);
        mesh.triangles[t as usize].map(|v| n.dot(mesh.normals[v as usize]))
    });
    corners.fold(1.0, f32::min)
}

/// A unit square in the plane z = 0 that faces +z, with normals.
const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

fn square(mode: u32, order: &[u32], component: u32) -> Asset {
    let mut asset = Asset::lit();
    let position = asset.floats("VEC3", &SQUARE);
    let normal = asset.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let indices = asset.indices(component, order);
    let material = asset.material(json!({}));
    asset.mesh_node(json!({
        "attributes": {"POSITION": position, "NORMAL": normal}, "indices": indices, "mode": mode, "material": material,
    }));
    asset
}

#[test]
fn every_container_gives_the_same_scene() {
    let asset = Asset::triangle();
    let expected = asset.load_clean().scene;
    assert_eq!(expected.mesh.triangles, [[0, 1, 2]]);
    let (_dir, path) = file("scene.gltf", &asset.gltf());
    assert_eq!(load(&path, &LoadOptions::default()).unwrap().scene, expected);
    let (dir, path) = file("scene.GLTF", &asset.gltf_external("my%20buffer.bin"));
    std::fs::write(dir.path().join("my buffer.bin"), &asset.bin).unwrap();
    assert_eq!(load(&path, &LoadOptions::default()).unwrap().scene, expected);
}

#[test]
fn index_types_and_topologies() {
    let expected = square(4, &[0, 1, 2, 0, 2, 3], UINT).load_clean().scene;
    assert_eq!(expected.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(expected.mesh.positions.len(), 4);
    for component in [UBYTE, USHORT] {
        assert_eq!(square(4, &[0, 1, 2, 0, 2, 3], component).load_clean().scene, expected);
    }
    // A strip turns every other triangle, a fan shares its first vertex; both face +z everywhere.
    for (mode, order) in [(5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])] {
        let mesh = square(mode, &order, UBYTE).load_clean().scene.mesh;
        assert_eq!(mesh.triangles.len(), 2);
        assert!((0..2).all(|t| mesh.geometric_normal(t) == Vec3::Z && mesh.area(t) == 0.5), "mode {mode}");
    }
}

#[test]
fn points_and_lines_are_skipped_with_a_warning() {
    let mut asset = Asset::triangle();
    asset.mesh_node(json!({"attributes": {"POSITION": 0}, "mode": 0}));
    asset.mesh_node(json!({"attributes": {"POSITION": 0}, "mode": 3}));
    let loaded = asset.load().unwrap();
    assert_eq!((loaded.scene.mesh.triangles.len(), loaded.stats.skipped_primitives), (1, 2));
    assert!(
        loaded.warnings.iter().any(|w| w.contains("points, lines") && w.contains("and 1 more")),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn without_normals_vertices_split_and_shade_flat() {
    // Two faces of a tetrahedron on four shared vertices.
    let mut asset = Asset::lit();
    let position = asset.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let indices = asset.indices(USHORT, &[0, 1, 2, 0, 3, 1]);
    let material = asset.material(json!({}));
    asset.mesh_node(json!({"attributes": {"POSITION": position}, "indices": indices, "material": material}));
    let scene = asset.load_clean().scene;
    assert_eq!(scene.mesh.positions.len(), 6);
    assert_eq!(scene.mesh.normals[..3], [Vec3::Z; 3]);
    assert_eq!(scene.mesh.normals[3..], [Vec3::Y; 3]);
}

#[test]
fn node_transforms_multiply_and_mirrors_are_rewound() {
    let mut asset = square(4, &[0, 1, 2, 0, 2, 3], UBYTE);
    // Parent: 90° about y, then moved; child: moved along its own x.
    let child = asset.push("nodes", json!({"mesh": 0, "translation": [1, 0, 0]}));
    let turn = core::f32::consts::FRAC_1_SQRT_2;
    asset.node(json!({"children": [child], "rotation": [0, turn, 0, turn], "translation": [0, 10, 0]}));
    // Mirrored in x and stretched in z; a matrix with a shear.
    asset.node(json!({"mesh": 0, "scale": [-2, 1, 3]}));
    asset.node(json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0.5, 0, 0, 0, -1, 0, 0, 0, 0, 1]}));
    let scene = asset.load_clean().scene;
    assert_eq!(scene.mesh.triangles.len(), 8);
    // The child's corner (1, 0, 0) lands on (0, 10, -2).
    let p = scene.mesh.corners(2)[1];
    assert!((p - Vec3::new(0.0, 10.0, -2.0)).length() < 1e-6, "{p}");
    assert!((scene.mesh.geometric_normal(2) - Vec3::X).length() < 1e-6);
    // Inverse transpose and winding agree everywhere: normals stay on the front.
    assert!(least_agreement(&scene) > 1.0 - 1e-6, "{}", least_agreement(&scene));
    assert_eq!(scene.mesh.geometric_normal(4), Vec3::Z);
    assert_eq!(scene.mesh.area(4), 1.0);
    assert!(scene.mesh.geometric_normal(6).z < 0.0);
}

#[test]
fn flattened_meshes_keep_their_normals() {
    // Scaled to nothing along its own normal: the inverse transpose does not exist, the cofactor matrix does.
    let mut asset = square(4, &[0, 1, 2, 0, 2, 3], UBYTE);
    asset.root["nodes"][2]["scale"] = json!([1, 1, 0]);
    let scene = asset.load_clean().scene;
    assert!(scene.mesh.normals.iter().all(|&n| n == Vec3::Z));
}

#[test]
fn only_the_default_scene_is_read() {
    let mut asset = Asset::triangle();
    let other = asset.push("nodes", json!({"mesh": 0, "translation": [5, 0, 0]}));
    asset.push("scenes", json!({"nodes": [other]}));
    assert_eq!(asset.load_clean().scene.mesh.positions[0], Vec3::ZERO);
    asset.root["scene"] = json!(1);
    let loaded = asset.load().unwrap();
    assert_eq!(loaded.scene.mesh.positions[0], Vec3::X * 5.0);
    // That scene has neither camera nor light.
    assert_eq!(loaded.warnings.len(), 2);
    asset.root.as_object_mut().unwrap().remove("scene");
    assert!(asset.load().unwrap().warnings[0].contains("the first is used"));
    asset.root.as_object_mut().unwrap().remove("scenes");
    assert_eq!(asset.load_clean().scene.mesh.triangles.len(), 2);
}

#[test]
fn sparse_accessors_replace_values() {
    let mut asset = Asset::triangle();
    let indices = asset.view(&[1, 2]);
    let moved: Vec<u8> = [2.0_f32, 0.0, 0.0, 0.0, 3.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let values = asset.view(&moved);
    let sparse = json!({
        "count": 2, "indices": {"bufferView": indices, "componentType": UBYTE}, "values": {"bufferView": values},
    });
    asset.root["accessors"][0]["sparse"] = sparse;
    assert_eq!(asset.load_clean().scene.mesh.corners(0), [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 3.0]);
    // Without a buffer view, what is not replaced is zero.
    asset.root["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(asset.load_clean().scene.mesh.corners(0), [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 3.0]);
}

#[test]
fn quantized_and_strided_attributes() {
    let mut asset = Asset::lit();
    asset.root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // i16 positions, normalized, padded to 8 bytes; i8 normals, normalized, padded to 4.
    let short = |values: [i16; 4]| values.into_iter().flat_map(i16::to_le_bytes).collect::<Vec<u8>>();
    let bytes = [short([0, 0, 0, 7]), short([32767, 0, 0, 7]), short([0, -32768, 0, 7])].concat();
    let position = asset.accessor(SHORT, "VEC3", 3, &bytes);
    let normal = asset.accessor(BYTE, "VEC3", 3, &[0, 0, 0x81, 9].repeat(3));
    for (view, stride) in [(0, 8), (1, 4)] {
        asset.root["bufferViews"][view]["byteStride"] = json!(stride);
    }
    for accessor in [position, normal] {
        asset.root["accessors"][accessor]["normalized"] = json!(true);
    }
    let material = asset.material(json!({}));
    asset.mesh_node(json!({"attributes": {"POSITION": position, "NORMAL": normal}, "material": material}));
    let mesh = asset.load_clean().scene.mesh;
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::NEG_Y]);
    assert_eq!(mesh.normals, [Vec3::NEG_Z; 3]);
    // Plain integers are taken as they are.
    asset.root["accessors"][position]["normalized"] = json!(false);
    assert_eq!(asset.load_clean().scene.mesh.positions[1], Vec3::X * 32767.0);
}

#[test]
fn a_shared_vertex_buffer_is_not_copied_whole() {
    let mut asset = Asset::lit();
    let mut points = SQUARE.to_vec();
    // Vertices that no triangle uses may be anything, and do not count for the bounds.
    points.extend([f32::NAN, 1e30, -1e30]);
    let position = asset.floats("VEC3", &points);
    let normal = asset.floats("VEC3", &[0.0, 0.0, 1.0].repeat(5));
    let (a, b) = (asset.indices(UINT, &[0, 1, 2]), asset.indices(UINT, &[0, 2, 3]));
    let material = asset.material(json!({}));
    let attributes = json!({"POSITION": position, "NORMAL": normal});
    for indices in [a, b] {
        asset.mesh_node(json!({"attributes": attributes, "indices": indices, "material": material}));
    }
    let scene = asset.load_clean().scene;
    assert_eq!(scene.mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(scene.bounds().unwrap().max, Vec3::new(1.0, 1.0, 0.0));
}

#[test]
fn degenerate_triangles_are_dropped_and_counted() {
    // One good triangle, one with a repeated vertex, one with three collinear points.
    let mut asset = Asset::lit();
    let mut points = SQUARE.to_vec();
    points.extend([2.0, 0.0, 0.0]);
    let position = asset.floats("VEC3", &points);
    let indices = asset.indices(UBYTE, &[0, 1, 2, 2, 2, 3, 0, 1, 4]);
    let material = asset.material(json!({}));
    asset.mesh_node(json!({"attributes": {"POSITION": position}, "indices": indices, "material": material}));
    let loaded = asset.load().unwrap();
    assert_eq!((loaded.scene.mesh.triangles.len(), loaded.stats.degenerate_triangles), (1, 2));
    assert_eq!(loaded.warnings, ["2 triangles without area were dropped"]);
}

#[test]
fn unusable_normals_fall_back_to_the_face() {
    let mut asset = Asset::triangle();
    let normal = asset.floats("VEC3", &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0, 0.0, 5.0]);
    asset.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normal);
    assert_eq!(asset.load_clean().scene.mesh.normals, [Vec3::Z; 3]);
}

#[test]
fn vertex_colours_multiply_and_are_clamped() {
    let mut asset = Asset::triangle();
    let color = asset.accessor(UBYTE, "VEC4", 3, &[255, 0, 51, 0, 255, 0, 51, 0, 255, 0, 51, 0]);
    asset.root["accessors"][color]["normalized"] = json!(true);
    asset.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    let scene = asset.load_clean().scene;
    assert!((scene.albedo(0, 0.3, 0.3) - Vec3::new(0.5, 0.0, 0.1)).length() < 1e-6);
    // A mesh without colours beside it is white.
    asset.node(json!({"mesh": 0}));
    asset.mesh_node(json!({"attributes": {"POSITION": 0}, "material": 0}));
    let scene = asset.load_clean().scene;
    assert_eq!(scene.albedo(2, 0.3, 0.3), Vec3::splat(0.5));
    let color = asset.floats("VEC3", &[3.0, -1.0, 0.5].repeat(3));
    asset.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    let loaded = asset.load().unwrap();
    assert_eq!(loaded.scene.mesh.colors[0], Vec3::new(1.0, 0.0, 0.5));
    assert!(loaded.warnings[0].contains("clamped"));
}

#[test]
fn cameras_stand_where_their_nodes_do() {
    let mut asset = Asset::triangle();
    asset.push(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 4, "ymag": 2, "znear": 0, "zfar": 9}}),
    );
    asset.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.2, "zfar": 7, "aspectRatio": 1.5}}),
    );
    let turn = core::f32::consts::FRAC_1_SQRT_2;
    let inner = asset.push("nodes", json!({"name": "side", "camera": 1, "translation": [0, 0, 2]}));
    asset.node(json!({"rotation": [0, turn, 0, turn], "scale": [3, 3, 3], "children": [inner]}));
    asset.node(json!({"camera": 2}));
    let cameras = asset.load_clean().scene.cameras;
    assert_eq!(cameras.len(), 3);
    assert_eq!(
        (cameras[0].position, cameras[0].forward, cameras[0].up),
        (Vec3::Z * 3.0, Vec3::NEG_Z, Vec3::Y)
    );
    assert!(cameras[0].far.is_infinite());
    let side = &cameras[1];
    assert_eq!((side.name.as_str(), side.aspect), ("side", Some(2.0)));
    assert!((side.position - Vec3::X * 6.0).length() < 1e-5 && (side.forward + Vec3::X).length() < 1e-6);
    assert_eq!(side.projection, CameraProjection::Orthographic { half_height: 2.0 });
    assert_eq!((cameras[2].near, cameras[2].far, cameras[2].aspect), (0.2, 7.0, Some(1.5)));
}

#[test]
fn lights_of_every_kind() {
    let mut asset = Asset::triangle();
    asset.root["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"type": "point", "color": [1, 0.5, 0], "intensity": 4, "range": 10},
        {"type": "directional", "intensity": 2},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
        {"type": "spot", "spot": {}},
    ]);
    let turn = core::f32::consts::FRAC_1_SQRT_2;
    for light in 1..4 {
        asset.node(json!({
            "rotation": [-turn, 0, 0, turn], "translation": [0, 2, 0],
            "extensions": {"KHR_lights_punctual": {"light": light}},
        }));
    }
    let lights = asset.load_clean().scene.lights;
    assert_eq!((lights[0].power, lights[0].range), (Vec3::new(4.0, 2.0, 0.0), Some(10.0)));
    assert_eq!(lights[0].kind, LightKind::Point { position: Vec3::Z * 3.0 });
    let LightKind::Directional { direction } = lights[1].kind else { panic!("{:?}", lights[1]) };
    assert!((direction + Vec3::Y).length() < 1e-6);
    let LightKind::Spot { position, direction, inner_angle, outer_angle } = lights[2].kind else {
        panic!("{:?}", lights[2])
    };
    assert_eq!((position, inner_angle, outer_angle), (Vec3::Y * 2.0, 0.1, 0.2));
    assert!((direction + Vec3::Y).length() < 1e-6);
    assert!(matches!(lights[3].kind, LightKind::Spot { inner_angle: 0.0, outer_angle, .. }
        if outer_angle == core::f32::consts::FRAC_PI_4));
}

#[test]
fn defaults_are_stated() {
    let mut asset = Asset::new();
    let position = asset.floats("VEC3", &SQUARE[..9]);
    let material = asset.material(json!({}));
    asset.mesh_node(json!({"attributes": {"POSITION": position}, "material": material}));
    let loaded = asset.load().unwrap();
    assert!(loaded.warnings[0].contains("no camera") && loaded.warnings[1].contains("no light"));
    // The camera frames all corners, and the lamp lights the surface it sees.
    let scene = &loaded.scene;
    let view = scene.cameras[0].view([100, 100]);
    for p in scene.bounds().unwrap().corners() {
        let (pixel, depth) = view.project(p, [100, 100]).unwrap();
        assert!(pixel.min_element() > 0.0 && pixel.max_element() < 100.0 && depth > view.near);
    }
    assert!(scene.lights[0].sample(Vec3::new(0.3, 0.3, 0.0)).irradiance.min_element() > 0.0);
    // An emitter is light enough.
    asset.root["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    assert_eq!(asset.load().unwrap().warnings.len(), 1);
}

#[test]
fn what_does_not_move_is_said() {
    let mut asset = Asset::triangle();
    asset.root["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
    asset.root["nodes"][2]["skin"] = json!(0);
    asset.root["skins"] = json!([{"joints": [0]}]);
    asset.root["animations"] = json!([{"channels": [], "samplers": []}]);
    asset.root["extensionsUsed"] = json!(["KHR_materials_transmission", "VENDOR_unheard_of"]);
    let warnings = asset.load().unwrap().warnings.join("\n");
    for part in ["morph targets", "skinned", "animations", "`KHR_materials_transmission`"] {
        assert!(warnings.contains(part), "{warnings}");
    }
    assert_eq!(warnings.lines().count(), 4, "{warnings}");
}

#[test]
fn texture_coordinates_are_kept_only_where_a_texture_reads_them() {
    let mut asset = Asset::triangle();
    let uv = asset.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    asset.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    assert!(asset.load_clean().scene.mesh.uvs.is_empty());
    let texture = asset.png(1, 1, |_, _| [255; 4]);
    asset.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
    assert_eq!(asset.load_clean().scene.mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
}
