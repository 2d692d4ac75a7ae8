//! Dependencies between the packages of the workspace, and those that a page draws.

use std::collections::{BTreeMap, BTreeSet};

use cargo_metadata::{DependencyKind, Metadata};

/// Packages that may use everything: the ones that compose the rest and are not published.
const COMPOSERS: [&str; 3] = ["live", "testkit", "xtask"];

pub(super) type Edges = BTreeSet<(String, String)>;

/// The edges `a --> b` of the page's mermaid blocks.
pub(super) fn drawn(page: &str) -> Edges {
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
pub(super) fn edges(metadata: &Metadata) -> Edges {
    let members: BTreeMap<_, _> = metadata.packages.iter().map(|p| (p.name.to_string(), p)).collect();
    let mut edges = Edges::new();
    for (name, package) in members.iter().filter(|(name, _)| !COMPOSERS.contains(&name.as_str())) {
        for dependency in package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development) {
            if members.contains_key(&dependency.name) {
                edges.insert((name.clone(), dependency.name.clone()));
            }
        }
    }
    edges
}

pub(super) fn undrawn(found: &Edges, allowed: &Edges) -> Vec<(String, String)> {
    found.difference(allowed).cloned().collect()
}

#[cfg(test)]
mod tests {
    use cargo_metadata::MetadataCommand;

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
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml");
        let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap();
        assert!(edges(&metadata).contains(&("indirect-metrics".to_owned(), "indirect-core".to_owned())));
    }
}
