//! `bench-peers`: rays and paths beside Embree and Mitsuba, on the same geometry, spherical harmonics beside sphericart, all in
//! the same run.
//!
//! The peers are Python packages in an environment under the target folder; where they cannot be had, their rows are left
//! out and the reason is printed.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::luminance;
use indirect_core::{CameraProjection, Image, LightKind, Scene};
use reference_pathtracer::{Components, PixelFilter, Samples, Settings, render};
use serde_json::Value;

use crate::cli::BenchPeersArgs;
use crate::failure::{self, Failure, Outcome};
use crate::say;

/// Pixels along each side of the pictures.
const SIZE: u32 = 256;

/// Scenes of the path tracing comparison: an area light, a spot on one wall, a large mesh under the sun.
const SCENES: [&str; 3] = ["cornell_area", "cornell_wall_spot", "atrium"];

/// Samples per pixel at which errors are taken.
const SAMPLES: [u32; 3] = [4, 16, 64];

/// Samples per pixel of each side's own reference, with another seed: it adds 1/32 to the variance at the most samples above.
const REFERENCE_SAMPLES: u32 = 2048;

/// The library that Mitsuba compiles its kernels with, for systems whose own is too old; without a root's rights it is only
/// unpacked under the target folder.
const LLVM_PACKAGE: &str = "libllvm19";

pub(crate) fn run(args: &BenchPeersArgs) -> Outcome {
    let folder = crate::target().join("peers");
    std::fs::create_dir_all(&folder).map_err(|e| Failure::file(&folder, e))?;
    let python = environment(&folder);
    let llvm = python.as_ref().and_then(|_| llvm(&folder));
    let mut scenes: Vec<&str> = args.scenes.iter().map(String::as_str).collect();
    if scenes.is_empty() {
        rays(&folder, python.as_deref())?;
        harmonics(python.as_deref())?;
        scenes.extend(SCENES);
    }
    for name in scenes {
        paths(&folder, name, python.as_deref(), llvm.as_deref())?;
    }
    Ok(())
}

/// The interpreter of an environment that holds the peers; `None`, said why, where that cannot be.
fn environment(folder: &Path) -> Option<PathBuf> {
    let python = folder.join("venv/bin/python");
    let works = |python: &Path| {
        Command::new(python)
            .args(["-c", "import embreex, mitsuba, numpy, sphericart"])
            .output()
            .is_ok_and(|o| o.status.success())
    };
    if !works(&python) {
        say("setting up Embree, Mitsuba and sphericart (Python packages) ...");
        let made = succeeds(Command::new("python3").args(["-m", "venv"]).arg(folder.join("venv")));
        let quiet = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        let pip = quiet.into_iter().chain(["numpy", "embreex", "mitsuba", "sphericart"]);
        let installed = made.and_then(|()| succeeds(Command::new(&python).args(pip)));
        if let Err(why) = installed {
            say(format!("without peers: {why}"));
            return None;
        }
    }
    Some(python)
}

/// A libLLVM that is new enough for Mitsuba: the one named by `DRJIT_LIBLLVM_PATH`, or Debian's. `None`, said why, without.
fn llvm(folder: &Path) -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("DRJIT_LIBLLVM_PATH") {
        return Some(path.into());
    }
    let root = folder.join("llvm");
    let find = || {
        let libraries = std::fs::read_dir(root.join("usr/lib/x86_64-linux-gnu")).ok()?;
        let mut paths = libraries.filter_map(|entry| Some(entry.ok()?.path()));
        paths.find(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libLLVM.so.")))
    };
    if let Some(found) = find() {
        return Some(found);
    }
    let unpacked = std::fs::create_dir_all(&root).map_err(|e| e.to_string()).and_then(|()| {
        succeeds(Command::new("apt-get").args(["download", LLVM_PACKAGE]).current_dir(&root))?;
        let packages = std::fs::read_dir(&root).map_err(|e| e.to_string())?;
        let package = packages
            .filter_map(|entry| Some(entry.ok()?.path()))
            .find(|p| p.extension().is_some_and(|e| e == "deb"));
        succeeds(Command::new("dpkg").arg("-x").arg(package.ok_or("no package came")?).arg(&root))
    });
    let found = find();
    if found.is_none() {
        let why = unpacked.err().unwrap_or_else(|| "the package holds no library".to_owned());
        say(format!(
            "Mitsuba's compiled variant may be missing: {LLVM_PACKAGE}: {why}; set DRJIT_LIBLLVM_PATH"
        ));
    }
    found
}

