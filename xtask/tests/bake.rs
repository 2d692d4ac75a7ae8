//! `bake` through the built binary; its files read by other code than wrote them.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::Path;
use std::process::{Command, Output};

use glam::{UVec3, Vec3};
use half::f16;
use serde_json::{Value, json};
use tempfile::TempDir;

fn bake(args: &[&str], out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.arg("bake").args(args).arg("--out").arg(out).output().unwrap()
}

fn baked(args: &[&str]) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let out = bake(args, folder.path());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    (folder, String::from_utf8(out.stdout).unwrap())
}

fn error(args: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = bake(args, folder.path());
    let text = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(2), "{text}");
    text.lines().find(|l| l.starts_with("error: ")).unwrap().to_owned()
}

fn read(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(name)).unwrap()).unwrap()
}

fn vector(v: &Value) -> Vec3 {
    Vec3::from_array(core::array::from_fn(|i| v[i].as_f64().unwrap() as f32))
}

/// The percentage that a line of the output states.
fn percent(text: &str, kind: &str, place: &str) -> f64 {
    let section = text.split(kind).nth(1).unwrap();
    let line = section.lines().find(|l| l.contains(place)).unwrap();
    line.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
}

/// Root mean square of the difference of `found` to the truth over that of the truth, in percent.
fn rms(points: &Value, found: impl Fn(Vec3, Vec3) -> Vec3) -> f64 {
    let (mut difference, mut whole) = (0.0, 0.0);
    for p in points.as_array().unwrap() {
        let truth = vector(&p["irradiance"]);
        difference +=
            f64::from((found(vector(&p["position"]), vector(&p["normal"])) - truth).length_squared());
        whole += f64::from(truth.length_squared());
    }
    100.0 * (difference / whole).sqrt()
}

/// A volume as Bevy's shader samples it: the box is the unit cube around 0, a filtered lookup for each axis.
struct Volume {
    size: UVec3,
    texels: Vec<Vec3>,
    translation: Vec3,
    scale: Vec3,
}

impl Volume {
    fn read(folder: &Path) -> Self {
        let about = read(folder, "irradiance_volume.json");
        let bytes = std::fs::read(folder.join("irradiance_volume.ktx2")).unwrap();
        let file = ktx2::Reader::new(bytes).unwrap();
        let header = file.header();
        assert_eq!(header.format, Some(ktx2::Format::R16G16B16A16_SFLOAT));
        let size = UVec3::new(header.pixel_width, header.pixel_height, header.pixel_depth);
        let level = file.levels().next().unwrap();
        let channel = |t: &[u8], c: usize| f16::from_le_bytes([t[2 * c], t[2 * c + 1]]).to_f32();
        let texel = |t: &[u8]| Vec3::new(channel(t, 0), channel(t, 1), channel(t, 2));
        let texels = level.data.chunks_exact(8).map(texel).collect();
        Self { size, texels, translation: vector(&about["translation"]), scale: vector(&about["scale"]) }
    }

    /// A trilinear lookup at texture coordinates of the unit cube.
    fn sample(&self, uvw: Vec3) -> Vec3 {
        let at = uvw * self.size.as_vec3() - 0.5;
        let (low, share) = (at.floor(), at - at.floor());
        let mut sum = Vec3::ZERO;
        for corner in 0..8_u32 {
            let bits = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let cell = (low + bits.as_vec3()).clamp(Vec3::ZERO, self.size.as_vec3() - 1.0).as_uvec3();
            let w = Vec3::select(bits.cmpeq(UVec3::ONE), share, 1.0 - share).element_product();
            sum += w * self.texels[((cell.z * self.size.y + cell.y) * self.size.x + cell.x) as usize];
        }
        sum
    }

    fn irradiance(&self, p: Vec3, n: Vec3) -> Vec3 {
        let resolution = (self.size / UVec3::new(1, 2, 3)).as_vec3();
        let unit = (p - self.translation) / self.scale;
        let stp = ((unit + 0.5) * resolution).clamp(Vec3::splat(0.5), resolution - 0.5);
        let uvw = stp / self.size.as_vec3();
        let negative = Vec3::select(n.cmplt(Vec3::ZERO), Vec3::splat(0.5), Vec3::ZERO);
        let of = |half: f32, third: f32| self.sample(uvw + Vec3::new(0.0, half, third));
        let weights = n * n;
        let sum = of(negative.x, 0.0) * weights.x
            + of(negative.y, 1.0 / 3.0) * weights.y
            + of(negative.z, 2.0 / 3.0) * weights.z;
        sum * core::f32::consts::PI
    }
}

