//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod blocks;
mod clusters;
mod compact;
mod mips;
mod patches;
mod refine;
mod sources;
mod splat;
mod tree;
mod upsample;

use indirect_accel::Accel;
use indirect_core::settings::{BadOption, Settings};
use indirect_technique::cpu::{Fit, run, run_without};
use rsm::{Error, MAP_PASSES, Rsm};

pub use blocks::Blocks;
pub use clusters::clusters;
pub use compact::compact;
pub use indirect_technique::Frame;
pub use mips::mips;
pub use patches::{Patches, patches};
pub use refine::{Subdivision, refine, stencil};
pub use rsm::cpu::{ALWAYS, Tile, cut, traverse};
pub use sources::{reference_irradiance, sources, sources_at};
pub use splat::{splat, splat_bounded};
pub use tree::tree;
pub use upsample::{pull, push};

use crate::output::{ImageSpaceRadiosity, Output, Setup};
use crate::settings::{Options, Params};

impl Fit for ImageSpaceRadiosity {
    fn fit(_: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        options.validate()?;
        params.validate()?;
        Ok(Setup { options, params })
    }
}

/// One bounce of all lights of the scene at the pixels of the camera, without indirect visibility.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    ImageSpaceRadiosity::fit(frame.accel, frame.setup.options, frame.setup.params)?;
    let mut output = Output::default();
    run::<ImageSpaceRadiosity>(frame, &mut output);
    Ok(output)
}

/// [`indirect`] from maps that are there already, of the resolution of the options. Neither scene nor rays of the frame are used.
///
/// # Errors
/// As there, and [`Error::BadOption`] for maps of another resolution.
pub fn indirect_from(rsm: Rsm, frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    ImageSpaceRadiosity::fit(frame.accel, frame.setup.options, frame.setup.params)?;
    if rsm.resolution != frame.setup.options.resolution {
        let wanted = format_args!("that of the maps, {}", rsm.resolution);
        return Err(BadOption::new("resolution", frame.setup.options.resolution, wanted).into());
    }
    let mut output = Output { rsm, ..Output::default() };
    run_without::<ImageSpaceRadiosity>(frame, &mut output, |pass| MAP_PASSES.contains(&pass));
    Ok(output)
}
