//! All passes in one call, with an account of the flux.

use glam::DVec3;
use indirect_accel::Accel;

use super::emit::emit;
use super::trace::trace;
use crate::layout::Photon;
use crate::sources::{Params, Sources};

/// Some photons and their flux.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flow {
    /// Number of photons.
    pub photons: u64,
    /// Their flux, W.
    pub flux: DVec3,
}

impl Flow {
    fn add(&mut self, photon: &Photon) {
        self.photons += 1;
        self.flux += photon.flux.as_dvec3();
    }
}

/// What became of all photons: `emitted = absorbed + escaped + flying`, numbers exactly and flux to f64's rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Those that sources sent.
    pub emitted: Flow,
    /// Those that ended at surfaces. The flux includes what survivors lost or, where roulette made them carry more, gained (negative),
    /// and what the range of a light took.
    pub absorbed: Flow,
    /// Those that met nothing.
    pub escaped: Flow,
    /// Those that are alive after the last reflection.
    pub flying: Flow,
}

/// The photons stored at up to `reflections` reflections of what [`emit`] sends: those of the first reflection first, each reflection in the
/// order of emission. With the account of all.
#[must_use]
pub fn photon_map(
    accel: &Accel<'_>,
    sources: &Sources,
    params: &Params,
    reflections: u32,
) -> (Vec<Photon>, Tally) {
    let mut photons = emit(sources, params);
    let (mut stored, mut tally) = (Vec::new(), Tally::default());
    photons.iter().filter(|p| p.is_alive()).for_each(|p| tally.emitted.add(p));
    for _ in 0..reflections {
        let before = photons.clone();
        trace(accel, params.seed, &mut photons);
        for (before, after) in before.iter().zip(&photons).filter(|(before, _)| before.is_alive()) {
            match after.state {
                Photon::ALIVE => {
                    stored.push(*after);
                    tally.absorbed.flux += before.flux.as_dvec3() - after.flux.as_dvec3();
                }
                Photon::ESCAPED => tally.escaped.add(after),
                _ => tally.absorbed.add(before),
            }
        }
        if !photons.iter().any(Photon::is_alive) {
            break;
        }
    }
    photons.iter().filter(|p| p.is_alive()).for_each(|p| tally.flying.add(p));
    (stored, tally)
}
