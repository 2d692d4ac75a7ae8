//! The command line through the built binary: exit codes, messages, formats.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};
use tempfile::TempDir;

fn xtask(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask")).args(args).output().expect("xtask runs")
}

/// Asserts that the command ends with this exit code and that all of stderr is one line `error: …` that contains `parts`.
#[track_caller]
fn assert_error(args: &[&str], code: i32, parts: &[&str]) {
    let out = xtask(args);
    let err = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{args:?}: {err}");
    let lines: Vec<_> = err.lines().filter(|l| !l.starts_with("warning: ")).collect();
    assert_eq!(lines.len(), 1, "{args:?}: {err}");
    assert!(lines[0].starts_with("error: "), "{err}");
    for part in parts {
        assert!(lines[0].contains(part), "{args:?}: `{}` does not say `{part}`", lines[0]);
    }
}

/// A folder with scenes made for the test.
struct Scenes {
    folder: TempDir,
}

impl Scenes {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        std::fs::write(self.folder.path().join(name), bytes).expect("written");
        self.path(name)
    }

    /// One triangle with these positions, in a .gltf with its buffer beside it, after `change`.
    fn triangle(&self, name: &str, positions: [f32; 9], change: impl FnOnce(&mut Value)) -> String {
        let bin: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.write(&format!("{name}.bin"), bin);
        let mut gltf = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                           "min": [-1, -1, 0], "max": [1, 1, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"uri": format!("{name}.bin"), "byteLength": 36}],
        });
        change(&mut gltf);
        self.write(&format!("{name}.gltf"), gltf.to_string())
    }
}

const TRIANGLE: [f32; 9] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];

/// `render` of a scene with the CPU technique at a small size, ready to fail.
fn render<'a>(scene: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut args =
        vec!["render", scene, "--technique", "rsm-gather", "--backend", "cpu", "--size", "8x8", "--out", out];
    args.extend(more);
    args
}

