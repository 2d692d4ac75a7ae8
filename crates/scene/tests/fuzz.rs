//! Damaged files: always `Ok` or a clear `Err`, never a panic, a hang, or memory that the file's size does not explain.
#![allow(unsafe_code, reason = "a global allocator that counts has no safe form")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

use common::{Asset, USHORT};
use indirect_scene::{LoadOptions, load_bytes};
use proptest::prelude::*;
use serde_json::json;

/// Counts the bytes in use and remembers the most there were.
struct Counting;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(IN_USE.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A file that uses every kind of element the loader reads.
fn rich() -> Asset {
    let mut asset = Asset::triangle();
    let position = asset.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5]);
    let normal = asset.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let uv = asset.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let color = asset.floats("VEC4", &[0.5; 16]);
    let strip = asset.indices(USHORT, &[0, 1, 2, 3]);
    let moved: Vec<u8> = [1.0_f32, 0.0, 0.1, 1.0, 1.0, 0.7].iter().flat_map(|v| v.to_le_bytes()).collect();
    let (sparse, values) = (asset.view(&[1, 0, 3, 0]), asset.view(&moved));
    asset.root["accessors"][position]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": sparse, "componentType": USHORT}, "values": {"bufferView": values},
    });
    let texture = asset.png(5, 4, |x, y| [50 * x as u8, 60 * y as u8, 9, 200]);
    asset.push("samplers", json!({"wrapS": 33071}));
    asset.root["textures"][texture]["sampler"] = json!(0);
    let transform =
        json!({"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 2]}});
    let material = asset.material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture, "extensions": transform}, "metallicFactor": 0.5,
            "metallicRoughnessTexture": {"index": texture},
        },
        "alphaMode": "MASK", "alphaCutoff": 0.4, "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": texture},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
    }));
    let attributes = json!({"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color});
    asset.mesh_node(json!({"attributes": attributes, "indices": strip, "mode": 5, "material": material}));
    asset.mesh_node(json!({"attributes": attributes, "mode": 6, "material": 0}));
    let child = asset.push("nodes", json!({"mesh": 0, "scale": [-1, 2, 1], "rotation": [0, 0.6, 0, 0.8]}));
    asset.node(json!({"children": [child], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}));
    asset
}

/// What happens to a file.
#[derive(Debug, Clone)]
enum Damage {
    /// Everything from here on is missing.
    Truncate(prop::sample::Index),
    /// One bit is the other way.
    Flip(prop::sample::Index, u8),
    /// A byte becomes a digit: counts, offsets and indices in the JSON change without breaking its grammar.
    Digit(prop::sample::Index, u8),
}

fn damage() -> impl Strategy<Value = Damage> {
    let at = any::<prop::sample::Index>;
    prop_oneof![
        1 => at().prop_map(Damage::Truncate),
        4 => (at(), 0..8_u8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        4 => (at(), b'0'..=b'9').prop_map(|(at, digit)| Damage::Digit(at, digit)),
    ]
}

fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    if bytes.is_empty() {
        return;
    }
    match damage {
        Damage::Truncate(at) => bytes.truncate(at.index(bytes.len())),
        Damage::Flip(at, bit) => {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        Damage::Digit(at, digit) => {
            // The next digit at or after that place.
            let from = at.index(bytes.len());
            if let Some(at) = (from..bytes.len()).find(|&i| bytes[i].is_ascii_digit()) {
                bytes[at] = *digit;
            }
        }
    }
}

/// Loads a damaged file and checks the promise.
fn check(path: &Path, bytes: &[u8]) {
    let before = IN_USE.load(Relaxed);
    PEAK.store(before, Relaxed);
    let start = Instant::now();
    let result = load_bytes(bytes, path, &LoadOptions::default());
    let used = PEAK.load(Relaxed) - before;
    // An image may decode to 1100 times its bytes (deflate's limit is 1032), 8 bytes a texel with its 16-bit copy; the
    // rest is the file, its JSON and the mesh: small multiples of the file.
    let explained = 2 * 8 * (1100 * bytes.len() + (1 << 16));
    assert!(used < explained, "{used} bytes for a file of {}", bytes.len());
    // Far above the milliseconds it takes, far below a hang.
    assert!(start.elapsed() < Duration::from_secs(20));
    match result {
        Ok(loaded) => loaded.scene.validate().expect("a loaded scene is valid"),
        Err(error) => {
            let message = error.to_string();
            assert!(
                message.contains("fuzz.") && !message.contains('\n') && message.len() < 1000,
                "{message}"
            );
        }
    }
}

// One test: the allocator counts for the whole process.
#[test]
fn damaged_files_are_refused_or_read() {
    let asset = rich();
    let sound = [("fuzz.glb", asset.glb()), ("fuzz.gltf", asset.gltf())];
    for (name, bytes) in &sound {
        let path = Path::new(name);
        let loaded = load_bytes(bytes, path, &LoadOptions::default()).unwrap();
        assert_eq!(loaded.scene.mesh.triangles.len(), 6);
        // Every prefix, at a stride that is coprime to the alignment of chunks.
        for end in (0..bytes.len()).step_by(3) {
            check(path, &bytes[..end]);
        }
    }
    let config = ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() };
    proptest!(config, |(which in 0..2_usize, changes in prop::collection::vec(damage(), 1..6))| {
        let (name, bytes) = &sound[which];
        let mut bytes = bytes.clone();
        for change in &changes {
            apply(&mut bytes, change);
        }
        check(Path::new(name), &bytes);
    });
}