fn succeeds(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().display().to_string();
    let out = command.output().map_err(|e| format!("{name}: {e}"))?;
    let error = || String::from_utf8_lossy(&out.stderr).lines().last().unwrap_or("no message").to_owned();
    if out.status.success() { Ok(()) } else { Err(format!("{name}: {}", error())) }
}

/// The JSON that a command prints last.
fn json(command: &mut Command) -> Result<Value, String> {
    let name = command.get_program().display().to_string();
    let out = command.output().map_err(|e| format!("{name}: {e}"))?;
    let text = String::from_utf8_lossy(&out.stdout);
    let error = String::from_utf8_lossy(&out.stderr);
    if !out.status.success() {
        return Err(format!("{name}: {}", error.lines().last().unwrap_or("no message")));
    }
    let start = text.find(['{', '[']).ok_or(format!("{name} printed no JSON"))?;
    serde_json::from_str(&text[start..]).map_err(|e| format!("{name}: {e}"))
}

fn script(name: &str) -> PathBuf {
    crate::root().join("xtask/peers").join(name)
}

/// Ray queries of the atrium, one thread: `ray_bench` of `indirect-accel` beside Embree, on the same rays.
fn rays(folder: &Path, python: Option<&Path>) -> Outcome {
    let dump = folder.join("rays");
    std::fs::create_dir_all(&dump).map_err(|e| Failure::file(&dump, e))?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut bench = Command::new(cargo);
    bench.current_dir(crate::root());
    bench.args(["run", "--release", "--quiet", "-p", "indirect-accel", "--example", "ray_bench", "--"]);
    let ours = json(bench.arg("--dump").arg(&dump)).map_err(Failure::Check)?;
    say(format!("rays, atrium, one thread, million per second:\n{}", pretty(&ours)));
    let Some(python) = python else { return Ok(()) };
    match json(Command::new(python).arg(script("embree_rays.py")).arg(&dump)) {
        Ok(embree) => {
            say(format!("Embree on the same rays:\n{}", pretty(&embree)));
            let mut best = String::from("Best against Embree:");
            let rows = ours.get("mrays_per_second").and_then(Value::as_array);
            let row = rows.and_then(|r| r.iter().find(|r| r["tree"] == "Best"));
            for key in ["primary_closest", "diffuse_closest", "primary_any", "diffuse_any"] {
                if let (Some(a), Some(b)) = (row.and_then(|r| r[key].as_f64()), embree[key].as_f64()) {
                    let _ = write!(best, " {key} {:.2}×", a / b);
                }
            }
            say(best);
            if let Some(speedup) = ours.get("speedup_two_threads") {
                say(format!("Two threads against one: {speedup}×"));
            }
        }
        Err(why) => say(format!("without Embree: {why}")),
    }
    Ok(())
}

/// Evaluation of spherical harmonics, one thread: `time_evaluation` of `sh-math` beside sphericart.
fn harmonics(python: Option<&Path>) -> Outcome {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut ours = Command::new(cargo);
    ours.current_dir(crate::root());
    ours.args(["run", "--release", "--quiet", "-p", "sh-math", "--example", "time_evaluation"]);
    let out = ours.output().map_err(|e| Failure::Check(format!("cargo: {e}")))?;
    say("\nspherical harmonics, one thread, nanoseconds per direction:");
    say(String::from_utf8_lossy(&out.stdout).trim_end());
    let Some(python) = python else { return Ok(()) };
    match json(Command::new(python).arg(script("sphericart_eval.py"))) {
        Ok(peer) => say(format!("sphericart on the same directions:\n  {peer}")),
        Err(why) => say(format!("without sphericart: {why}")),
    }
    Ok(())
}

