use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::Aabb;
use indirect_core::settings::Settings;
use indirect_technique::{
    Frame,
    cpu::{Fit, run, run_from_maps},
};
use rsm::Rsm;

use super::enclosure::enclosure;
use crate::{
    Error,
    output::{Output, RadianceHints},
    settings::{Options, Params, Surround, Transport},
    setup::Setup,
};

/// Texels along each side of the maps by which [`enclosure`] finds the lit surfaces.
const ENCLOSURE_RESOLUTION: u32 = 64;

impl Fit for RadianceHints {
    /// The lattice over the scene's bounds and, where later bounces ask for it, what surrounds them.
    fn fit(accel: &Accel<'_>, options: Options, params: Params) -> Result<Setup, Error> {
        // A scene without extent has no light either: any box will do.
        let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let bounds = accel.scene().bounds().filter(|b| b.diagonal() > 0.0).unwrap_or(unit);
        let mut setup = Setup::new(&bounds, options, params)?;
        if options.bounces > 1
            && options.transport == Transport::Directions
            && options.enclosure == Surround::Measured
        {
            let maps = rsm::cpu::generate(accel, ENCLOSURE_RESOLUTION)?;
            setup.enclosure = Some(enclosure(accel, &bounds, &maps));
        }
        Ok(setup)
    }
}

/// The indirect light of all lights of the scene at the pixels of the camera.
///
/// # Errors
/// [`Error::BadOption`] where a setting is out of range.
pub fn indirect(frame: &Frame<'_, Setup>) -> Result<Output, Error> {
    frame.setup.options.validate()?;
    frame.setup.params.validate()?;
    let mut output = Output::default();
    run::<RadianceHints>(frame, &mut output);
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
    run_from_maps::<RadianceHints>(frame, &mut output);
    Ok(output)
}
