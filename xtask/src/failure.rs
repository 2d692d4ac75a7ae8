//! How a command ends when it does not succeed.

use std::fmt::Display;
use std::path::Path;

/// Why a command failed; decides the exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The input is at fault: one line `error: …`, exit code 2.
    Input(String),
    /// A check did not hold: one line `error: …`, exit code 1.
    Check(String),
}

impl Failure {
    /// Bad input that concerns a file.
    pub(crate) fn file(path: &Path, error: impl Display) -> Self {
        Self::Input(format!("{}: {error}", path.display()))
    }

    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Check(_) => 1,
        }
    }

    /// The message on one line, whatever the error of a library contains.
    pub(crate) fn line(&self) -> String {
        let (Self::Input(m) | Self::Check(m)) = self;
        m.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

/// Result of a command or of a part of one.
pub(crate) type Outcome<T = ()> = Result<T, Failure>;

/// Creates the folder of a file.
fn folder_of(path: &Path) -> Outcome {
    match path.parent().filter(|p| !p.as_os_str().is_empty()) {
        Some(parent) => std::fs::create_dir_all(parent).map_err(|e| Failure::file(parent, e)),
        None => Ok(()),
    }
}

/// Writes a file, naming it when that fails; creates its folder.
pub(crate) fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Outcome {
    folder_of(path)?;
    std::fs::write(path, bytes).map_err(|e| Failure::file(path, e))
}

/// Fails early where [`write()`] would fail later.
pub(crate) fn will_write(path: &Path) -> Outcome {
    folder_of(path)?;
    writable(path)
}

/// Fails where a file cannot be written; changes none that is there and leaves none behind that was not.
pub(crate) fn writable(path: &Path) -> Outcome {
    let existed = path.exists();
    let open = std::fs::OpenOptions::new().append(true).create(true).open(path);
    open.map_err(|e| Failure::file(path, format!("cannot be written: {e}")))?;
    if !existed {
        // Best effort: an empty file is no harm.
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// Writes a value as indented JSON.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> Outcome {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| Failure::file(path, e))?;
    text.push('\n');
    write(path, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_take_one_line() {
        let f = Failure::file(Path::new("a.glb"), "broken\n  at byte 3");
        assert_eq!((f.line().as_str(), f.exit_code()), ("a.glb: broken at byte 3", 2));
    }
}
