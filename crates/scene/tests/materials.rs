//! Materials and textures, each through a tiny file built here.

mod common;

use common::{Asset, file};
use glam::{Vec2, Vec3};
use indirect_core::{AlphaMode, Scene, Wrap};
use indirect_scene::{LoadOptions, load};
use serde_json::{Value, json};

/// A triangle whose texture coordinates are its positions, with that material.
fn painted(material: Value) -> Asset {
    let mut asset = Asset::triangle();
    let uv = asset.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    asset.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    asset.root["materials"][0] = material;
    asset
}

/// The albedo at the texture coordinate `uv`.
fn albedo(scene: &Scene, u: f32, v: f32) -> Vec3 {
    scene.albedo(0, u, v)
}

#[test]
fn factors() {
    let material = json!({
        "name": "all", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 0.6], "metallicFactor": 0.5, "roughnessFactor": 0.3},
        "emissiveFactor": [1, 0.5, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20}},
    });
    let scene = painted(material).load_clean().scene;
    let m = &scene.materials[0];
    assert_eq!((m.name.as_str(), m.double_sided, m.base_alpha, m.roughness), ("all", true, 0.6, 0.3));
    assert_eq!(m.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    assert_eq!(m.emission, Vec3::new(20.0, 10.0, 0.0));
    assert_eq!(albedo(&scene, 0.2, 0.2), Vec3::new(0.4, 0.2, 0.1));
}

