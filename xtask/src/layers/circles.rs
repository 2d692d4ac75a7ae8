//! Circles among the files of a crate: files each of which uses something that the next one defines, until the last uses the
//! first.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

use cargo_metadata::Metadata;

use super::source::{self, Uses};
use crate::failure::{Failure, Outcome};

/// What was looked at, and the circles in it, each as a line.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) files: usize,
    pub(super) edges: usize,
    pub(super) circles: Vec<String>,
}

/// The circles of all crates of the workspace: libraries, programs, tests, benchmarks and examples.
pub(super) fn of_workspace(metadata: &Metadata) -> Outcome<Found> {
    let mut found = Found::default();
    for target in metadata.packages.iter().flat_map(|package| &package.targets) {
        let root = target.src_path.as_std_path();
        let uses = source::uses(root, |file| std::fs::read_to_string(file).ok()).map_err(Failure::Check)?;
        let folder = root.parent().unwrap_or(root);
        let name = folder.strip_prefix(&metadata.workspace_root).unwrap_or(folder);
        found.files += uses.len();
        found.edges += uses.values().map(BTreeMap::len).sum::<usize>();
        found.circles.extend(circles(&uses).iter().map(|circle| line(name, folder, circle, &uses)));
    }
    Ok(found)
}

/// `folder: a.rs -> b.rs -> a.rs`, and a name that each uses of the next.
fn line(name: &Path, folder: &Path, circle: &[PathBuf], uses: &Uses) -> String {
    let next = |i: usize| &circle[(i + 1) % circle.len()];
    let short = |file: &Path| file.strip_prefix(folder).unwrap_or(file).display().to_string();
    let files: Vec<_> = circle.iter().chain(circle.first()).map(|file| short(file)).collect();
    let names: Vec<_> = (0..circle.len()).map(|i| uses[&circle[i]][next(i)].as_str()).collect();
    format!("{}: {} (for {})", name.display(), files.join(" -> "), names.join(", "))
}

/// Circles of which no two share a use, short ones first: each has to be broken by itself. Where there is any circle, there is one
/// among them. Each starts with its first file in the order of names.
fn circles(uses: &Uses) -> Vec<Vec<PathBuf>> {
    let mut shortest = BTreeSet::new();
    for (from, used) in uses {
        for to in used.keys() {
            if let Some(mut circle) = path(uses, to, from) {
                let first = (0..circle.len()).min_by_key(|&i| &circle[i]).unwrap_or(0);
                circle.rotate_left(first);
                shortest.insert((circle.len(), circle));
            }
        }
    }
    let mut taken = BTreeSet::new();
    let mut circles = Vec::new();
    for (length, circle) in shortest {
        let edges = || (0..length).map(|i| (circle[i].clone(), circle[(i + 1) % length].clone()));
        if edges().all(|edge| !taken.contains(&edge)) {
            taken.extend(edges());
            circles.push(circle);
        }
    }
    circles
}

