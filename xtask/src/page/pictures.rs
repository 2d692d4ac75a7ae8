//! The pictures side by side, with what an eye notices between them.

use super::chart::{digits, escape, time};
use super::text::{put, title};
use crate::failure::{Failure, Outcome};
use crate::measure::{Run, SceneReport};
use crate::technique::{Backend, REFERENCE};
use indirect_metrics::{flip, palette};
use indirect_scene::png;

pub(super) fn pictures(s: &mut String, scene: &SceneReport) -> Outcome {
    let truth = &scene.truth;
    let images = &truth.images;
    let picture = |image: &indirect_core::Image, exposure: f32| -> Outcome<String> {
        use base64::Engine;
        let png = png::encode_srgb(image, exposure).map_err(|e| Failure::Check(e.to_string()))?;
        Ok(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png)))
    };
    put!(s, "<h3>Pictures</h3><div class=\"card\"><div class=\"pictures\">");
    let mut figure = |source: String, name: &str, caption: String| {
        put!(
            s,
            "<figure><img src=\"{source}\" width=\"{}\" height=\"{}\" alt=\"{}\"><figcaption><b>{}</b> {caption}</figcaption></figure>",
            scene.size[0],
            scene.size[1],
            escape(name),
            escape(name)
        );
    };
    let whole = indirect_metrics::exposure(&images.full, &images.surface);
    figure(
        picture(&images.full, whole)?,
        "Truth, all light",
        "direct and indirect, at its own exposure".into(),
    );
    figure(
        picture(&images.indirect, truth.exposure)?,
        "Truth, indirect",
        format!("{} samples per pixel; the exposure of all pictures from here on", truth.spp),
    );
    for run in pictured(scene) {
        let label = format!("{} ({})", title(&run.technique), run.backend.name().to_uppercase());
        figure(
            picture(&run.indirect, truth.exposure)?,
            &label,
            format!("<code>{}</code> in {}", escape(&run.label), time(run.frame_ms)),
        );
        let map = flip::map(&run.indirect, &images.indirect, truth.exposure)
            .map_err(|e| Failure::Check(format!("{}: {e}", scene.file)))?;
        figure(
            picture(&palette::heat_map(&map), 1.0)?,
            "FLIP",
            format!("mean {} of {label}", digits(map.mean(&images.surface))),
        );
    }
    let stops: Vec<_> = (0..=8)
        .map(|i| {
            let [r, g, b] = palette::heat(i as f32 / 8.0);
            format!("rgb({r},{g},{b})")
        })
        .collect();
    put!(
        s,
        "</div><div class=\"scale\">FLIP 0 <i style=\"background:linear-gradient(90deg,{})\"></i> 1</div></div>",
        stops.join(",")
    );
    put!(
        s,
        "<p class=\"caption\">Indirect light alone, at the one exposure that brings the truth's mean to middle grey, clamped and sRGB encoded. \
         FLIP maps show what an eye at 67 pixels per degree notices when the picture is switched with the truth: dark is nothing, pale is \
         all. The last pair is the path tracer with the time of the technique's picture.</p>"
    );
    Ok(())
}

/// Each technique at its most accurate setting on the best backend, then the path tracer at about the same time.
fn pictured(scene: &SceneReport) -> Vec<&Run> {
    let mut runs = Vec::new();
    for technique in &scene.techniques {
        let of = |backend| {
            let runs =
                scene.runs.iter().filter(move |r| r.technique == technique.technique && r.backend == backend);
            // The last setting of the first curve where errors mean nothing.
            runs.min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse()))
        };
        runs.extend(of(Backend::Gpu).or_else(|| of(Backend::Cpu)));
    }
    let time = runs.iter().map(|r| r.frame_ms).fold(0.0, f64::max);
    let distance = |r: &&Run| (r.frame_ms / time.max(1e-3)).ln().abs();
    let baseline = scene.runs.iter().filter(|r| r.technique == REFERENCE);
    runs.extend(baseline.min_by(|a, b| distance(a).total_cmp(&distance(b))));
    runs
}
