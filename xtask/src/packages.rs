//! What the packages of published crates hold.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::failure::{Failure, Outcome};

/// The oldest `glam` that the workspace's manifest accepts: Bevy's.
pub(crate) const OLDEST_GLAM: &str = "0.33.0";

/// Texts that every package carries as the workspace has them.
const LICENSES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

/// Fails where a published crate lacks a licence's text, where a link of its README leaves its folder, or where its documentation would be
/// made without its features.
pub(crate) fn check(folders: &[PathBuf]) -> Outcome {
    let mut faults = Vec::new();
    for folder in folders {
        let name = folder.strip_prefix(crate::root()).unwrap_or(folder).display();
        for license in LICENSES {
            let (ours, theirs) =
                (read(&crate::root().join(license))?, std::fs::read_to_string(folder.join(license)));
            if theirs.ok().as_deref() != Some(&ours) {
                faults.push(format!("{name}/{license} is not the workspace's: link it"));
            }
        }
        for link in links(&read(&folder.join("README.md"))?) {
            if leaves(&link) {
                faults.push(format!(
                    "{name}/README.md links to {link}, which its package does not hold: write it in full"
                ));
            }
        }
        if !read(&folder.join("Cargo.toml"))?.contains("[package.metadata.docs.rs]\nall-features = true\n") {
            faults.push(format!("{name}/Cargo.toml lacks [package.metadata.docs.rs] all-features = true"));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(Failure::Check(faults.join("; "))) }
}

fn read(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path).map_err(|e| Failure::file(path, e))
}

/// Where the links and pictures of a Markdown text lead to.
fn links(text: &str) -> Vec<String> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    targets.map(|(target, _)| target.to_owned()).collect()
}

/// Whether a link leads out of the folder of the text, other than to a host.
fn leaves(link: &str) -> bool {
    !link.contains("://") && link.split('/').any(|part| part == "..")
}

/// Unpacks `packages` (`name-version`), which `cargo package` has made, side by side into a workspace of their own, in which they find
/// each other; returns its folder.
pub(crate) fn unpack(packages: &[String]) -> Outcome<PathBuf> {
    let (made, workspace) = (crate::target().join("package"), crate::target().join("unpacked"));
    if workspace.exists() {
        std::fs::remove_dir_all(&workspace).map_err(|e| Failure::file(&workspace, e))?;
    }
    std::fs::create_dir_all(&workspace).map_err(|e| Failure::file(&workspace, e))?;
    let mut manifest =
        String::from("[workspace]\nresolver = \"3\"\nmembers = [\"*-*\"]\n\n[patch.crates-io]\n");
    for package in packages {
        let file = made.join(format!("{package}.crate"));
        let tar = Command::new("tar").arg("-xzf").arg(&file).arg("-C").arg(&workspace).status();
        if !tar.is_ok_and(|status| status.success()) {
            return Err(Failure::Check(format!(
                "cannot unpack {}: run the step `package` first",
                file.display()
            )));
        }
        let name = package.rsplit_once('-').map_or(package.as_str(), |(name, _)| name);
        // Writing to a string cannot fail.
        let _ = writeln!(manifest, "{name} = {{ path = \"{package}\" }}");
    }
    let path = workspace.join("Cargo.toml");
    std::fs::write(&path, manifest).map_err(|e| Failure::file(&path, e))?;
    Ok(workspace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_a_package_cannot_follow_are_found() {
        let text =
            "[a](../../README.md) ![b](images/b.png) [c](https://a.org/../b) [d](#e)\n[f](src/../../g)";
        let bad: Vec<_> = links(text).into_iter().filter(|l| leaves(l)).collect();
        assert_eq!(bad, ["../../README.md", "src/../../g"]);
    }

    #[test]
    fn faults_of_a_folder_are_named() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("README.md"), "[a](../b)").unwrap();
        std::fs::write(folder.path().join("Cargo.toml"), "[package]\n").unwrap();
        std::fs::write(folder.path().join("LICENSE-MIT"), "mine").unwrap();
        let text = check(&[folder.path().to_owned()]).unwrap_err().line();
        for word in ["LICENSE-MIT", "LICENSE-APACHE", "../b", "docs.rs"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
}
