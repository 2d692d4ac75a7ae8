//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod blocks;
mod clusters;
mod compact;
mod mips;
mod patches;
mod refine;
mod shadows;
mod sources;
mod splat;
mod tree;
mod upsample;

use indirect_accel::Accel;
use indirect_core::settings::{BadOption, Settings};
use indirect_technique::cpu::{run, run_from_maps};
use rsm::{Error, Rsm};

pub use blocks::Blocks;
pub use clusters::clusters;
pub use compact::compact;
pub use indirect_technique::{Frame, cpu::Fit};
pub use mips::mips;
pub use patches::{Patches, patches};
pub use refine::{Subdivision, refine, stencil};
pub use rsm::cpu::{ALWAYS, Tile, cut, traverse, traverse_visible};
pub use shadows::{HORIZON, Tiles, light_visible, shadow_lights};
pub use sources::{reference_irradiance, sources, sources_at};
pub use splat::{splat, splat_bounded};
pub use tree::{Split, tree, tree_of_list};
pub use upsample::{pull, push};

use crate::fitted::Fitted;
use crate::output::{ImageSpaceRadiosity, Output, Setup};
use crate::settings::{Options, Params};

impl Fit for ImageSpaceRadiosity {
    fn fit(accel: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        options.validate()?;
        params.validate()?;
        Ok(Setup { options, params, fitted: Fitted::new(accel, &options) })
    }

    fn refit(setup: &mut Setup, accel: &Accel<'_>) {
        setup.fitted.refit(accel);
    }
}

/// Whether a frame can be computed: settings are in their ranges, and there are points for shadow maps of a scene that has
/// triangles.
fn check(frame: &Frame<'_, Setup>) -> Result<(), Error> {
    let Setup { options, params, fitted } = frame.setup;
    options.validate()?;
    params.validate()?;
    if options.has_shadows() && fitted.points.is_empty() && !frame.scene.mesh.triangles.is_empty() {
        let wanted = "off, or in a setup that Fit::fit has made for the scene";
        return Err(BadOption::new("visibility", options.visibility.word(), wanted).into());
    }
    Ok(())
}

/// One bounce of all lights of the scene at the pixels of the camera; without indirect visibility, unless the options ask for it.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range, and for `visibility=maps` with a setup that knows no scene:
/// [`Fit::fit`] makes one that does.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    check(frame)?;
    let mut output = Output::default();
    run::<ImageSpaceRadiosity>(frame, &mut output);
    Ok(output)
}

/// [`indirect`] from maps that are there already, of the resolution of the options. Of the frame's scene and rays
/// nothing is used.
///
/// # Errors
/// As there, and [`Error::BadOption`] for maps of another resolution.
pub fn indirect_from(rsm: Rsm, frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    check(frame)?;
    rsm.check(frame.setup.options.resolution)?;
    let mut output = Output { rsm, ..Output::default() };
    run_from_maps::<ImageSpaceRadiosity>(frame, &mut output);
    Ok(output)
}
