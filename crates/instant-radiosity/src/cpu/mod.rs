//! Frames on the CPU.

mod bounce;
mod compensate;
mod cuts;
mod emit;
mod gather;
mod irsm;
mod merge;
mod movement;
mod points;
mod shadow;
mod summary;

pub use bounce::bounce_rays;
pub use compensate::{Paths, compensate};
pub use cuts::{MOST_VISITED, TILE_SIZE, gather_cuts, tailed};
pub use emit::emit;
pub use gather::{Lights, Parts, gather};
pub use irsm::bounce_irsm;
pub use merge::{History, merge};
pub use movement::movement;
pub use points::bounce_points;
pub use shadow::{Maps, Open, Rays, Shadow};
pub use summary::{MOST_KEPT, summary};

use indirect_accel::Accel;
use indirect_core::settings::Settings;
use indirect_technique::cpu::{run, run_from_maps};

pub use indirect_technique::{Frame, cpu::Fit};

use rsm::{Error, Rsm};

use crate::output::{InstantRadiosity, Output};
use crate::settings::{Options, Params};
use crate::setup::{Fitted, Setup};

impl Fit for InstantRadiosity {
    fn fit(accel: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        options.validate()?;
        params.validate()?;
        Ok(Setup { options, params, fitted: Fitted::new(accel, &options) })
    }

    fn refit(setup: &mut Setup, accel: &Accel<'_>) {
        setup.fitted.refit(accel, &setup.options);
    }
}

/// The indirect light of a frame without a past.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    frame.setup.options.validate()?;
    frame.setup.params.validate()?;
    let mut output = Output::default();
    run::<InstantRadiosity>(frame, &mut output);
    Ok(output)
}

/// [`indirect`] from maps that are there already, of the resolution of the options.
///
/// # Errors
/// As there, and [`Error::BadOption`] for maps of another resolution.
pub fn indirect_from(rsm: Rsm, frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    frame.setup.options.validate()?;
    frame.setup.params.validate()?;
    rsm.check(frame.setup.options.resolution)?;
    let mut output = Output { rsm, ..Output::default() };
    run_from_maps::<InstantRadiosity>(frame, &mut output);
    Ok(output)
}
