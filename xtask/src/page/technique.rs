//! One technique on one scene: what it models, where its error comes from, its passes and its twins.

use super::chart::{bytes, escape, percent, time};
use super::text::{power, put, signed, thousands};
use crate::measure::{Part, Run, SceneReport, TechniqueReport};
use crate::technique::Backend;
use testkit::Deviation;

pub(super) fn section(s: &mut String, scene: &SceneReport, technique: &TechniqueReport) {
    let name = &technique.technique;
    put!(s, "<h3>{name}: what it models here</h3><div class=\"card grid2\">");
    for (title, lines) in
        [("Modelled", &technique.notes.modelled), ("Skipped, and why", &technique.notes.skipped)]
    {
        put!(s, "<div><b>{title}</b><ul class=\"notes\">");
        if lines.is_empty() {
            put!(s, "<li>nothing</li>");
        }
        for line in lines {
            let class = if line.starts_with("EVERYTHING") { " class=\"loud\"" } else { "" };
            put!(s, "<li{class}>{}</li>", escape(line));
        }
        put!(s, "</ul></div>");
    }
    put!(s, "</div>");
    if let Some(split) = &technique.split {
        put!(
            s,
            "<h3>{name}: where its error comes from</h3><div class=\"card\"><table><tr><th>part</th><th>what it is</th>\
             <th class=\"n\">bias</th><th class=\"n\">RMS difference</th></tr>"
        );
        for part in &split.parts {
            put!(
                s,
                "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td>{}</tr>",
                part.name,
                part.explanation,
                signed(part.measures.bias),
                rms_cell(part)
            );
        }
        put!(
            s,
            "<tr><td><b>whole</b></td><td>against the truth, with <code>{}</code></td><td class=\"n\">{}</td>{}</tr></table></div>",
            escape(&split.label),
            signed(split.whole.measures.bias),
            rms_cell(&split.whole)
        );
        put!(
            s,
            "<p class=\"caption\">A chain of images from the truth to the technique, each with one thing more left out; relative to the mean of \
             the truth. The biases add up to the whole, the RMS differences (without the noise of the images) do not. “Later bounces”, \
             “visibility” and “emitters” are the transport model's; only “discretisation” gets smaller with more work; “precision” is what the \
             GPU changes.</p>"
        );
    }
    passes(s, scene, name);
    twins(s, technique);
}

/// Grey where noise is the larger share.
fn rms_cell(part: &Part) -> String {
    match part.own() {
        (v, false) => format!("<td class=\"n\">{}</td>", percent(v)),
        (v, true) => format!(
            "<td class=\"n hidden-by-noise\" title=\"below the noise of the images\">&lt; {}</td>",
            percent(v)
        ),
    }
}

fn passes(s: &mut String, scene: &SceneReport, technique: &str) {
    let chosen = |backend| {
        let runs = scene.runs.iter().filter(move |r| r.technique == technique && r.backend == backend);
        runs.min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse()))
    };
    let runs: Vec<&Run> = [Backend::Gpu, Backend::Cpu].into_iter().filter_map(chosen).collect();
    let longest = runs.iter().flat_map(|r| &r.passes).map(|p| p.ms).fold(1e-9, f64::max);
    put!(s, "<h3>{technique}: time per pass, and memory</h3><div class=\"grid2\">");
    for run in runs {
        let backend = run.backend.name();
        put!(
            s,
            "<div class=\"card\"><b>{}</b> <code>{}</code><table style=\"margin-top:8px\"><tr><th>pass</th><th class=\"n\">time</th><th></th></tr>",
            backend.to_uppercase(),
            escape(&run.label)
        );
        for pass in &run.passes {
            put!(
                s,
                "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"bar\"><i class=\"{backend}\" style=\"width:{:.1}%\"></i></td></tr>",
                escape(&pass.name),
                time(pass.ms),
                100.0 * pass.ms / longest
            );
        }
        put!(
            s,
            "<tr><td><b>frame</b></td><td class=\"n\"><b>{}</b></td><td>median of {}</td></tr>",
            time(run.frame_ms),
            run.frames
        );
        put!(
            s,
            "<tr><td>once</td><td class=\"n\">{}</td><td>pipelines and buffers</td></tr>",
            time(run.prepare_ms)
        );
        let memory = if run.backend == Backend::Gpu { run.bytes.gpu } else { run.bytes.cpu };
        put!(
            s,
            "<tr><td>memory</td><td class=\"n\">{}</td><td>beyond the scene</td></tr></table></div>",
            bytes(memory)
        );
    }
    put!(s, "</div>");
}

fn twins(s: &mut String, technique: &TechniqueReport) {
    let Some(twins) = &technique.twins else { return };
    put!(
        s,
        "<h3>{}: GPU against CPU, pass by pass</h3><div class=\"card\"><table><tr><th>pass</th><th class=\"n\">elements</th>\
         <th class=\"n\">largest deviation</th><th class=\"n\">99.9 % within</th><th class=\"n\">tolerance</th><th class=\"n\">silhouettes</th>\
         <th></th></tr>",
        technique.technique
    );
    for d in Deviation::per_pass(twins) {
        put!(
            s,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td>{}</td></tr>",
            escape(d.pass),
            thousands(d.elements),
            power(d.max),
            power(d.p999),
            power(d.tolerance),
            thousands(d.silhouettes),
            match &d.breach {
                None => "<span class=\"ok\">agree</span>".to_owned(),
                Some(b) =>
                    format!("<span class=\"breach\">breach</span> in {}: {}", escape(&d.buffer), escape(b)),
            }
        );
    }
    put!(
        s,
        "</table></div><p class=\"caption\">Deviations are relative, with an absolute floor of a hundredth of the tolerance. Silhouettes are elements where \
         the two see different triangles: counted, and left out of the figures beside them.</p>"
    );
}