#[test]
fn volumes_are_what_bevys_shader_reads() {
    let args = ["cornell_spot", "--probes", "6,5,4", "--spp", "64", "--check", "40", "--format", "bevy"];
    let (folder, text) = baked(&args);
    let volume = Volume::read(folder.path());
    assert_eq!(volume.size, UVec3::new(6, 10, 12));
    let check = read(folder.path(), "check.json");
    for (place, points) in [("at probes", "at_probes"), ("between", "between")] {
        let points = &check[points];
        assert_eq!(points.as_array().unwrap().len(), 40);
        let (stated, found) =
            (percent(&text, "ambient cubes", place), rms(points, |p, n| volume.irradiance(p, n)));
        // Half floats have 2⁻¹¹, and the figure two digits.
        assert!((stated - found).abs() < 0.05 + 0.06, "{place}: {stated} stated, {found} found");
        // What is left is the noise of 64 samples and what six numbers and so few probes can hold.
        assert!(found < 60.0, "{place}: {found}");
        let mirrored = rms(points, |p, n| volume.irradiance(p, -n));
        assert!(mirrored > 1.5 * found, "{place}: the other side would do: {mirrored} for {found}");
    }
}

/// `SphericalHarmonics3.getIrradianceAt` of three.js, whose constants are π, 2π/3 and π/4 times those of the basis.
fn three_irradiance(c: &[f32], n: Vec3) -> Vec3 {
    let Vec3 { x, y, z } = n;
    let weights = [
        0.886_227,
        2.0 * 0.511_664 * y,
        2.0 * 0.511_664 * z,
        2.0 * 0.511_664 * x,
        2.0 * 0.429_043 * x * y,
        2.0 * 0.429_043 * y * z,
        0.743_125 * z * z - 0.247_708,
        2.0 * 0.429_043 * x * z,
        0.429_043 * (x * x - y * y),
    ];
    weights.iter().zip(c.chunks_exact(3)).map(|(w, c)| *w * Vec3::from_slice(c)).sum()
}

#[test]
fn harmonics_are_what_three_js_reads_and_within_5_percent_at_probes() {
    let (folder, text) = baked(&["cornell_spot", "--probes", "6,6,6", "--spp", "512", "--format", "three"]);
    let about = read(folder.path(), "probes.json");
    assert_eq!(about["resolution"], json!([6, 6, 6]));
    let bytes = std::fs::read(folder.path().join("probes.bin")).unwrap();
    let numbers: Vec<f32> =
        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert_eq!(numbers.len(), 216 * 27);
    let check = read(folder.path(), "check.json");
    let (origin, spacing) = (vector(&about["origin"]), vector(&about["spacing"]));
    let found = rms(&check["at_probes"], |p, n| {
        let cell = ((p - origin) / spacing).round().as_uvec3();
        let i = ((cell.z * 6 + cell.y) * 6 + cell.x) as usize;
        three_irradiance(&numbers[27 * i..27 * (i + 1)], n)
    });
    let stated = percent(&text, "spherical harmonics", "at probes");
    // The figure has two digits, three's constants six.
    assert!((stated - found).abs() < 0.02, "{stated} stated, {found} found");
    assert!(found < 5.0, "{found}");
    let reversed = rms(&check["at_probes"], |p, n| {
        let cell = ((p - origin) / spacing).round().as_uvec3();
        let i = ((cell.x * 6 + cell.y) * 6 + cell.z) as usize;
        three_irradiance(&numbers[27 * i..27 * (i + 1)], n)
    });
    assert!(reversed > 2.0 * found, "probes in another order would do: {reversed}");
}