#[test]
fn the_specification_defaults_are_kept_and_black_metal_is_named() {
    let loaded = painted(json!({"name": "bare"})).load().unwrap();
    assert_eq!(loaded.scene.materials[0].metallic, 1.0);
    assert_eq!(albedo(&loaded.scene, 0.1, 0.1), Vec3::ZERO);
    assert_eq!(
        loaded.warnings,
        ["material 0 `bare`: fully metallic (glTF's default): its diffuse albedo is 0"]
    );
    // No material at all: grey.
    let mut asset = Asset::triangle();
    asset.root["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let loaded = asset.load().unwrap();
    assert_eq!(albedo(&loaded.scene, 0.1, 0.1), Vec3::splat(0.8));
    assert!(loaded.warnings[0].contains("no material"));
}

#[test]
fn factors_outside_their_range_are_clamped_or_refused() {
    let pbr = |factor: Value| json!({"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": factor}});
    let loaded = painted(pbr(json!([2, 0.5, -1, 1]))).load().unwrap();
    assert_eq!(loaded.scene.materials[0].base_color, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(loaded.warnings, ["material 0 `m`: a factor outside [0, 1] was clamped"]);
    // Beyond f32.
    assert!(painted(pbr(json!([1e39, 0, 0, 1]))).error().starts_with("material 0 `m`: "));
    let error = painted(json!({"name": "m", "emissiveFactor": [-1, 0, 0]})).error();
    assert!(error.starts_with("material 0 `m`: emission"), "{error}");
}

#[test]
fn blend_is_read_as_a_test() {
    let material = json!({"name": "glass", "alphaMode": "BLEND", "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1, 1, 1, 0.1]}});
    let loaded = painted(material).load().unwrap();
    assert!(!loaded.scene.is_solid(0, 0.2, 0.2));
    assert_eq!(
        loaded.warnings,
        ["material 0 `glass`: alpha mode BLEND is read as a test: solid where alpha ≥ 0.5"]
    );
}

/// A file whose base colour is the texture, on the material's factor 1.
fn textured(size: [u32; 2], texel: impl Fn(u32, u32) -> [u8; 4], info: Value) -> Asset {
    let mut asset = painted(json!({"pbrMetallicRoughness": {"metallicFactor": 0}}));
    let texture = asset.png(size[0], size[1], texel);
    let mut info = info;
    info["index"] = json!(texture);
    asset.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = info;
    asset
}

#[test]
fn base_colour_is_decoded_from_srgb() {
    let asset =
        textured([2, 2], |x, y| if x == 0 && y == 0 { [188, 0, 255, 255] } else { [0; 4] }, json!({}));
    let scene = asset.load_clean().scene;
    // sRGB 188 is linear 0.5029; the texture holds 16 bits.
    let c = albedo(&scene, 0.25, 0.25);
    assert!((c - Vec3::new(0.50289, 0.0, 1.0)).length() < 2e-5, "{c}");
    assert_eq!(albedo(&scene, 0.75, 0.25), Vec3::ZERO);
}

#[test]
fn textures_are_filtered_down_to_the_limit() {
    let asset = textured([40, 20], |x, _| if x % 2 == 0 { [0, 0, 0, 255] } else { [255; 4] }, json!({}));
    let mut options = LoadOptions::default();
    options.max_texture_size = 10;
    let scene = asset.load_with(&options).unwrap().scene;
    assert_eq!(scene.textures[0].size, [10, 5]);
    assert!((albedo(&scene, 0.3, 0.4) - 0.5).abs().max_element() < 1e-4);
    assert_eq!(asset.load_clean().scene.textures[0].size, [40, 20]);
}

#[test]
fn wrap_modes_come_from_the_sampler() {
    let mut asset = textured([1, 1], |_, _| [255; 4], json!({}));
    asset.push("samplers", json!({"wrapS": 33071, "wrapT": 33648}));
    asset.root["textures"][0]["sampler"] = json!(0);
    assert_eq!(asset.load_clean().scene.textures[0].wrap, [Wrap::Clamp, Wrap::Mirror]);
}

#[test]
fn texture_transforms_scale_then_turn_then_move() {
    let quarter = core::f32::consts::FRAC_PI_2;
    let transform = json!({"extensions": {"KHR_texture_transform":
        {"offset": [0.5, 0.25], "rotation": quarter, "scale": [2, 3]}}});
    let asset = textured([1, 1], |_, _| [255; 4], transform);
    let scene = asset.load_clean().scene;
    let t = scene.materials[0].base_color_texture.unwrap().uv_transform;
    // Counter-clockwise in an image whose v points down: (u, v) → (v, −u).
    let moved = t.transform_point2(Vec2::new(0.1, 0.2));
    assert!((moved - Vec2::new(0.5 + 3.0 * 0.2, 0.25 - 2.0 * 0.1)).length() < 1e-6, "{moved}");
}

#[test]
fn a_transform_may_choose_another_set_of_coordinates() {
    let transform = json!({"texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}});
    let mut asset = textured([2, 1], |x, _| [255 * x as u8, 0, 0, 255], transform);
    let uv = asset.floats("VEC2", &[0.75, 0.5].repeat(3));
    asset.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(uv);
    let scene = asset.load_clean().scene;
    // Texel 1 through interpolated coordinates: their rounding moves the bilinear weights by an ulp or two.
    assert!((albedo(&scene, 0.1, 0.1) - Vec3::X).length() < 1e-6);
    // The set does not exist: (0, 0), and a word about it.
    asset.root["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_1");
    assert!(asset.load().unwrap().warnings[0].contains("no texture coordinates"));
}

#[test]
fn a_second_set_of_coordinates_is_averaged() {
    let mut asset = textured([1, 1], |_, _| [255; 4], json!({}));
    let glow = asset.png(2, 1, |x, _| [255 * x as u8, 0, 0, 255]);
    asset.root["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    asset.root["materials"][0]["emissiveTexture"] = json!({"index": glow, "texCoord": 1});
    let loaded = asset.load().unwrap();
    assert!((loaded.scene.materials[0].emission - Vec3::X * 0.5).length() < 1e-6);
    assert!(loaded.warnings[0].contains("mean colour"), "{:?}", loaded.warnings);
}

#[test]
fn metallic_roughness_and_emission_textures() {
    let mut asset = painted(
        json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}, "emissiveFactor": [2, 2, 2]}),
    );
    let metal = asset.png(1, 1, |_, _| [0, 128, 51, 255]);
    let glow = asset.png(1, 1, |_, _| [255, 0, 0, 255]);
    asset.root["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({"index": metal});
    asset.root["materials"][0]["emissiveTexture"] = json!({"index": glow});
    let scene = asset.load_clean().scene;
    // Metallic 51/255 is read without the sRGB curve.
    assert!((albedo(&scene, 0.2, 0.2) - 0.8).abs().max_element() < 1e-4);
    assert_eq!(scene.emission(0, 0.2, 0.2), Vec3::new(2.0, 0.0, 0.0));
}

#[test]
fn masked_textures_cut_holes() {
    let mut asset = textured([2, 1], |x, _| [0, 255, 0, 255 * x as u8], json!({}));
    asset.root["materials"][0]["alphaMode"] = json!("MASK");
    let scene = asset.load_clean().scene;
    assert!(scene.is_solid(0, 0.75, 0.1) && !scene.is_solid(0, 0.25, 0.1));
    // The same image on an opaque material beside it is another texture.
    let opaque = json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 0}}});
    asset.push("materials", opaque);
    let attributes = asset.root["meshes"][0]["primitives"][0]["attributes"].clone();
    asset.mesh_node(json!({"attributes": attributes, "material": 1}));
    assert_eq!(asset.load_clean().scene.textures.len(), 2);
}

