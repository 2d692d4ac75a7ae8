//! What the techniques that start from reflective shadow maps say of a scene alike.

use indirect_core::SceneProfile;

use super::model::Notes;

/// Which lights and materials of a scene reach the maps, for a technique that starts from them alone.
pub(super) fn of_lights(profile: &SceneProfile) -> Notes {
    let mut notes = of_maps(profile);
    if profile.punctual_lights() == 0 {
        notes.skipped.push(
            "EVERYTHING: there is no punctual light, and emissive surfaces have no shadow map: the indirect light \
             is black"
                .into(),
        );
    } else if profile.emissive_triangles > 0 {
        notes.skipped.push(format!(
            "indirect light of {} emissive triangle{}: a shadow map needs a punctual light",
            profile.emissive_triangles,
            plural(profile.emissive_triangles)
        ));
    }
    of_materials(profile, &mut notes);
    notes
}

/// The same for a technique that lights the scene from emissive triangles too.
pub(super) fn of_lights_and_emitters(profile: &SceneProfile) -> Notes {
    let mut notes = of_maps(profile);
    if profile.emissive_triangles > 0 {
        notes.modelled.push(format!(
            "light of {} emissive triangle{}, from points drawn on them",
            profile.emissive_triangles,
            plural(profile.emissive_triangles)
        ));
    }
    of_materials(profile, &mut notes);
    notes
}

/// The same for a technique whose light is carried by photons.
pub(super) fn of_photons(profile: &SceneProfile) -> Notes {
    let mut notes = Notes::default();
    let sources = [
        (profile.directional_lights, "directional light", ", as far as the scene's bounds reach"),
        (profile.spot_lights, "spot light", ""),
        (profile.point_lights, "point light", ""),
        (profile.emissive_triangles, "emissive triangle", ""),
    ];
    for (count, kind, how) in sources.into_iter().filter(|(count, ..)| *count > 0) {
        notes.modelled.push(format!("photons of {count} {kind}{}{how}", plural(count)));
    }
    if profile.textured {
        notes.modelled.push("textured albedo, where photons are reflected and at camera texels".into());
    }
    if profile.alpha_masked {
        notes.modelled.push("alpha masks, on the way of photons and in camera views".into());
    }
    of_gloss(profile, &mut notes);
    notes
}

fn of_maps(profile: &SceneProfile) -> Notes {
    let mut notes = Notes::default();
    let maps = [
        (profile.directional_lights, "directional", "one orthographic map each"),
        (profile.spot_lights, "spot", "one perspective map each, five beyond 60°"),
        (profile.point_lights, "point", "six cube faces each"),
    ];
    for (count, kind, how) in maps.into_iter().filter(|(count, ..)| *count > 0) {
        notes.modelled.push(format!("first bounce of {count} {kind} light{}: {how}", plural(count)));
    }
    notes
}

fn of_materials(profile: &SceneProfile, notes: &mut Notes) {
    if profile.textured {
        notes.modelled.push("textured albedo, at camera and at light texels".into());
    }
    if profile.alpha_masked {
        notes.modelled.push("alpha masks, in camera and light views".into());
    }
    of_gloss(profile, notes);
}

fn of_gloss(profile: &SceneProfile, notes: &mut Notes) {
    if profile.glossy_triangles > 0 {
        notes.skipped.push(format!(
            "gloss of {} triangle{}: all surfaces reflect diffusely",
            profile.glossy_triangles,
            plural(profile.glossy_triangles)
        ));
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}