#[test]
fn scenes_that_cannot_be_used_are_named() {
    let s = Scenes::new();
    let out = s.path("out.exr");
    let missing = s.path("missing.glb");
    assert_error(&render(&missing, &out, &[]), 2, &["missing.glb"]);
    let obj = s.write("scene.obj", "v 0 0 0\n");
    assert_error(&render(&obj, &out, &[]), 2, &["scene.obj", "glTF"]);
    assert_error(&render("no_such_fixture", &out, &[]), 2, &["no_such_fixture", "cornell_spot"]);
    let text = s.write("broken.gltf", "{\"asset\": ");
    assert_error(&render(&text, &out, &[]), 2, &["broken.gltf"]);
    let whole = std::fs::read(fixture("cornell_spot")).expect("the stored fixture");
    for length in [0, 4, 19, 200, whole.len() / 2, whole.len() - 1] {
        let cut = s.write("cut.glb", &whole[..length]);
        assert_error(&render(&cut, &out, &[]), 2, &["cut.glb"]);
    }
    let mut positions = TRIANGLE;
    positions[4] = f32::NAN;
    let nan = s.triangle("nan", positions, |_| ());
    assert_error(&render(&nan, &out, &[]), 2, &["nan.gltf", "POSITION", "vertex 1"]);
    let empty = s.triangle("empty", TRIANGLE, |g| g["meshes"][0]["primitives"][0]["mode"] = json!(0));
    assert_error(&render(&empty, &out, &[]), 2, &["empty.gltf", "no triangles"]);
    let flat = s.triangle("flat", [0.5; 9], |_| ());
    assert_error(&render(&flat, &out, &[]), 2, &["flat.gltf", "no triangles"]);
    let draco = s.triangle("draco", TRIANGLE, |g| {
        g["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        g["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    });
    assert_error(&render(&draco, &out, &[]), 2, &["draco.gltf", "KHR_draco_mesh_compression"]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn options_that_cannot_be_used_are_named() {
    let s = Scenes::new();
    let out = s.path("out.exr");
    for size in ["0x0", "0x8", "8", "8xq", "-8x8", "100000x8"] {
        let args = ["render", "cornell_spot", "--technique", "reference", "--out", &out, "--size", size];
        assert_error(&args, 2, &["--size", size]);
    }
    let technique = |name| ["render", "cornell_spot", "--technique", name, "--out", &out];
    assert_error(&technique("photon-map"), 2, &["photon-map", "rsm-gather", "reference"]);
    assert_error(&render("cornell_spot", &out, &["--set", "colour=red"]), 2, &["colour", "resolution"]);
    assert_error(&render("cornell_spot", &out, &["--set", "vpls=0"]), 2, &["vpls=0", "1..="]);
    assert_error(&render("cornell_spot", &out, &["--set", "form"]), 2, &["form", "KEY=VALUE"]);
    assert_error(&render("cornell_spot", &out, &["--bounces", "many"]), 2, &["--bounces", "many"]);
    assert_error(&render("cornell_spot", &out, &["--spp", "0"]), 2, &["--spp"]);
    assert_error(&render("cornell_spot", &out, &["--camera", "rear"]), 2, &["cornell_spot", "rear"]);
    assert_error(&["render", "cornell_spot", "--out", &out], 2, &["--technique"]);
    let gpu = ["render", "cornell_spot", "--technique", "reference", "--backend", "gpu", "--out", &out];
    assert_error(&gpu, 2, &["reference", "CPU"]);
    assert_error(&["renders"], 2, &["renders"]);
    assert_error(&["validate", "cornell_spot", "--technique", "x"], 2, &["--technique x"]);
    assert_error(&["sweep", "cornell_spot"], 2, &["--json"]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let s = Scenes::new();
    let nowhere = s.path("no/such/folder/out.exr");
    assert_error(&render("cornell_spot", &nowhere, &[]), 2, &["out.exr"]);
    let png = s.path("out.png");
    assert_error(&render("cornell_spot", &png, &[]), 2, &["out.png", ".exr"]);
    let (out, stats) = (s.path("out.exr"), s.path("no/stats.json"));
    assert_error(&render("cornell_spot", &out, &["--stats", &stats]), 2, &["stats.json"]);
    let file = s.write("file", "");
    assert_error(&["report", "cornell_spot", "--quick", "--cpu-only", "--out", &file], 2, &["file"]);
}

#[test]
fn a_scene_without_camera_and_light_gets_defaults_and_a_warning() {
    let s = Scenes::new();
    let bare = s.triangle("bare", TRIANGLE, |_| ());
    let out = s.path("out.exr");
    let run = xtask(&render(&bare, &out, &[]));
    let err = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{err}");
    assert!(err.contains("warning: ") && err.contains("camera") && err.contains("light"), "{err}");
    assert!(Path::new(&out).exists());
}

#[test]
fn stats_have_the_documented_form() {
    let s = Scenes::new();
    let (out, stats) = (s.path("out.exr"), s.path("stats.json"));
    let run = xtask(&render(
        "cornell_spot",
        &out,
        &["--stats", &stats, "--set", "vpls=32", "--set", "resolution=32"],
    ));
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(run.stdout.is_empty() && run.stderr.is_empty(), "quiet in a pipe");
    let v: Value = serde_json::from_slice(&std::fs::read(stats).expect("stats")).expect("JSON");
    let keys = [
        "technique",
        "backend",
        "adapter",
        "scene",
        "size",
        "config",
        "prepare_ms",
        "frame_ms",
        "frames",
        "passes",
        "bytes",
        "mean_radiance",
        "non_finite",
        "modelled",
        "skipped",
        "warnings",
    ];
    let found: Vec<_> = v.as_object().expect("an object").keys().map(String::as_str).collect();
    assert!(keys.iter().all(|k| found.contains(k)) && found.len() == keys.len(), "{found:?}");
    assert_eq!(
        (&v["technique"], &v["backend"], &v["adapter"]),
        (&json!("rsm-gather"), &json!("cpu"), &Value::Null)
    );
    assert_eq!((&v["size"], &v["config"]["vpls"]), (&json!([8, 8]), &json!(32)));
    assert_eq!(v["scene"]["file"], "cornell_spot");
    assert!(v["scene"]["triangles"].as_u64() > Some(10) && v["scene"]["lights"] == 1);
    assert!(v["frame_ms"].as_f64() > Some(0.0) && v["frames"].as_u64() > Some(0));
    let passes = v["passes"].as_array().expect("passes");
    assert!(passes.iter().any(|p| p["name"] == "gather" && p["ms"].as_f64() > Some(0.0)), "{passes:?}");
    assert!(v["bytes"]["cpu"].as_u64() > Some(0) && v["bytes"]["gpu"] == 0);
    assert_eq!((&v["mean_radiance"].as_array().map(Vec::len), &v["non_finite"]), (&Some(3), &json!(0)));
    assert!(v["skipped"].as_array().is_some_and(|s| !s.is_empty()));
}

/// `--bounces` sets the key of a technique that has one; what another one models needs no warning, and what it does not has one.
#[test]
fn bounces_reach_techniques() {
    let s = Scenes::new();
    let out = s.path("out.exr");
    let run = |technique: &str, bounces: &str| {
        let stats = s.path(&format!("{technique}{bounces}.json"));
        let run = xtask(&[
            "render",
            "cornell_spot",
            "--technique",
            technique,
            "--backend",
            "cpu",
            "--size",
            "8x8",
            "--set",
            "resolution=32",
            "--bounces",
            bounces,
            "--out",
            &out,
            "--stats",
            &stats,
        ]);
        let err = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(0), "{err}");
        let v: Value = serde_json::from_slice(&std::fs::read(stats).expect("stats")).expect("JSON");
        (v["config"]["bounces"].clone(), err)
    };
    assert_eq!(run("radiance-hints", "2"), (json!(2), String::new()));
    assert_eq!(run("rsm-gather", "1"), (Value::Null, String::new()));
    let (_, warned) = run("rsm-gather", "3");
    assert!(warned.contains("--bounces 3: rsm-gather models 1 bounce"), "{warned}");
}

/// A scene that cannot be read does not cost the page of the others; the exit code says that one is missing.
#[test]
fn a_report_keeps_the_scenes_that_worked() {
    let s = Scenes::new();
    let out = s.path("report");
    let run = xtask(&["report", "no_such_scene.glb", "plane_point", "--quick", "--cpu-only", "--out", &out]);
    let err = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{err}");
    assert!(err.contains("no_such_scene.glb"), "{err}");
    let page = std::fs::read_to_string(Path::new(&out).join("index.html")).expect("the page");
    assert!(page.contains("plane_point") && page.contains("no_such_scene.glb was left out"));
}

/// A pass from the other backend: the image stays what it is. Passes that do not exist are named.
#[test]
fn a_pass_runs_where_one_likes() {
    if testkit::gpu().is_none() {
        return;
    }
    let s = Scenes::new();
    let image = |name: &str, more: &[&str]| {
        let out = s.path(&format!("{name}.exr"));
        let small =
            ["--size", "24x24", "--component", "indirect", "--set", "resolution=32", "--backend", "gpu"];
        let mut args = vec!["render", "cornell_spot", "--technique", "rsm-gather", "--out", &out];
        args.extend(small.iter().chain(more));
        let run = xtask(&args);
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        indirect_scene::exr::read_rgb(Path::new(&out)).expect("an EXR image").mean().x
    };
    let gpu = image("gpu", &[]);
    for pass in ["gather=cpu", "surface=cpu", "shade=cpu"] {
        let mixed = image("mixed", &["--set-backend", pass]);
        assert!(gpu > 0.0 && (mixed / gpu - 1.0).abs() < 1e-3, "{pass}: {mixed} {gpu}");
    }
    let out = s.path("out.exr");
    let unknown = render("cornell_spot", &out, &["--set-backend", "blur=cpu"]);
    assert_error(&unknown, 2, &["blur", "gather"]);
    assert_error(&render("cornell_spot", &out, &["--set-backend", "gather=x"]), 2, &["set-backend"]);
}

#[test]
fn components_add_up() {
    let s = Scenes::new();
    let image = |name: &str, more: &[&str]| {
        let out = s.path(&format!("{name}.exr"));
        let mut args = vec!["render", "cornell_spot", "--size", "16x16", "--out", &out];
        args.extend(more);
        let run = xtask(&args);
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        indirect_scene::exr::read_rgb(Path::new(&out)).expect("an EXR image")
    };
    let rsm = ["--technique", "rsm-gather", "--backend", "cpu"];
    let part = |component| image(component, &[rsm.as_slice(), &["--component", component]].concat());
    let (full, direct, indirect) = (part("full"), part("direct"), part("indirect"));
    assert_eq!(full.size, [16, 16]);
    assert_eq!(full, direct.sum(&indirect));
    assert!(indirect.mean().min_element() > 0.0 && direct.mean().min_element() > 0.0);
    // The direct light of a technique is the reference's: punctual lights through pixel centres have no noise.
    let reference = image(
        "reference",
        &["--technique", "reference", "--component", "direct", "--bounces", "0", "--spp", "1", "--seed", "9"],
    );
    for (a, b) in direct.pixels.iter().zip(&reference.pixels) {
        assert!((*a - *b).abs().max_element() <= 1e-6 * b.max_element(), "{a} {b}");
    }
}

#[test]
fn a_scene_of_emitters_is_said_to_be_black() {
    let s = Scenes::new();
    let (out, stats) = (s.path("out.exr"), s.path("stats.json"));
    let run = xtask(&render("cornell_area", &out, &["--component", "indirect", "--stats", &stats]));
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let v: Value = serde_json::from_slice(&std::fs::read(stats).expect("stats")).expect("JSON");
    assert_eq!(v["mean_radiance"], json!([0.0, 0.0, 0.0]));
    assert!(v["skipped"][0].as_str().is_some_and(|s| s.starts_with("EVERYTHING")), "{}", v["skipped"]);
}

#[test]
fn lists_name_everything() {
    for args in [&["--list"][..], &["render", "--list"]] {
        let run = xtask(args);
        let text = String::from_utf8_lossy(&run.stdout);
        assert_eq!(run.status.code(), Some(0));
        for word in
            ["reference", "rsm-gather", "resolution", "default 512", "1..=8192", "importance|grid|all"]
        {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
    let fixtures = xtask(&["fixtures", "--list"]);
    assert!(String::from_utf8_lossy(&fixtures.stdout).lines().any(|l| l == "atrium"));
    let steps = xtask(&["test", "--list"]);
    let steps = String::from_utf8_lossy(&steps.stdout).into_owned();
    for step in
        ["format", "layers", "clippy", "tests", "documentation", "no_std", "package", "diagrams", "validate"]
    {
        assert!(steps.lines().any(|l| l == step), "{step}: {steps}");
    }
    assert_error(&["test", "--only", "no-such-step"], 2, &["no-such-step"]);
}

#[test]
fn layers_hold() {
    let run = xtask(&["check-layers"]);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn stored_fixtures_are_what_their_code_makes() {
    let run = xtask(&["fixtures", "--check"]);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn validation_passes_and_fails_when_it_should() {
    if testkit::gpu().is_none() {
        // Without an adapter nothing is compared, which is a failed check and no success.
        assert_error(&["validate", "plane_spot"], 1, &["no GPU adapter"]);
        return;
    }
    let s = Scenes::new();
    let json = s.path("validate.json");
    let run = xtask(&["validate", "plane_spot", "--json", &json]);
    let text = String::from_utf8_lossy(&run.stdout);
    assert_eq!(run.status.code(), Some(0), "{text}{}", String::from_utf8_lossy(&run.stderr));
    let v: Value = serde_json::from_slice(&std::fs::read(json).expect("results")).expect("JSON");
    let passes = v[0]["passes"].as_array().expect("passes");
    for pass in ["camera", "surface", "flux", "pyramid", "vpls", "compact", "gather", "shade"] {
        assert!(passes.iter().any(|p| p["pass"] == pass && p["elements"].as_u64() > Some(0)), "{pass}");
        assert_error(&["validate", "plane_spot", "--perturb", pass], 1, &[pass, "plane_spot"]);
    }
    assert_error(&["validate", "plane_spot", "--perturb", "nonsense"], 2, &["nonsense"]);
}

#[test]
fn a_quick_report_is_one_page_without_network() {
    let s = Scenes::new();
    let out = s.path("report");
    let run = xtask(&["report", "plane_spot", "--quick", "--cpu-only", "--out", &out]);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let read = |name: &str| std::fs::read_to_string(PathBuf::from(&out).join(name)).expect("written");
    let page = read("index.html");
    for part in ["rsm-gather", "data:image/png;base64,", "<svg", "GPU was left out", "Pareto", "truth"] {
        assert!(page.contains(part), "{part}");
    }
    for address in ["http://", "https://", "src=\"/", "NaN"] {
        assert!(!page.contains(address), "{address}");
    }
    let v: Value = serde_json::from_str(&read("report.json")).expect("JSON");
    let runs = v["scenes"][0]["runs"].as_array().expect("runs");
    let csv = read("report.csv");
    assert_eq!(csv.lines().count(), runs.len() + 1);
    let columns = |l: &str| l.split(',').count();
    assert!(csv.lines().all(|l| columns(l) == columns(csv.lines().next().unwrap_or(""))), "{csv}");
    let curve = &v["consistency"];
    let errors: Vec<f64> = curve["points"]
        .as_array()
        .expect("points")
        .iter()
        .map(|p| p["rel_rmse_away"].as_f64().expect("a number"))
        .collect();
    // Down to where the reference's own noise is the larger part, each resolution is better than the one before.
    let floor = 1.5 * curve["noise_floor"].as_f64().expect("a number");
    assert!(errors.windows(2).all(|e| e[1] < e[0].max(floor)), "{errors:?} {floor}");
    assert!(errors[0] > 2.0 * floor && errors[errors.len() - 1] < 0.01, "{errors:?} {floor}");
}

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name).with_extension("glb")
}

#[test]
fn temporal_holds_every_run_against_the_reference() {
    let scenes = Scenes::new();
    let json = scenes.path("temporal.json");
    // The second run is the reference again: nothing may differ.
    let same = "rsm-gather resolution=64 select=all";
    let grid = "rsm-gather resolution=64 select=grid cells=4";
    let base = ["temporal", "cornell_spot", "--cpu-only", "--frames", "3", "--width", "24", "--json", &json];
    let out = xtask(&[&base[..], &["--run", same, "--run", grid]].concat());
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let result: Value = serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON");
    let runs = result["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 3);
    let number = |run: usize, key: &str| runs[run][key].as_f64().expect("a number");
    assert!(number(0, "change") > 0.0, "the light moves");
    assert_eq!((number(1, "flicker"), number(1, "rel_rmse"), number(1, "relative_change")), (0.0, 0.0, 1.0));
    assert!(number(2, "flicker") > 0.0 && number(2, "rel_rmse") > 0.0);
    assert_eq!(runs[2]["frames"].as_array().map(Vec::len), Some(2));

    assert_error(&["temporal", "plane_wall", "--move", "object"], 2, &["plane_wall", "--move object"]);
    assert_error(&["temporal", "cornell_area", "--cpu-only"], 2, &["cornell_area", "no punctual light"]);
    assert_error(&["temporal", "cornell_spot", "--run", "rsm-gather x=1"], 2, &["unknown key `x`"]);
    assert_error(&["temporal", "cornell_spot", "--run", ""], 2, &["unknown", "rsm-gather"]);
}
