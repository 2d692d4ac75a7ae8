//! One scene: its facts, the verdict, the budgets, and sections of their own for curve, pictures and techniques.

use super::chart::{bytes, digits, escape, percent, time};
use super::curve::curve;
use super::pictures::pictures;
use super::technique;
use super::text::{baseline_time, error_cells, matched_cells, put, signed, thousands, title};
use crate::failure::Outcome;
use crate::measure::SceneReport;
use crate::technique::{Backend, REFERENCE};

/// Frame times for which the page names a setting, milliseconds.
const BUDGETS: [f64; 6] = [2.0, 8.0, 33.0, 100.0, 400.0, 2000.0];

pub(super) fn scene_section(s: &mut String, scene: &SceneReport, index: usize) -> Outcome {
    put!(s, "<h2 id=\"scene{index}\">{}</h2>", escape(&scene.name));
    facts(s, scene);
    for w in &scene.warnings {
        put!(s, "<p class=\"note\">Warning: {}</p>", escape(w));
    }
    put!(s, "<p class=\"verdict\">{}</p>", verdict(scene));
    budgets(s, scene);
    curve(s, scene);
    pictures(s, scene)?;
    for technique in &scene.techniques {
        technique::section(s, scene, technique);
    }
    all_runs(s, scene);
    Ok(())
}

fn facts(s: &mut String, scene: &SceneReport) {
    let lights: Vec<_> = [
        (scene.directional_lights, "directional"),
        (scene.spot_lights, "spot"),
        (scene.point_lights, "point"),
        (scene.emissive_triangles, "emissive triangles"),
    ]
    .iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, what)| format!("{n} {what}"))
    .collect();
    let memory = scene.peak_bytes.map_or_else(|| "unknown".to_owned(), bytes);
    put!(
        s,
        "<ul class=\"facts\"><li><b>{}</b> triangles</li><li>lights: <b>{}</b></li><li>{}×{} pixels, camera {}</li>\
         <li>loaded in {}, rays ready in {} ({})</li><li>truth: <b>{} samples</b> per pixel, noise {}</li>\
         <li>indirect share <b>{}</b></li><li>measured in {} s, peak memory {}</li></ul>",
        thousands(scene.triangles),
        if lights.is_empty() { "none".to_owned() } else { lights.join(", ") },
        scene.size[0],
        scene.size[1],
        escape(if scene.camera.is_empty() { "unnamed" } else { &scene.camera }),
        time(scene.load_ms),
        time(scene.accel_ms),
        bytes(scene.accel_bytes),
        scene.truth.spp,
        percent(scene.truth.noise),
        percent(scene.truth.indirect_share),
        digits(scene.seconds),
        memory
    );
}

/// The answer in a sentence or two.
fn verdict(scene: &SceneReport) -> String {
    let technique_runs =
        || scene.runs.iter().filter(|r| r.technique != REFERENCE && r.rel_rmse().is_finite());
    let Some(best) = technique_runs().min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse())) else {
        return "There is no indirect light to measure here: the truth is black.".into();
    };
    let on_front = scene.front.iter().any(|i| scene.runs[*i].technique != REFERENCE);
    let needs = baseline_time(scene, best.rel_rmse());
    let mut text = format!(
        "The most accurate real-time setting is <b>{}</b> on the {} with <code>{}</code>: {} error (bias {}) in {} a frame; the path \
         tracer takes {needs} to that error. ",
        best.technique,
        best.backend.name().to_uppercase(),
        escape(&best.label),
        percent(best.rel_rmse()),
        signed(best.error.as_ref().map_or(0.0, |e| e.luminance.bias)),
        time(best.frame_ms),
    );
    let split =
        scene.techniques.iter().find(|t| t.technique == best.technique).and_then(|t| t.split.as_ref());
    let part =
        split.and_then(|s| s.parts.iter().max_by(|a, b| a.measures.rel_rmse.total_cmp(&b.measures.rel_rmse)));
    if let Some(part) = part {
        text += &format!(
            "The largest part of its error is <b>{}</b> ({}): {}. ",
            part.name,
            percent(part.own().0),
            part.explanation
        );
    }
    text += if on_front {
        "Settings on the yellow band of the chart are the ones to choose from: nothing measured here is both faster and more accurate."
    } else {
        "Nothing here beats the path tracer at equal time on this machine: what the technique leaves out outweighs what it saves."
    };
    text
}

/// The best setting for each budget, with and without the GPU.
fn budgets(s: &mut String, scene: &SceneReport) {
    let has_gpu = scene.runs.iter().any(|r| r.backend == Backend::Gpu);
    put!(
        s,
        "<h3>Which setting for which budget</h3><div class=\"card\"><table><tr><th class=\"n\">frame budget</th>"
    );
    let mut columns = vec![(Backend::Cpu, "on the CPU")];
    if has_gpu {
        columns.insert(0, (Backend::Gpu, "on the GPU adapter"));
    }
    for (_, title) in &columns {
        put!(s, "<th>best {title}</th><th class=\"n\">takes</th><th class=\"n\">rel. RMSE</th>");
    }
    put!(s, "</tr>");
    for budget in BUDGETS {
        put!(s, "<tr><td class=\"n\">{}</td>", time(budget));
        for (backend, _) in &columns {
            let fits = scene.runs.iter().filter(|r| r.backend == *backend && r.frame_ms <= budget);
            match fits
                .min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse()))
                .filter(|r| r.rel_rmse().is_finite())
            {
                Some(r) => put!(
                    s,
                    "<td>{} <code>{}</code></td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
                    title(&r.technique),
                    escape(&r.label),
                    time(r.frame_ms),
                    percent(r.rel_rmse())
                ),
                None => put!(s, "<td class=\"hidden-by-noise\">nothing is that fast</td><td></td><td></td>"),
            }
        }
        put!(s, "</tr>");
    }
    put!(s, "</table></div>");
}

fn all_runs(s: &mut String, scene: &SceneReport) {
    put!(
        s,
        "<details><summary>All {} runs of {}</summary><div class=\"card\" style=\"margin-top:10px\"><table><tr><th>technique</th><th>where</th>\
         <th>setting</th><th class=\"n\">frame</th><th class=\"n\">rel. RMSE</th><th class=\"n\">bias</th><th class=\"n\">FLIP</th>\
         <th class=\"n\">matched rel. RMSE</th><th class=\"n\">bias</th><th class=\"n\">FLIP</th><th class=\"n\">rel. MSE</th><th class=\"n\">p50</th><th class=\"n\">p95</th><th class=\"n\">p99</th></tr>",
        scene.runs.len(),
        escape(&scene.name)
    );
    for run in &scene.runs {
        let rest = run.error.as_ref().map_or_else(
            || "<td></td><td></td><td></td><td></td>".to_owned(),
            |e| {
                let l = e.luminance;
                let cells = [digits(l.rel_mse), percent(l.p50), percent(l.p95), percent(l.p99)];
                cells.iter().map(|c| format!("<td class=\"n\">{c}</td>")).collect()
            },
        );
        put!(
            s,
            "<tr><td>{}</td><td>{}</td><td><code>{}</code></td><td class=\"n\">{}</td>{}{}{rest}</tr>",
            title(&run.technique),
            run.backend.name().to_uppercase(),
            escape(&run.label),
            time(run.frame_ms),
            error_cells(run),
            matched_cells(run)
        );
    }
    put!(s, "</table></div></details>");
}