/// The files of a shortest path, both ends included.
fn path(uses: &Uses, from: &Path, to: &Path) -> Option<Vec<PathBuf>> {
    let mut before: BTreeMap<&Path, &Path> = [(from, from)].into();
    let mut queue = VecDeque::from([from]);
    while let Some(at) = queue.pop_front() {
        if at == to {
            let mut path = vec![to.to_owned()];
            let mut at = to;
            while at != from {
                at = before[at];
                path.push(at.to_owned());
            }
            path.reverse();
            return Some(path);
        }
        for next in uses.get(at).into_iter().flat_map(BTreeMap::keys) {
            before.entry(next).or_insert_with(|| {
                queue.push_back(next);
                at
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The circles of a crate whose files are given by name and text, the root first.
    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let read = |path: &Path| {
            let file = files.iter().find(|(name, _)| Path::new("x").join(name) == path);
            file.map(|(_, text)| (*text).to_owned())
        };
        let folder = Path::new("x");
        let uses = source::uses(&folder.join(files[0].0), read).unwrap();
        circles(&uses).iter().map(|circle| line(folder, folder, circle, &uses)).collect()
    }

    #[test]
    fn a_tree_passes() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c; pub use a::A; pub use c::run;"),
            ("a.rs", "pub struct A; #[cfg(test)] mod tests { use crate::c::run; }"),
            ("b.rs", "use crate::A; // and crate::c::run\npub fn b(a: &A) -> &str { \"crate::c::run\" }"),
            ("c.rs", "use crate::{A, b}; #[doc = \"x\"] pub fn run() { b::b(&A); }"),
        ];
        assert_eq!(found(&files), [""; 0]);
    }

    #[test]
    fn two_files() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "use crate::b::B; pub struct A(B);"),
            ("b.rs", "pub struct B; pub fn f() { super::a::A }"),
        ];
        assert_eq!(found(&files), ["x: a.rs -> b.rs -> a.rs (for B, A)"]);
    }

    #[test]
    fn three_files() {
        let files = [
            ("main.rs", "mod c; mod b; mod a; fn main() { c::c() }"),
            ("a.rs", "use super::b; pub fn a() { b::b() }"),
            ("b.rs", "use crate::c::{c as other}; pub fn b() { other() }"),
            ("c.rs", "pub fn c() { println!(\"{}\", crate::a::a()) }"),
        ];
        assert_eq!(found(&files), ["x: a.rs -> b.rs -> c.rs -> a.rs (for b, c, a)"]);
    }

    #[test]
    fn of_circles_that_share_a_use_the_shortest_is_told() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a.rs", "use crate::b::B; pub struct A(B);"),
            ("b.rs", "use crate::{a::A, c::C}; pub struct B(A, C);"),
            ("c.rs", "use crate::a::A; pub struct C(A);"),
        ];
        assert_eq!(found(&files), ["x: a.rs -> b.rs -> a.rs (for B, A)"]);
    }

    #[test]
    fn through_a_re_export() {
        let files = [
            ("lib.rs", "mod a; mod deep; pub use deep::B; pub use a::*;"),
            ("a.rs", "use crate::B; pub struct A(B);"),
            ("deep/mod.rs", "mod b; pub use self::b::B;"),
            ("deep/b.rs", "pub struct B; fn f(_: crate::A) {}"),
        ];
        assert_eq!(found(&files), ["x: a.rs -> deep/b.rs -> a.rs (for B, A)"]);
    }

    #[test]
    fn parent_and_child() {
        let child = ("a.rs", "use super::Shared; pub fn a(_: Shared) {}");
        let re_exports = [("lib.rs", "mod a; pub use a::a; pub struct Shared;"), child];
        assert_eq!(found(&re_exports), [""; 0]);
        let calls = [("lib.rs", "mod a; use a::a; pub struct Shared; fn f() { a(Shared) }"), child];
        assert_eq!(found(&calls), ["x: a.rs -> lib.rs -> a.rs (for Shared, a)"]);
        // A variable of that name is none of it.
        let variable = [("lib.rs", "mod a; pub use a::a; pub struct Shared; fn f(a: u8) { g(a) }"), child];
        assert_eq!(found(&variable), [""; 0]);
    }

    #[test]
    fn methods_in_another_file() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "pub struct A; impl A { pub fn a(&self) { self.b() } }"),
            ("b.rs", "use crate::a::A; impl A { pub fn b(&self) {} }"),
        ];
        assert_eq!(found(&files), ["x: a.rs -> b.rs -> a.rs (for A::b, A)"]);
    }

    #[test]
    fn a_missing_file_is_an_error() {
        let read = |path: &Path| (path == Path::new("lib.rs")).then(|| "mod a;".to_owned());
        assert_eq!(source::uses(Path::new("lib.rs"), read).unwrap_err(), "lib.rs: no file for `mod a`");
    }
}
