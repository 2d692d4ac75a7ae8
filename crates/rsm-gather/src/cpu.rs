//! Frames on the CPU.

use indirect_accel::Accel;
use indirect_core::settings::Settings;
use indirect_technique::cpu::{Fit, run};

pub use indirect_technique::Frame;

use rsm::Error;

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
    RsmGather::fit(frame.accel, frame.setup.options, frame.setup.params)?;
    let mut output = Output::default();
    run::<RsmGather>(frame, &mut output);
    Ok(output)
}
