//! What makes the passes a technique.

use indirect_accel::Accel;
use indirect_core::settings::Settings;
use indirect_technique::cpu::run;

pub use indirect_technique::{Frame, cpu::Fit};

use crate::error::Error;
use crate::output::{Output, ShGridRaytracer};
use crate::settings::{Options, Params};
use crate::setup::{Fitted, Setup};

impl Fit for ShGridRaytracer {
    fn fit(accel: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        options.validate()?;
        params.validate()?;
        Ok(Setup { options, params, fitted: Fitted::new(accel, &options) })
    }

    fn refit(setup: &mut Setup, accel: &Accel<'_>) {
        setup.fitted.refit(accel);
    }
}

/// The indirect light of a frame.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    frame.setup.options.validate()?;
    frame.setup.params.validate()?;
    let mut output = Output::default();
    run::<ShGridRaytracer>(frame, &mut output);
    Ok(output)
}
