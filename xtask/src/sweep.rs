//! `sweep`: speed against error of one scene, as JSON.

use crate::cli::SweepArgs;
use crate::failure::{self, Outcome};
use crate::measure::Effort;
use crate::report;
use crate::{gpu, setup, technique, warn};

pub(crate) fn run(args: &SweepArgs) -> Outcome {
    let techniques = technique::find_all(&args.techniques)?;
    failure::will_write(&args.json)?;
    let adapter = gpu::describe();
    if adapter.is_none() {
        warn(format!("{}: only the CPU is measured", setup::NO_ADAPTER));
    }
    let measured = report::scene(&args.scene, &techniques, Effort { quick: args.quick }, adapter.is_some())?;
    report::write_scene(&args.json, &measured)
}