#[test]
fn images_come_from_files_and_data_uris() {
    let pixels = common::png(1, 1, |_, _| [255, 0, 0, 255]);
    let mut asset = textured([1, 1], |_, _| [0; 4], json!({}));
    asset.root["images"][0] = json!({"uri": "my%20paint.png"});
    let (dir, path) = file("scene.glb", &asset.glb());
    std::fs::write(dir.path().join("my paint.png"), &pixels).unwrap();
    assert_eq!(albedo(&load(&path, &LoadOptions::default()).unwrap().scene, 0.2, 0.2), Vec3::X);
    use base64::Engine as _;
    let text = base64::engine::general_purpose::STANDARD.encode(&pixels);
    asset.root["images"][0] = json!({"uri": format!("data:image/png;base64,{text}")});
    assert_eq!(albedo(&asset.load_clean().scene, 0.2, 0.2), Vec3::X);
}

#[test]
fn unusable_images_leave_the_factor_and_say_so() {
    let webp = b"RIFF\x24\0\0\0WEBPVP8 \x18\0\0\0".to_vec();
    let cases = [
        (json!({"uri": "missing.png"}), "missing.png"),
        (json!({"uri": "https://example.org/a.png"}), "not relative"),
        (json!({"name": "leaf"}), "image 0 `leaf` has no data"),
        (json!({"bufferView": 99}), "buffer view 99"),
        (json!({"bufferView": 0}), "no known image format"),
    ];
    for (image, part) in cases {
        let mut asset = textured([1, 1], |_, _| [0; 4], json!({}));
        asset.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.25, 0.5, 0.75, 1]);
        asset.root["images"][0] = image;
        let loaded = asset.load().unwrap();
        assert_eq!(albedo(&loaded.scene, 0.2, 0.2), Vec3::new(0.25, 0.5, 0.75));
        assert!(loaded.warnings.len() == 1 && loaded.warnings[0].contains(part), "{:?}", loaded.warnings);
    }
    // WebP through the extension, without a fallback image; and an emission texture, whose factor must not flood the room.
    let mut asset = textured([1, 1], |_, _| [0; 4], json!({}));
    let view = asset.view(&webp);
    asset.root["images"][0] = json!({"bufferView": view, "mimeType": "image/webp"});
    assert!(asset.load().unwrap().warnings[0].contains("WebP"));
    asset.root["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
    assert!(asset.load().unwrap().warnings[0].contains("no PNG or JPEG"));
    let info = asset.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].take();
    asset.root["materials"][0] =
        json!({"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [9, 9, 9]});
    asset.root["materials"][0]["emissiveTexture"] = info;
    let loaded = asset.load().unwrap();
    assert!(loaded.warnings[0].contains("does not emit") && !loaded.scene.materials[0].is_emissive());
}

/// Textures of the same bytes, read in the same way, are decoded once.
#[test]
fn textures_of_one_image_are_one() {
    let mut asset = textured([2, 1], |x, _| [255 * x as u8, 0, 0, 255], json!({}));
    let uv = asset.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"].clone();
    asset.root["samplers"] = json!([{"wrapS": 33071}]);
    for (texture, wraps) in
        [(json!({"source": 0}), 1), (json!({"source": 1}), 1), (json!({"source": 0, "sampler": 0}), 2)]
    {
        if texture["source"] == 1 {
            let view = asset.root["bufferViews"]
                [asset.root["images"][0]["bufferView"].as_u64().unwrap() as usize]
                .clone();
            let view = asset.push("bufferViews", view);
            asset.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        }
        let texture = asset.push("textures", texture);
        let material = asset.push(
            "materials",
            json!({"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": texture}}}),
        );
        asset.mesh_node(json!({"attributes": {"POSITION": 0, "TEXCOORD_0": uv}, "material": material}));
        let scene = asset.load_clean().scene;
        assert_eq!(scene.textures.len(), wraps);
        let of = |m: &indirect_core::Material| m.base_color_texture.unwrap().texture as usize;
        assert_eq!(of(scene.materials.last().unwrap()), wraps - 1);
    }
}
