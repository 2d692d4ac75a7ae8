//! `check-layers`: the crates depend on each other only as docs/architecture.md draws it, and no files of a crate depend on
//! each other in a circle.

mod circles;
mod packages;
mod source;

use cargo_metadata::MetadataCommand;

use crate::failure::{Failure, Outcome};

pub(crate) fn run() -> Outcome {
    let root = crate::root();
    let metadata = MetadataCommand::new()
        .manifest_path(root.join("Cargo.toml"))
        .no_deps()
        .exec()
        .map_err(|e| Failure::Check(format!("cargo metadata: {e}")))?;
    let picture = root.join("docs/architecture.md");
    let text = std::fs::read_to_string(&picture).map_err(|e| Failure::file(&picture, e))?;
    let allowed = packages::drawn(&text);
    if allowed.is_empty() {
        return Err(Failure::file(&picture, "draws no edge `a --> b` inside a mermaid block"));
    }
    let edges = packages::edges(&metadata);
    let undrawn = packages::undrawn(&edges, &allowed);
    let found = circles::of_workspace(&metadata)?;
    let mut wrong = Vec::new();
    if !undrawn.is_empty() {
        let list: Vec<_> = undrawn.iter().map(|(from, to)| format!("{from} -> {to}")).collect();
        wrong.push(format!("docs/architecture.md does not draw these dependencies: {}", list.join(", ")));
    }
    if !found.circles.is_empty() {
        wrong.push(format!("files depend on each other in a circle: {}", found.circles.join("; ")));
    }
    if !wrong.is_empty() {
        return Err(Failure::Check(wrong.join("; ")));
    }
    crate::say(format!("{} dependencies between packages, all drawn in docs/architecture.md", edges.len()));
    crate::say(format!("{} dependencies between {} files, none in a circle", found.edges, found.files));
    Ok(())
}
