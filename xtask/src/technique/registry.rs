//! All techniques by name.

use std::marker::PhantomData;

use super::adapted::Adapted;
use super::image_space_radiosity::Radiosity;
use super::instant_radiosity::Instant;
use super::model::{Backend, Technique};
use super::radiance_hints::Hints;
use super::reference;
use super::rsm_gather::Gather;
use super::sh_grid::ShGrid;
use crate::failure::{Failure, Outcome};

/// All real-time techniques.
pub(crate) fn real_time() -> Vec<Box<dyn Technique>> {
    vec![
        Box::new(Adapted::<Gather>(PhantomData)),
        Box::new(Adapted::<Hints>(PhantomData)),
        Box::new(Adapted::<Radiosity>(PhantomData)),
        Box::new(Adapted::<Instant>(PhantomData)),
        Box::new(Adapted::<ShGrid>(PhantomData)),
    ]
}

/// Name of the path tracer, which is not a real-time technique but answers to the same command.
pub(crate) const REFERENCE: &str = "reference";

/// The real-time technique of that name.
pub(crate) fn find(name: &str) -> Outcome<Box<dyn Technique>> {
    real_time().into_iter().find(|t| t.name() == name).ok_or_else(|| unknown(name))
}

/// The real-time techniques of these names; all of them where there are no names.
pub(crate) fn find_all(names: &[String]) -> Outcome<Vec<Box<dyn Technique>>> {
    if names.iter().any(|n| n == REFERENCE) {
        return Err(Failure::Input(format!(
            "--technique {REFERENCE}: it is what the others are held against; use `render`"
        )));
    }
    if names.is_empty() { Ok(real_time()) } else { names.iter().map(|n| find(n)).collect() }
}

fn unknown(name: &str) -> Failure {
    let known: Vec<_> = std::iter::once(REFERENCE).chain(real_time().iter().map(|t| t.name())).collect();
    Failure::Input(format!("--technique {name}: unknown; there are: {}", known.join(", ")))
}

/// The text of `--list`.
pub(crate) fn list() -> String {
    let mut out = format!("{REFERENCE}\n    {}\n", reference::SUMMARY);
    out += "    options: --bounces N|inf, --unoccluded, --spp N, --seed N, --pixel-filter center|box\n";
    for t in real_time() {
        let backends = Backend::ALL.map(Backend::name);
        out += &format!("\n{}  (backends: {})\n    {}\n", t.name(), backends.join(", "), t.summary());
        out += &t.table();
    }
    out
}
