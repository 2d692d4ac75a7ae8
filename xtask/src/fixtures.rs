//! `fixtures`: the stored test scenes, made again or compared bit for bit.

use std::path::PathBuf;

use indirect_scene::fixtures::{NAMES, write_all};

use crate::cli::FixturesArgs;
use crate::failure::{Failure, Outcome};
use crate::say;

pub(crate) fn run(args: &FixturesArgs) -> Outcome {
    if args.list {
        NAMES.iter().for_each(say);
        return Ok(());
    }
    if args.check {
        return check();
    }
    let written = write_all(&folder()).map_err(|e| Failure::file(&folder(), e))?;
    written.iter().for_each(|p| say(p.display()));
    Ok(())
}

/// Fails where a stored fixture differs from what the code makes, is missing, or has no code.
pub(crate) fn check() -> Outcome {
    let fresh = crate::target().join("fixtures");
    let _ = std::fs::remove_dir_all(&fresh);
    let written = write_all(&fresh).map_err(|e| Failure::file(&fresh, e))?;
    let mut different = Vec::new();
    for path in &written {
        let name = path.file_name().unwrap_or_default();
        let read = |p: PathBuf| std::fs::read(&p).map_err(|e| Failure::file(&p, e));
        if read(path.clone())? != read(folder().join(name))? {
            different.push(name.display().to_string());
        }
    }
    let stored = std::fs::read_dir(folder()).map_err(|e| Failure::file(&folder(), e))?;
    let known = |p: &PathBuf| written.iter().any(|w| w.file_name() == p.file_name());
    for path in
        stored.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.extension().is_some_and(|e| e == "glb"))
    {
        if !known(&path) {
            different.push(format!("{} (no code makes it)", path.display()));
        }
    }
    if different.is_empty() {
        say(format!("{} stored fixtures have the bits that the code makes", written.len()));
        return Ok(());
    }
    Err(Failure::Check(format!("stored fixtures differ from their code: {}", different.join(", "))))
}

/// Where the stored fixtures lie.
fn folder() -> PathBuf {
    crate::root().join("fixtures")
}

/// The stored fixtures, by name.
pub(crate) fn stored() -> Vec<String> {
    NAMES
        .iter()
        .filter(|n| folder().join(n).with_extension("glb").exists())
        .map(|n| (*n).to_owned())
        .collect()
}
