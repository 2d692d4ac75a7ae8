//! Every kind of unusable file ends in one line that names the file, the element and the way out.

mod common;

use std::path::Path;

use common::{Asset, UBYTE, UINT, file};
use indirect_scene::{LoadOptions, SceneLoadError, load, resolve};
use serde_json::json;

fn fails(asset: &Asset, parts: &[&str]) {
    let error = asset.error();
    assert!(parts.iter().all(|p| error.contains(p)), "{error:?} lacks one of {parts:?}");
}

fn load_bytes(name: &str, bytes: &[u8]) -> String {
    let (_dir, path) = file(name, bytes);
    load(&path, &LoadOptions::default()).expect_err("loads although it is damaged").to_string()
}

#[test]
fn names_that_are_no_scene() {
    let error = |name: &str| resolve(name, &LoadOptions::default()).unwrap_err();
    assert!(matches!(error("no/such/file.glb"), SceneLoadError::Io { .. }));
    assert!(error("no/such/file.glb").to_string().starts_with("no/such/file.glb: cannot be read"));
    assert!(error("scene.obj").to_string().contains("neither a glTF file"));
    assert!(error("cornel").to_string().contains("cornell_spot"));
    assert!(error("").to_string().contains("neither"));
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("folder.glb");
    std::fs::create_dir(&folder).unwrap();
    assert!(matches!(load(&folder, &LoadOptions::default()), Err(SceneLoadError::Io { .. })));
}

