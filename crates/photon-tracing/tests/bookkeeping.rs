//! Every photon and every watt is accounted for.

mod common;

use common::{flux, is_sound, map, mixed, soup, textured};
use glam::{DVec3, Vec3};
use indirect_core::Scene;
use indirect_core::math::luminance;
use photon_tracing::cpu::Tally;
use photon_tracing::{Params, Photon, Sources};
use proptest::prelude::*;

const REFLECTIONS: u32 = 5;

/// What is wrong with an account, if anything.
fn fault(tally: &Tally, stored: &[Photon], photons: u32, sources: &Sources) -> Option<String> {
    let settings = sources.settings(&Params { photons, seed: 0 });
    let Tally { emitted, absorbed, escaped, flying } = tally;
    let expected = if settings.share > 0.0 { u64::from(photons) } else { 0 };
    if emitted.photons != expected {
        return Some(format!("{} photons of {expected}", emitted.photons));
    }
    if emitted.photons != absorbed.photons + escaped.photons + flying.photons {
        return Some(format!("photons are missing: {tally:?}"));
    }
    // f64 sums of at most 10⁶ terms, none more than (4/3)⁵ of what was emitted.
    let rest = (emitted.flux - absorbed.flux - escaped.flux - flying.flux).abs();
    if rest.max_element() > 1e-9 * emitted.flux.max_element() {
        return Some(format!("flux is missing: {rest}"));
    }
    // 2^m numbers, one in each of 2^m intervals: a source misses less than two of its photons, or has less than two more.
    let colours =
        sources.lights().iter().map(|l| l.power).chain(sources.emitters().iter().map(|e| e.radiance));
    let two: DVec3 = colours.map(|c| (c * (settings.share / luminance(c))).as_dvec3() * 2.0).sum();
    let off = (emitted.flux - sources.flux().as_dvec3()).abs();
    // And an f32 sum over sources, each flux rounded a few times.
    let bound = two + sources.flux().as_dvec3() * 2e-6;
    if !off.cmple(bound).all() {
        return Some(format!("{off} W are more than {bound}"));
    }
    let last = stored.iter().filter(|p| p.reflections == REFLECTIONS);
    if (last.clone().count() as u64, flux(last)) != (flying.photons, flying.flux) {
        return Some("what flies was not stored last".into());
    }
    if !stored.is_sorted_by_key(|p| p.reflections) {
        return Some("the order is wrong".into());
    }
    stored.iter().find(|p| !is_sound(p)).map(|p| format!("{p:?}"))
}

fn check(scene: &Scene, photons: u32, seed: u32) -> Option<String> {
    let (stored, tally) = map(scene, photons, seed, REFLECTIONS);
    fault(&tally, &stored, photons, &Sources::new(scene))
}

#[test]
fn fixtures_lose_nothing() {
    for name in indirect_scene::fixtures::NAMES {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        assert_eq!(check(&scene, 4096, 1), None, "{name}");
    }
    assert_eq!(check(&mixed(1.0, Vec3::ZERO), 4096, 2), None);
    assert_eq!(check(&textured(), 4096, 2), None);
}

#[test]
fn a_planted_loss_is_found() {
    let scene = mixed(1.0, Vec3::ZERO);
    let sources = Sources::new(&scene);
    let (stored, tally) = map(&scene, 4096, 2, REFLECTIONS);
    assert_eq!(fault(&tally, &stored, 4096, &sources), None);
    let mut lost = tally;
    lost.escaped.photons -= 1;
    assert!(fault(&lost, &stored, 4096, &sources).is_some());
    // One photon of 4096.
    let mut lost = tally;
    lost.absorbed.flux -= stored[0].flux.as_dvec3();
    assert!(fault(&lost, &stored, 4096, &sources).is_some());
    // One light forgotten.
    let mut fewer = sources.clone();
    fewer.set_lights(&scene.lights[..2]);
    assert!(fault(&tally, &stored, 4096, &fewer).is_some());
    let reversed: Vec<_> = stored.iter().rev().copied().collect();
    assert!(fault(&tally, &reversed, 4096, &sources).is_some());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_lose_nothing(seed in any::<u32>(), exponent in -3_i32..=3) {
        let scene = soup(seed, 10.0_f32.powi(exponent));
        prop_assert_eq!(check(&scene, 1024, seed), None);
    }
}