/// A floor of 2 m with two sets of texture coordinates or one, below a point light.
fn floor(folder: &Path, second: bool) -> String {
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let mut bin = floats(&[-1.0, 0.0, -1.0, -1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, -1.0]);
    bin.extend(floats(&[0.0, 1.0, 0.0].repeat(4)));
    // The chart covers all of the square but a border of an eighth.
    bin.extend(floats(&[0.125, 0.125, 0.125, 0.875, 0.875, 0.875, 0.875, 0.125]));
    bin.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let mut attributes = json!({"POSITION": 0, "NORMAL": 1});
    if second {
        attributes["TEXCOORD_1"] = json!(2);
    }
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let accessor = |view: usize, component: u32, count: u32, kind: &str| json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
    let mut positions = accessor(0, 5126, 4, "VEC3");
    positions["min"] = json!([-1, 0, -1]);
    positions["max"] = json!([1, 0, 1]);
    let scene = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 4.0}]}},
        "buffers": [{"uri": "floor.bin", "byteLength": bin.len()}],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 32), view(128, 12)],
        "accessors": [
            positions,
            accessor(1, 5126, 4, "VEC3"),
            accessor(2, 5126, 4, "VEC2"),
            accessor(3, 5123, 6, "SCALAR"),
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3}]}],
        "nodes": [{"mesh": 0}, {"translation": [0.25, 1.5, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "scenes": [{"nodes": [0, 1]}],
        "scene": 0,
    });
    std::fs::write(folder.join("floor.bin"), bin).unwrap();
    let path = folder.join("floor.gltf");
    std::fs::write(&path, scene.to_string()).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn light_maps_hold_the_irradiance_of_their_texels() {
    let scenes = tempfile::tempdir().unwrap();
    let scene = floor(scenes.path(), true);
    let (folder, _) =
        baked(&[&scene, "--format", "lightmap", "--component", "direct", "--size", "32", "--spp", "4"]);
    let image = indirect_scene::exr::read_rgb(&folder.path().join("lightmap.exr")).unwrap();
    let about = read(folder.path(), "lightmap.json");
    assert_eq!((&about["covered"], &about["overlapping"]), (&json!(24 * 24), &json!(0)));
    let expected = |x: f32, y: f32| {
        // Texel centres to the chart to the floor.
        let at = |t: f32| ((t + 0.5) / 32.0 - 0.125) / 0.75 * 2.0 - 1.0;
        let d = Vec3::new(0.25, 1.5, 0.0) - Vec3::new(at(x), 0.0, at(y));
        4.0 * 1.5 / d.length().powi(3)
    };
    for y in 4..28_u16 {
        for x in 4..28_u16 {
            let (found, wanted) =
                (image.pixels[usize::from(y) * 32 + usize::from(x)], expected(x.into(), y.into()));
            assert!((found.y - wanted).abs() < 1e-4 * wanted, "{x} {y}: {found} for {wanted}");
        }
    }
    // Four texels of padding: what is filtered at the chart's border meets no black.
    assert!(image.pixels.iter().all(|p| p.y > 0.0));
}

#[test]
fn what_cannot_be_baked_is_refused_with_its_remedy() {
    let scenes = tempfile::tempdir().unwrap();
    let text = error(&[&floor(scenes.path(), false), "--format", "lightmap"]);
    assert!(text.contains("floor.gltf") && text.contains("TEXCOORD_1") && text.contains("unwrap"), "{text}");
    let text = error(&["cornell_spot", "--technique", "radiance-hints"]);
    assert!(text.contains("radiance-hints") && text.contains("reference"), "{text}");
    let text = error(&["cornell_spot", "--probes", "4,4,4", "--spacing", "1"]);
    assert!(text.contains("--probes") && text.contains("--spacing"), "{text}");
    for spacing in ["0", "-1", "nan"] {
        let text = error(&["cornell_spot", "--spacing", spacing]);
        assert!(text.contains("--spacing") && text.contains("positive"), "{spacing}: {text}");
    }
    assert!(error(&["cornell_spot", "--spacing", "1e-9"]).contains("2^20"));
    assert!(error(&["cornell_spot", "--probes", "4,4"]).contains("X,Y,Z"));
    assert!(error(&["cornell_spot", "--probes", "4096,4096,4096"]).contains("2^20"));
    assert!(error(&["cornell_spot", "--bounces", "two"]).contains("two"));
    assert!(error(&["no_such_scene"]).contains("no_such_scene"));
}