#[test]
fn damaged_containers() {
    let glb = Asset::triangle().glb();
    assert!(load_bytes("a.glb", &glb[..glb.len() - 8]).contains("truncated: its header states"));
    assert!(load_bytes("a.glb", &glb[..10]).contains("truncated"));
    assert!(load_bytes("a.glb", b"").contains("JSON is damaged"));
    let mut version = glb.clone();
    version[4] = 1;
    assert!(load_bytes("a.glb", &version).contains("GLB version 1"));
    let mut chunk = glb.clone();
    chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(load_bytes("a.glb", &chunk).contains("a chunk of 4294967295 bytes"));
    assert!(load_bytes("a.glb", b"glTF\x02\0\0\0\x0c\0\0\0").contains("no JSON chunk"));
    assert!(load_bytes("a.gltf", b"{\"asset\": {\"version\": \"2.0\"").contains("JSON is damaged"));
    // Nesting must not exhaust the stack, neither where it is skipped nor where it is kept.
    for (key, part) in [("extras", "no triangles"), ("extensions", "recursion limit")] {
        let deep = format!("{}{}", "{\"a\":".repeat(100_000), "1".to_owned() + &"}".repeat(100_000));
        let deep = format!("{{\"asset\": {{\"version\": \"2.0\"}}, \"{key}\": {deep}}}");
        let message = load_bytes("a.gltf", deep.as_bytes());
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn buffers_that_are_not_there() {
    let asset = Asset::triangle();
    let error = |uri: &str| load_bytes("a.gltf", &asset.gltf_external(uri));
    assert!(error("gone.bin").contains("a.gltf: buffer 0: its file `gone.bin` cannot be read: "));
    // Text from the file is kept short and on one line.
    let long = error(&"line\n".repeat(1000));
    assert!(long.contains("`line\\nline\\n") && long.lines().count() == 1 && long.len() < 400, "{long}");
    assert!(error("https://example.org/b.bin").contains("not relative"));
    assert!(error("/etc/hostname").contains("not relative"));
    assert!(error(".").contains("regular file") || error(".").contains("cannot be read"));
    assert!(error("data:application/octet-stream,abc").contains("not base64"));
    assert!(error("data:application/octet-stream;base64,A").contains("damaged"));
    assert!(error("data:application/octet-stream;base64,AAAA").contains("only 3 are there"));
    let (dir, path) = file("a.gltf", &asset.gltf_external("b.bin"));
    std::fs::write(dir.path().join("b.bin"), &asset.bin[..5]).unwrap();
    let message = load(&path, &LoadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("buffer 0: 36 bytes are declared, but only 5"), "{message}");
    // One file for several buffers, however it is spelled.
    let mut root: serde_json::Value = serde_json::from_slice(&asset.gltf_external("b.bin")).unwrap();
    let buffers = root["buffers"].as_array_mut().unwrap();
    buffers.push(json!({"byteLength": 30, "uri": "./%62.bin"}));
    let (dir, path) = file("a.gltf", &serde_json::to_vec(&root).unwrap());
    std::fs::write(dir.path().join("b.bin"), &asset.bin).unwrap();
    load(&path, &LoadOptions::default()).unwrap();
    root["buffers"][1]["byteLength"] = json!(37);
    std::fs::write(&path, serde_json::to_vec(&root).unwrap()).unwrap();
    let message = load(&path, &LoadOptions::default()).unwrap_err().to_string();
    assert!(
        message.contains("buffer 1: 37 bytes are declared, but only 36 are there: an earlier"),
        "{message}"
    );
}

#[test]
fn extensions_are_named() {
    let mut asset = Asset::triangle();
    asset.root["extensionsRequired"] = json!(["KHR_lights_punctual", "VENDOR_magic"]);
    fails(&asset, &["`VENDOR_magic`", "not supported"]);
    asset.root["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    fails(&asset, &["`EXT_meshopt_compression`", "gltf-transform"]);
    // Draco without the word required, and without the uncompressed copy that this would need.
    let mut asset = Asset::triangle();
    asset.root["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0}});
    asset.load_clean();
    asset.root["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    fails(&asset, &["`KHR_draco_mesh_compression`", "decompress"]);
    // Meshopt's placeholder buffer.
    let mut asset = Asset::triangle();
    asset.root["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    asset.root["bufferViews"][0]["buffer"] = json!(1);
    let mut root: serde_json::Value = serde_json::from_slice(&asset.gltf()).unwrap();
    root["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 36}));
    assert!(load_bytes("a.gltf", &serde_json::to_vec(&root).unwrap()).contains("`EXT_meshopt_compression`"));
}

#[test]
fn positions_that_are_no_places() {
    for (value, problem) in
        [(f32::NAN, "not finite"), (f32::INFINITY, "not finite"), (1e12, "scale the scene down")]
    {
        let mut asset = Asset::triangle();
        asset.bin[12..16].copy_from_slice(&value.to_le_bytes());
        fails(&asset, &["mesh 0 `thing`, primitive 0, POSITION of vertex 1", problem]);
    }
    let mut asset = Asset::triangle();
    asset.root["nodes"][2]["scale"] = json!([1e38, 1e38, 1e38]);
    fails(&asset, &["scale the scene down"]);
    asset.root["nodes"][2]["scale"] = json!([1e39, 1, 1]);
    fails(&asset, &["node 2", "transform is not finite"]);
}

#[test]
fn indices_into_nothing() {
    let cases: [(&str, serde_json::Value, &str); 9] = [
        ("/meshes/0/primitives/0/attributes/POSITION", json!(7), "names accessor 7, but the file has 1"),
        ("/meshes/0/primitives/0/indices", json!(9), "names accessor 9"),
        ("/meshes/0/primitives/0/material", json!(1), "names material 1, but the file has 1"),
        ("/accessors/0/bufferView", json!(4), "names buffer view 4"),
        ("/bufferViews/0/buffer", json!(2), "buffer 2, which does not exist"),
        ("/nodes/2/mesh", json!(5), "names mesh 5"),
        ("/nodes/0/camera", json!(5), "names camera 5"),
        ("/nodes/1/extensions/KHR_lights_punctual/light", json!(5), "names light 5"),
        ("/scene", json!(5), "names scene 5"),
    ];
    for (pointer, value, part) in cases {
        let mut asset = Asset::triangle();
        if let Some(slot) = asset.root.pointer_mut(pointer) {
            *slot = value;
        } else {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            asset.root.pointer_mut(parent).unwrap()[key] = value;
        }
        fails(&asset, &[part]);
    }
    let mut asset = Asset::triangle();
    let indices = asset.indices(UBYTE, &[0, 1, 3]);
    asset.root["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    fails(&asset, &["mesh 0 `thing`, primitive 0", "triangle 0 names vertex 3, but there are 3"]);
    let mut asset = Asset::triangle();
    asset.root["scenes"][0]["nodes"] = json!([0, 1, 99]);
    fails(&asset, &["node 99"]);
}

#[test]
fn accessors_that_exceed_their_data() {
    let cases = [
        (json!({"count": 4}), "4 elements of 12 bytes"),
        (json!({"count": u64::MAX}), "do not fit"),
        (json!({"byteOffset": 4}), "do not fit"),
        (json!({"byteOffset": u64::MAX}), "do not fit"),
        (json!({"type": "VEC2"}), "has type Vec2"),
        (json!({"type": "VEC9"}), "unknown type"),
        (json!({"componentType": 5130}), "unknown type"),
    ];
    for (fields, part) in cases {
        let mut asset = Asset::triangle();
        for (key, value) in fields.as_object().unwrap() {
            asset.root["accessors"][0][key] = value.clone();
        }
        fails(&asset, &["mesh 0 `thing`, primitive 0, POSITION (accessor 0)", part]);
    }
    let mut asset = Asset::triangle();
    asset.root["accessors"][0] = json!({"count": 1_000_000_000, "componentType": 5126, "type": "VEC3"});
    fails(&asset, &["1000000000 elements without a buffer view"]);
    for (key, value, part) in [
        ("byteLength", 37_u64, "covers bytes 0+37"),
        ("byteOffset", u64::MAX, "covers bytes"),
        ("byteStride", 4, "overlap at a stride of 4"),
    ] {
        let mut asset = Asset::triangle();
        asset.root["bufferViews"][0][key] = json!(value);
        fails(&asset, &[part]);
    }
    let mut asset = Asset::triangle();
    let uv = asset.floats("VEC3", &[0.0; 6]);
    asset.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(uv);
    fails(&asset, &["NORMAL has 2 elements for 3 vertices"]);
}

#[test]
fn sparse_data_that_does_not_fit() {
    let sparse = |indices: [u8; 2], count: u64| {
        let mut asset = Asset::triangle();
        let (i, v) = (asset.view(&indices), asset.view(&[0; 24]));
        asset.root["accessors"][0]["sparse"] = json!({
            "count": count, "indices": {"bufferView": i, "componentType": UBYTE}, "values": {"bufferView": v},
        });
        asset
    };
    fails(&sparse([1, 3], 2), &["sparse: index 3 is outside its 3 elements"]);
    fails(&sparse([2, 1], 2), &["do not increase"]);
    fails(&sparse([0, 1], 3), &["do not fit"]);
    fails(&sparse([0, 1], u64::MAX), &["replace only 3"]);
}

#[test]
fn node_trees_that_are_none() {
    let mut asset = Asset::triangle();
    asset.root["nodes"][2]["children"] = json!([2]);
    fails(&asset, &["node 2: is reached twice"]);
    let mut asset = Asset::triangle();
    asset.root["nodes"][0]["children"] = json!([2]);
    fails(&asset, &["node 2: is reached twice"]);
    // A chain of 100 000 nodes is a tree.
    let mut asset = Asset::triangle();
    for i in 0..100_000 {
        asset.push("nodes", json!({"children": [i + 4]}));
    }
    asset.push("nodes", json!({"mesh": 0}));
    asset.root["scenes"][0]["nodes"] = json!([0, 1, 3]);
    assert_eq!(asset.load_clean().scene.mesh.triangles.len(), 1);
}

#[test]
fn instances_are_counted_before_they_are_made() {
    let mut asset = Asset::triangle();
    for _ in 0..10 {
        asset.node(json!({"mesh": 0}));
    }
    let mut options = LoadOptions::default();
    options.max_triangles = 10;
    let error = asset.load_with(&options).unwrap_err().to_string();
    assert!(error.contains("11 triangles, more than the limit of 10"), "{error}");
    options.max_triangles = 11;
    assert_eq!(asset.load_with(&options).unwrap().scene.mesh.triangles.len(), 11);
}

/// A mesh is looked at once, however many nodes show it: opened per node, these primitives would take hours.
#[test]
fn empty_primitives_are_not_multiplied_by_their_instances() {
    let mut asset = Asset::triangle();
    let empty = json!({"attributes": {}});
    let mesh = asset.push("meshes", json!({"primitives": vec![empty; 50_000]}));
    for _ in 0..50_000 {
        asset.node(json!({"mesh": mesh}));
    }
    let loaded = asset.load().unwrap();
    assert_eq!(loaded.scene.mesh.triangles.len(), 1);
    // Counted where they are looked at: once each.
    assert_eq!(loaded.stats.skipped_primitives, 50_000);
}

/// Of a sparse accessor that primitives share, the indices are checked once.
#[test]
fn a_shared_sparse_accessor_is_not_multiplied_by_its_users() {
    let n: u32 = 50_000;
    let mut asset = Asset::triangle();
    let (i, v) = (
        asset.view(&(0..n).flat_map(u32::to_le_bytes).collect::<Vec<_>>()),
        asset.view(&vec![0; n as usize * 12]),
    );
    asset.root["accessors"].as_array_mut().unwrap().push(json!({
        "count": n, "componentType": 5126, "type": "VEC3",
        "sparse": {"count": n, "indices": {"bufferView": i, "componentType": UINT}, "values": {"bufferView": v}},
    }));
    // Points: many accessors are opened, and nothing is drawn.
    let points = json!({"attributes": {"POSITION": 1}, "mode": 0});
    let mesh = asset.push("meshes", json!({"primitives": vec![points; 50_000]}));
    asset.node(json!({"mesh": mesh}));
    assert_eq!(asset.load().unwrap().stats.skipped_primitives, 50_000);
}

#[test]
fn placed_primitives_are_counted_before_they_are_made() {
    let mut asset = Asset::triangle();
    let primitive = json!({"attributes": {"POSITION": 0}});
    let mesh = asset.push("meshes", json!({"name": "dust", "primitives": vec![primitive; 2048]}));
    for _ in 0..2048 {
        asset.node(json!({"name": "mote", "mesh": mesh}));
    }
    // With the one triangle at first, one more than 2^22.
    fails(&asset, &["node 2050 `mote`, mesh 1 `dust`", "4194305 primitives, more than the limit of 4194304"]);
}

/// Views that overlap, and images that are small only while they are packed, must not multiply the file.
#[test]
fn images_do_not_multiply_the_file() {
    let show = |asset: &mut Asset, texture: usize| {
        let material = asset.material(json!({"emissiveTexture": {"index": texture}}));
        asset.mesh_node(json!({"attributes": {"POSITION": 0}, "material": material}));
    };
    let mut asset = Asset::triangle();
    asset.png(16, 16, |_, _| [255; 4]);
    let first = asset.root["images"][0]["bufferView"].as_u64().unwrap() as usize;
    let length = asset.bin.len();
    // What follows the end of an image does not matter to its decoder.
    asset.bin.resize(length + 100, 0);
    for more in 0..100 {
        let mut view = asset.root["bufferViews"][first].clone();
        view["byteLength"] = json!(view["byteLength"].as_u64().unwrap() + more);
        let view = asset.push("bufferViews", view);
        let image = asset.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let texture = asset.push("textures", json!({"source": image}));
        show(&mut asset, texture);
    }
    fails(&asset, &["its images: share bytes of their buffers"]);
    let mut asset = Asset::triangle();
    for _ in 0..4097 {
        let texture = asset.png(1, 1, |_, _| [255; 4]);
        show(&mut asset, texture);
    }
    let mut options = LoadOptions::default();
    options.max_texture_size = 1;
    let error = asset.load_with(&options).unwrap_err().to_string();
    assert!(error.ends_with("its textures: 4097 texels in all, more than the limit of 4096"), "{error}");
    options.max_texture_size = 2;
    asset.load_with(&options).unwrap();
}

#[test]
fn nothing_to_render() {
    assert_eq!(Asset::lit().error(), "no triangles in its scene");
    let mut asset = Asset::triangle();
    asset.root["nodes"][2]["scale"] = json!([0, 0, 0]);
    assert_eq!(asset.error(), "no triangles in its scene, only 1 without area");
    let mut asset = Asset::triangle();
    asset.root["meshes"][0]["primitives"][0]["mode"] = json!(1);
    assert!(asset.error().contains("only 1 meshes of points, lines or nothing"));
}

#[test]
fn cameras_and_lights_that_cannot_be() {
    let cases = [
        ("/cameras/0/perspective/yfov", json!(0), "yfov 0"),
        ("/cameras/0/perspective/yfov", json!(3.2), "yfov 3.2"),
        ("/cameras/0/perspective/znear", json!(0), "znear 0"),
        ("/cameras/0/perspective/zfar", json!(0.05), "znear 0.1 must be below zfar 0.05"),
        ("/cameras/0/type", json!("fisheye"), "neither perspective nor orthographic"),
        ("/extensions/KHR_lights_punctual/lights/0/type", json!("area"), "light of unknown type"),
        ("/extensions/KHR_lights_punctual/lights/0/type", json!("spot"), "without `spot`"),
        ("/extensions/KHR_lights_punctual/lights/0/intensity", json!(-1), "not negative"),
        ("/extensions/KHR_lights_punctual/lights/0/range", json!(0), "range must be above 0"),
    ];
    for (pointer, value, part) in cases {
        let mut asset = Asset::triangle();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        asset.root.pointer_mut(parent).unwrap()[key] = value;
        fails(&asset, &["node ", part]);
    }
    let mut asset = Asset::triangle();
    asset.root["extensions"]["KHR_lights_punctual"]["lights"][0] =
        json!({"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.4}});
    fails(&asset, &["node 1 `lamp`", "0 ≤ inner ≤ outer ≤ π/2"]);
    // An index type that cannot index.
    let mut asset = Asset::triangle();
    let indices = asset.floats("SCALAR", &[0.0, 1.0, 2.0]);
    asset.root["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    fails(&asset, &["indices", "must be u8, u16 or u32"]);
    asset.root["accessors"][indices]["componentType"] = json!(UINT);
    fails(&asset, &["names vertex"]);
}

#[test]
fn a_relative_path_without_a_folder_works() {
    // `Path::parent` of a bare name is the empty path: the current folder.
    let error = load(Path::new("not_here.gltf"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("not_here.gltf: cannot be read"), "{error}");
}
