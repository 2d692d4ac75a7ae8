//! Frames on the CPU.

use indirect_accel::Accel;
use indirect_core::settings::Settings;
use indirect_technique::cpu::{run, run_from_maps};

pub use indirect_technique::{Frame, cpu::Fit};

use rsm::{Error, Rsm};

use crate::passes::{Output, RsmGather};
use crate::settings::{Options, Params, Setup};

impl Fit for RsmGather {
    fn fit(_: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        options.validate()?;
        params.validate()?;
        Ok(Setup { options, params })
    }
}

/// One bounce of all lights of the scene, gathered at the pixels of the camera without indirect visibility.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    frame.setup.options.validate()?;
    frame.setup.params.validate()?;
    let mut output = Output::default();
    run::<RsmGather>(frame, &mut output);
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
    run_from_maps::<RsmGather>(frame, &mut output);
    Ok(output)
}
