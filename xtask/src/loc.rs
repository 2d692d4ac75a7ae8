//! `loc`: lines of code of each technique, what computes apart from what only connects it.

use std::path::{Path, PathBuf};

use crate::failure::{Failure, Outcome};
use crate::{root, say};

/// The files of a technique, or of what techniques share.
struct Part {
    name: &'static str,
    /// Folders with Rust and WGSL.
    folders: &'static [&'static str],
    /// Single files besides.
    files: &'static [&'static str],
}

const PARTS: [Part; 8] = [
    Part { name: "rsm", folders: &["crates/rsm/src", "shaders/wgsl/rsm"], files: &[] },
    Part {
        name: "rsm-gather",
        folders: &["crates/rsm-gather/src"],
        files: &["xtask/src/technique/rsm_gather.rs"],
    },
    Part {
        name: "radiance-hints",
        folders: &["crates/radiance-hints/src", "shaders/wgsl/radiance_hints"],
        files: &["xtask/src/technique/radiance_hints.rs"],
    },
    Part {
        name: "image-space-radiosity",
        folders: &["crates/image-space-radiosity/src", "shaders/wgsl/image_space_radiosity"],
        files: &["xtask/src/technique/image_space_radiosity.rs"],
    },
    Part {
        name: "instant-radiosity",
        folders: &["crates/instant-radiosity/src", "shaders/wgsl/instant_radiosity"],
        files: &["xtask/src/technique/instant_radiosity.rs"],
    },
    Part {
        name: "photon-tracing",
        folders: &["crates/photon-tracing/src", "shaders/wgsl/photons"],
        files: &[],
    },
    Part {
        name: "sh-grid-raytracer",
        folders: &["crates/sh-grid-raytracer/src", "shaders/wgsl/sh_grid_raytracer"],
        files: &["xtask/src/technique/sh_grid.rs"],
    },
    Part {
        name: "shared by all",
        folders: &[
            "crates/technique/src",
            "crates/filter/src",
            "crates/gpu/src",
            "shaders/wgsl/filter",
            "shaders/wgsl/sort",
        ],
        files: &[],
    },
];

/// Files that compute although they lie beside the passes.
const ALGORITHM: [&str; 10] = [
    "views.rs",
    "volume.rs",
    "levels.rs",
    "fit.rs",
    "sequence.rs",
    "grid.rs",
    "overlap.rs",
    "pyramid.rs",
    "voxeliser.rs",
    "voxels.rs",
];

pub(crate) fn run() -> Outcome {
    say(
        "lines of code, without comments, blank lines and tests: what computes (CPU passes, WGSL) and what connects it",
    );
    say(format!("{:<24} {:>10} {:>10} {:>9}", "part", "algorithm", "plumbing", "of both"));
    for t in PARTS {
        let (mut algorithm, mut plumbing) = (0, 0);
        let mut files = Vec::new();
        for folder in t.folders {
            walk(&root().join(folder), &mut files)?;
        }
        files.extend(t.files.iter().map(|f| root().join(f)));
        for file in files {
            let text = std::fs::read_to_string(&file).map_err(|e| Failure::file(&file, e))?;
            let lines = count(&text);
            if computes(&file) { algorithm += lines } else { plumbing += lines }
        }
        let share = 100 * plumbing / (algorithm + plumbing).max(1);
        say(format!("{:<24} {algorithm:>10} {plumbing:>10} {share:>7} %", t.name));
    }
    Ok(())
}

/// Whether a file computes: a pass on the CPU, a shader, or geometry that both need.
fn computes(file: &Path) -> bool {
    let name = file.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    let in_cpu = file.parent().is_some_and(|p| p.ends_with("cpu"));
    name.ends_with(".wgsl") || (in_cpu && name != "mod.rs") || ALGORITHM.contains(&name)
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> Outcome {
    let entries = std::fs::read_dir(folder).map_err(|e| Failure::file(folder, e))?;
    let mut paths = entries.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>();
    let paths = paths.as_mut().map_err(|e| Failure::file(folder, e))?;
    paths.sort();
    for path in paths.iter() {
        if path.is_dir() {
            walk(path, files)?;
        } else if path.extension().is_some_and(|e| e == "rs" || e == "wgsl") {
            files.push(path.clone());
        }
    }
    Ok(())
}

/// Lines that hold code, up to the tests at the end of the file.
fn count(text: &str) -> usize {
    let code = text.split("\n#[cfg(test)]\nmod tests").next().unwrap_or(text);
    code.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("//")).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blank_lines_and_tests_do_not_count() {
        let text = "//! Doc.\n\nuse a;\n/// Doc.\nfn f() {\n    // why\n    g(); // tail\n}\n\n#[cfg(test)]\nmod tests {\n    fn t() {}\n}\n";
        assert_eq!(count(text), 4);
    }

    #[test]
    fn passes_and_shaders_compute() {
        for (file, expected) in [
            ("crates/x/src/cpu/flux.rs", true),
            ("crates/x/src/cpu/mod.rs", false),
            ("crates/x/src/passes.rs", false),
            ("shaders/wgsl/x/flux.wgsl", true),
            ("crates/x/src/views.rs", true),
        ] {
            assert_eq!(computes(Path::new(file)), expected, "{file}");
        }
    }
}
