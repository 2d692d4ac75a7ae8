//! Builds small glTF files in memory.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test binary uses its own part, and a failure here is a failed test"
)]

use std::path::PathBuf;

use base64::Engine as _;
use indirect_scene::{LoadOptions, Loaded, SceneLoadError, load};
use serde_json::{Value, json};
use tempfile::TempDir;

pub(crate) const BYTE: u32 = 5120;
pub(crate) const UBYTE: u32 = 5121;
pub(crate) const SHORT: u32 = 5122;
pub(crate) const USHORT: u32 = 5123;
pub(crate) const UINT: u32 = 5125;
pub(crate) const FLOAT: u32 = 5126;

/// A glTF file under construction: the JSON and its one buffer.
#[derive(Clone)]
pub(crate) struct Asset {
    pub(crate) root: Value,
    pub(crate) bin: Vec<u8>,
}

impl Asset {
    /// A file with an empty scene.
    pub(crate) fn new() -> Self {
        let root = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "materials": [], "accessors": [], "bufferViews": [], "images": [], "textures": [], "samplers": [],
            "cameras": [],
        });
        Self { root, bin: Vec::new() }
    }

    /// The unit right triangle in the plane z = 0 that faces +z, on a grey material, with a camera and a light.
    pub(crate) fn triangle() -> Self {
        let mut asset = Self::lit();
        let position = asset.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let material = asset.material(json!({}));
        asset.mesh_node(json!({"attributes": {"POSITION": position}, "material": material}));
        asset
    }

    /// A camera and a light, no mesh: no warnings about either.
    pub(crate) fn lit() -> Self {
        let mut asset = Self::new();
        asset.root["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
        asset.root["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
        asset.node(json!({"name": "eye", "camera": 0, "translation": [0, 0, 3]}));
        asset.node(json!({
            "name": "lamp", "translation": [0, 0, 3], "extensions": {"KHR_lights_punctual": {"light": 0}},
        }));
        asset
    }

    /// Appends to one of the root's arrays and returns the index.
    pub(crate) fn push(&mut self, array: &str, value: Value) -> usize {
        let array = self.root[array].as_array_mut().unwrap();
        array.push(value);
        array.len() - 1
    }

    /// A node of the default scene.
    pub(crate) fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.root["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(index));
        index
    }

    /// A mesh of one primitive on a node of its own.
    pub(crate) fn mesh_node(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({"name": "thing", "primitives": [primitive]}));
        self.node(json!({"mesh": mesh}))
    }

    /// A diffuse material with more fields.
    pub(crate) fn material(&mut self, fields: Value) -> usize {
        let mut material = json!({
            "name": "paint", "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
        });
        for (key, value) in fields.as_object().unwrap() {
            material[key] = value.clone();
        }
        self.push("materials", material)
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub(crate) fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": kind, "count": count}),
        )
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(FLOAT, kind, values.len() / components, &bytes)
    }

    pub(crate) fn indices(&mut self, component: u32, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|v| {
                let width = match component {
                    UBYTE => 1,
                    USHORT => 2,
                    _ => 4,
                };
                v.to_le_bytes()[..width].to_vec()
            })
            .collect();
        self.accessor(component, "SCALAR", values.len(), &bytes)
    }

    /// A PNG image in the buffer, with its texture.
    pub(crate) fn png(&mut self, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> usize {
        let view = self.view(&png(width, height, texel));
        let image = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        self.push("textures", json!({"source": image}))
    }

    fn with_buffer(&self, uri: Option<&str>) -> Value {
        let mut root = self.root.clone();
        root["buffers"] = json!([{"byteLength": self.bin.len()}]);
        if let Some(uri) = uri {
            root["buffers"][0]["uri"] = json!(uri);
        }
        root
    }

    /// The file as GLB.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = serde_json::to_vec(&self.with_buffer(None)).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF".to_vec();
        for word in [2, 28 + json.len() + bin.len(), json.len()] {
            out.extend((word as u32).to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(json);
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    /// The file as JSON with the buffer inside.
    pub(crate) fn gltf(&self) -> Vec<u8> {
        let text = base64::engine::general_purpose::STANDARD.encode(&self.bin);
        serde_json::to_vec(&self.with_buffer(Some(&format!("data:application/octet-stream;base64,{text}"))))
            .unwrap()
    }

    /// The file as JSON with an external buffer of that URI.
    pub(crate) fn gltf_external(&self, uri: &str) -> Vec<u8> {
        serde_json::to_vec(&self.with_buffer(Some(uri))).unwrap()
    }

    /// Writes the file as GLB and loads it.
    pub(crate) fn load(&self) -> Result<Loaded, SceneLoadError> {
        self.load_with(&LoadOptions::default())
    }

    pub(crate) fn load_with(&self, options: &LoadOptions) -> Result<Loaded, SceneLoadError> {
        let (_dir, path) = file("scene.glb", &self.glb());
        load(&path, options)
    }

    /// Loads a file that must be sound, without a warning.
    pub(crate) fn load_clean(&self) -> Loaded {
        let loaded = self.load().unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        loaded
    }

    /// The message with which loading fails.
    pub(crate) fn error(&self) -> String {
        let message = self.load().expect_err("loads although it should not").to_string();
        assert!(message.contains("scene.glb: ") && !message.contains('\n'), "{message}");
        message.split_once("scene.glb: ").unwrap().1.to_owned()
    }
}

/// A file in a directory of its own.
pub(crate) fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// An RGBA image as PNG bytes.
pub(crate) fn png(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(texel(x, y)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
