//! `check-layers`: the crates depend on each other only as docs/architecture.md draws it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand};

use crate::failure::{Failure, Outcome};

/// Packages that may use everything: the ones that compose the rest and are not published.
const COMPOSERS: [&str; 2] = ["xtask", "testkit"];

type Edges = BTreeSet<(String, String)>;

pub(crate) fn run() -> Outcome {
    let root = crate::root();
    let picture = root.join("docs/architecture.md");
    let text = std::fs::read_to_string(&picture).map_err(|e| Failure::file(&picture, e))?;
    let allowed = drawn(&text);
    if allowed.is_empty() {
        return Err(Failure::file(&picture, "draws no edge `a --> b` inside a mermaid block"));
    }
    let found = edges(&root)?;
    let wrong = undrawn(&found, &allowed);
    if wrong.is_empty() {
        crate::say(format!(
            "{} dependencies between packages, all drawn in docs/architecture.md",
            found.len()
        ));
        return Ok(());
    }
    let list: Vec<_> = wrong.iter().map(|(from, to)| format!("{from} -> {to}")).collect();
    Err(Failure::Check(format!("docs/architecture.md does not draw these dependencies: {}", list.join(", "))))
}

/// The edges `a --> b` of the page's mermaid blocks.
fn drawn(page: &str) -> Edges {
    let mut inside = false;
    let mut edges = Edges::new();
    for line in page.lines().map(str::trim) {
        match line {
            "```mermaid" => inside = true,
            "```" => inside = false,
            _ => {
                if let (true, Some((from, to))) = (inside, line.split_once("-->")) {
                    edges.insert((from.trim().to_owned(), to.trim().to_owned()));
                }
            }
        }
    }
    edges
}

/// Every dependency between packages of the workspace that the picture must draw: the normal and build dependencies of the
/// packages that do not compose.
fn edges(root: &Path) -> Outcome<Edges> {
    let metadata = MetadataCommand::new()
        .manifest_path(root.join("Cargo.toml"))
        .no_deps()
        .exec()
        .map_err(|e| Failure::Check(format!("cargo metadata: {e}")))?;
    let members: BTreeMap<_, _> = metadata.packages.iter().map(|p| (p.name.to_string(), p)).collect();
    let mut edges = Edges::new();
    for (name, package) in members.iter().filter(|(name, _)| !COMPOSERS.contains(&name.as_str())) {
        for dependency in package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development) {
            if members.contains_key(&dependency.name) {
                edges.insert((name.clone(), dependency.name.clone()));
            }
        }
    }
    Ok(edges)
}

fn undrawn(found: &Edges, allowed: &Edges) -> Vec<(String, String)> {
    found.difference(allowed).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_that_is_not_drawn_is_found() {
        let page = "a --> ignored outside\n```mermaid\ngraph TD\n  rsm --> core\n  scene --> core\n```\nrsm --> scene\n";
        let allowed = drawn(page);
        assert_eq!(allowed.len(), 2);
        let edge = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let found: Edges = [edge("rsm", "core"), edge("rsm", "scene")].into();
        assert_eq!(undrawn(&found, &allowed), [edge("rsm", "scene")]);
        assert!(undrawn(&[edge("scene", "core")].into(), &allowed).is_empty());
    }

    #[test]
    fn the_workspace_has_edges() {
        let edges = edges(&crate::root()).unwrap();
        assert!(edges.contains(&("indirect-metrics".to_owned(), "indirect-core".to_owned())));
    }
}