fn pretty(value: &Value) -> String {
    let rows = value.get("mrays_per_second").and_then(Value::as_array).cloned();
    rows.unwrap_or_else(|| vec![value.clone()]).iter().map(|r| format!("  {r}\n")).collect()
}

/// Relative RMSE of the luminance over the pixels where the reference is lit.
fn rel_rmse(image: &Image, reference: &Image) -> f64 {
    let (mut sum, mut mean, mut count) = (0.0, 0.0, 0.0);
    for (x, r) in image.pixels.iter().zip(&reference.pixels) {
        let (x, r) = (f64::from(luminance(*x)), f64::from(luminance(*r)));
        if r > 0.0 {
            sum += (x - r) * (x - r);
            mean += r;
            count += 1.0;
        }
    }
    (sum / count).sqrt() / (mean / count)
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
struct Row {
    spp: u64,
    /// Running time of all threads over their number: the wall time of an idle machine.
    seconds: f64,
    error: f64,
}

impl Row {
    fn paths_per_second(&self) -> f64 {
        f64::from(SIZE * SIZE) * self.spp as f64 / self.seconds
    }

    /// `rel_rmse · √seconds`: compares estimators of any speed.
    fn c(&self) -> f64 {
        self.error * self.seconds.sqrt()
    }

    fn print(&self, label: &str) {
        say(format!(
            "  {label:<34} {:>4} {:>9.3} {:>9.2} {:>8.2}% {:>8.3}",
            self.spp,
            self.seconds,
            self.paths_per_second() * 1e-6,
            self.error * 100.0,
            self.c()
        ));
    }
}

/// Indirect light of one scene: paths per second, and error against time.
fn paths(folder: &Path, name: &str, python: Option<&Path>, llvm: Option<&Path>) -> Outcome {
    let scene = indirect_scene::fixtures::build(name).ok_or(Failure::Check(format!("no fixture {name}")))?;
    let threads = crate::doctor::threads();
    say(format!(
        "\nindirect light of {name}, {SIZE}×{SIZE}; seconds = running time of all threads / {threads}; c = rel_rmse·√seconds, lower is better"
    ));
    say("  tracer                              spp   seconds  Mpaths/s  rel_rmse        c");
    let ours = ours(&scene, name)?;
    let Some(python) = python else { return Ok(()) };
    let xml = export(&scene, &folder.join(name))?;
    // Of this very scene: another one has another name.
    let text = std::fs::read(&xml).map_err(|e| Failure::file(&xml, e))?;
    let mut hasher = DefaultHasher::new();
    (text, &scene.mesh.positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>())
        .hash(&mut hasher);
    let reference = folder.join(name).join(format!("reference-{:016x}.npy", hasher.finish()));
    let call = |variant: &str, sampler: &str, spps: &[u32]| {
        let mut command = Command::new(python);
        command.arg(script("mitsuba_render.py")).arg(variant).arg(&xml).arg(sampler).arg(&reference);
        if let Some(llvm) = llvm {
            command.env("DRJIT_LIBLLVM_PATH", llvm);
        }
        json(command.args(spps.iter().map(u32::to_string)))
    };
    let made = if reference.exists() {
        Ok(Value::Null)
    } else {
        call("llvm_ad_rgb", "independent", &[REFERENCE_SAMPLES])
    };
    if let Err(why) = made {
        say(format!("  without mitsuba's errors: {why}"));
    }
    let mut errors = Vec::new();
    for (variant, sampler) in
        [("llvm_ad_rgb", "independent"), ("llvm_ad_rgb", "multijitter"), ("scalar_rgb", "independent")]
    {
        let label = format!("mitsuba {variant} {sampler}");
        let result = match call(variant, sampler, &SAMPLES) {
            Ok(result) => result,
            Err(why) => {
                say(format!("  without {label}: {why}"));
                continue;
            }
        };
        let mut last = None;
        for (i, row) in result["rows"].as_array().into_iter().flatten().enumerate() {
            let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
            // The interpreted variant is the same estimator as the compiled one: it has its error.
            let error = row["rel_rmse"].as_f64().or_else(|| errors.get(i).copied()).unwrap_or(f64::NAN);
            if variant == "llvm_ad_rgb" && sampler == "independent" {
                errors.push(error);
            }
            let seconds = number("cpu_seconds") / threads as f64;
            let row = Row { spp: row["spp"].as_u64().unwrap_or_default(), seconds, error };
            row.print(&label);
            last = Some(row);
        }
        if let (Some(ours), Some(theirs)) = (ours, last) {
            say(format!(
                "    ours: {:.2}× the paths per second, {:.2}× the error at equal time",
                ours.paths_per_second() / theirs.paths_per_second(),
                ours.c() / theirs.c()
            ));
        }
    }
    Ok(())
}

/// Running time of all threads of this process so far, seconds; wall time × threads where the system does not tell.
fn busy(start: Instant) -> f64 {
    let wall = || start.elapsed().as_secs_f64() * crate::doctor::threads() as f64;
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return wall() };
    let of = |path: PathBuf| -> Option<f64> {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    let nanoseconds: f64 = tasks.filter_map(|t| of(t.ok()?.path())).sum();
    if nanoseconds > 0.0 { nanoseconds * 1e-9 } else { wall() }
}

/// Rows of the path tracer. The last of the pixel's area, which is what the peers integrate, is returned.
fn ours(scene: &Scene, name: &str) -> Outcome<Option<Row>> {
    let accel = Accel::build(scene, BuildPreset::Best);
    let camera = scene.cameras.first().ok_or(Failure::Check(format!("{name} has no camera")))?;
    let view = camera.view([SIZE; 2]);
    let start = Instant::now();
    let mut last = None;
    for (filter, label) in
        [(PixelFilter::Center, "ours, pixel centre"), (PixelFilter::Box, "ours, pixel area")]
    {
        let trace = |spp: u32, seed: u32| {
            let settings = Settings {
                components: Components::Indirect,
                samples: Samples { batch: spp, first: 0, batches: 1 },
                pixel_filter: filter,
                seed,
                ..Settings::default()
            };
            render(&accel, &view, [SIZE; 2], &settings).map_err(|e| Failure::Check(format!("{name}: {e}")))
        };
        let reference = trace(REFERENCE_SAMPLES, 1)?;
        for spp in SAMPLES {
            let before = busy(start);
            let estimate = trace(spp, 2)?;
            let seconds = (busy(start) - before) / crate::doctor::threads() as f64;
            let error = rel_rmse(&estimate.indirect, &reference.indirect);
            let row = Row { spp: estimate.spp, seconds, error };
            row.print(&format!("{label}, {:.1} Mrays/s", estimate.rays as f64 * 1e-6 / seconds));
            last = Some(row);
        }
    }
    Ok(last)
}

/// Writes a scene as Mitsuba reads it: one PLY per material, and an XML file, whose path is returned.
///
/// A spot light's cone differs between the two (Mitsuba's falls off linearly in the angle); the errors compared are each
/// renderer's against itself.
fn export(scene: &Scene, folder: &Path) -> Outcome<PathBuf> {
    let camera = scene.cameras.first().ok_or(Failure::Check("no camera".into()))?;
    let CameraProjection::Perspective { yfov } = camera.projection else {
        return Err(Failure::Check("only perspective cameras are exported".into()));
    };
    let v = |v: glam::Vec3| format!("{}, {}, {}", v.x, v.y, v.z);
    let mut xml = format!(
        r#"<scene version="3.0.0">
<default name="spp" value="16"/><default name="depth" value="-1"/><default name="sampler" value="independent"/>
<integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
<sensor type="perspective"><string name="fov_axis" value="y"/><float name="fov" value="{}"/>
<float name="near_clip" value="{}"/><float name="far_clip" value="1e6"/>
<transform name="to_world"><lookat origin="{}" target="{}" up="{}"/></transform>
<film type="hdrfilm"><integer name="width" value="{SIZE}"/><integer name="height" value="{SIZE}"/>
<rfilter type="box"/><string name="pixel_format" value="rgb"/><string name="component_format" value="float32"/></film>
<sampler type="$sampler"><integer name="sample_count" value="$spp"/></sampler></sensor>
"#,
        yfov.to_degrees(),
        camera.near,
        v(camera.position),
        v(camera.position + camera.forward),
        v(camera.up),
    );
    for (i, material) in scene.materials.iter().enumerate() {
        let triangles: Vec<_> = (0..scene.mesh.triangles.len())
            .filter(|&t| scene.mesh.materials[t] as usize == i)
            .map(|t| scene.mesh.triangles[t])
            .collect();
        if triangles.is_empty() {
            continue;
        }
        let file = format!("material{i}.ply");
        failure::write(&folder.join(&file), ply(scene, &triangles))?;
        let albedo = material.base_color * (1.0 - material.metallic);
        let emitter = if material.is_emissive() {
            format!(
                r#"<emitter type="area"><rgb name="radiance" value="{}"/></emitter>"#,
                v(material.emission)
            )
        } else {
            String::new()
        };
        let _ = writeln!(
            xml,
            r#"<shape type="ply"><string name="filename" value="{file}"/><bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf></bsdf>{emitter}</shape>"#,
            v(albedo)
        );
    }
    for light in &scene.lights {
        let power = v(light.power);
        let _ = match light.kind {
            LightKind::Point { position } => writeln!(
                xml,
                r#"<emitter type="point"><point name="position" value="{}"/><rgb name="intensity" value="{power}"/></emitter>"#,
                v(position)
            ),
            LightKind::Directional { direction } => writeln!(
                xml,
                r#"<emitter type="directional"><vector name="direction" value="{}"/><rgb name="irradiance" value="{power}"/></emitter>"#,
                v(direction)
            ),
            LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                let up = indirect_core::math::orthonormal_basis(direction).0;
                writeln!(
                    xml,
                    r#"<emitter type="spot"><rgb name="intensity" value="{power}"/><float name="cutoff_angle" value="{}"/><float name="beam_width" value="{}"/><transform name="to_world"><lookat origin="{}" target="{}" up="{}"/></transform></emitter>"#,
                    outer_angle.to_degrees(),
                    inner_angle.to_degrees(),
                    v(position),
                    v(position + direction),
                    v(up)
                )
            }
        };
    }
    xml.push_str("</scene>\n");
    let path = folder.join("scene.xml");
    failure::write(&path, xml)?;
    Ok(path)
}

/// Some triangles of a scene as a binary PLY with shading normals.
fn ply(scene: &Scene, triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face {}\nproperty list uchar int vertex_indices\n\
         end_header\n",
        triangles.len() * 3,
        triangles.len()
    )
    .into_bytes();
    for &i in triangles.iter().flatten() {
        let (p, n) = (scene.mesh.positions[i as usize], scene.mesh.normals[i as usize]);
        out.extend(p.to_array().into_iter().chain(n.to_array()).flat_map(f32::to_le_bytes));
    }
    for i in 0..triangles.len() as u32 {
        out.push(3);
        out.extend([3 * i, 3 * i + 1, 3 * i + 2].into_iter().flat_map(u32::to_le_bytes));
    }
    out
}
