//! `diagrams`: docs/passes.md, the buffers and passes of every technique, drawn from their registrations.

use std::fmt::Write;

use indirect_gpu::wgpu::Limits;

use crate::failure::{self, Failure, Outcome};
use crate::stage::{Source, Stage};
use crate::{gpu, root, say, technique};

/// A scene with one map.
const SCENE: &str = "cornell_spot";

/// Where the page lies.
const PAGE: &str = "docs/passes.md";

/// Writes the page, or with `check` fails where it is not what would be written.
pub(crate) fn run(check: bool) -> Outcome {
    let path = root().join(PAGE);
    let page = page()?;
    if !check {
        return failure::write(&path, page);
    }
    let stored = std::fs::read_to_string(&path).map_err(|e| Failure::file(&path, e))?;
    if stored != page {
        return Err(Failure::Check(format!("{PAGE} is out of date: run `cargo xtask diagrams`")));
    }
    say(format!("{PAGE} is what the techniques register"));
    Ok(())
}

fn page() -> Outcome<String> {
    let source = Source::load(SCENE)?;
    let gpu = gpu::open(&source.scene, &Limits::default())?;
    let stage = Stage::new(&source, source.camera(None)?, [64, 64], Some(gpu));
    let mut page = String::from(
        "# Passes and buffers\n\nDrawn by `cargo xtask diagrams` from what the techniques register (`passes.rs` of each crate), with their \
         default settings and one map. A\nbox is a pass, a drum a buffer under the names that WGSL gives it; an arrow into a pass is read, one out of it \
         written. Uniforms are left out.\n",
    );
    for t in technique::real_time() {
        // Writing to a String cannot fail.
        let _ = write!(page, "\n## {}\n\n```mermaid\n{}```\n", t.name(), t.diagram(&stage)?);
    }
    Ok(page)
}
