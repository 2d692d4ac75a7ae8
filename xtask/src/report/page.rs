//! The page: one HTML file with everything inside.

use std::fmt::Write;

use indirect_metrics::{flip, palette};
use indirect_scene::png;

use super::chart::{Axis, Chart, Marker, Point, Series, bytes, digits, escape, percent, time};
use super::data::{Consistency, Part, Report, Run, SceneReport, TechniqueReport};
use crate::failure::{Failure, Outcome};
use crate::technique::{Backend, REFERENCE};
use crate::validate::Deviation;

const STYLE: &str = include_str!("style.css");

/// Frame times for which the page names a setting, milliseconds.
const BUDGETS: [f64; 6] = [2.0, 8.0, 33.0, 100.0, 400.0, 2000.0];

/// Writing to a `String` cannot fail.
macro_rules! put {
    ($out:expr, $($arg:tt)*) => {{
        let _ = writeln!($out, $($arg)*);
    }};
}

/// The whole page.
pub(crate) fn html(report: &Report) -> Outcome<String> {
    let mut s = String::new();
    let m = &report.machine;
    put!(s, "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">");
    put!(s, "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">");
    put!(s, "<title>Indirect light: speed against error</title><style>{STYLE}</style></head><body>");
    put!(s, "<header><div><h1>Indirect light: speed against error</h1>");
    put!(
        s,
        "<p>Which technique, with which settings, for which scene and budget? Real-time techniques for diffuse indirect light, \
         measured against a path-traced truth on the same machine, each GPU version held against its CPU twin.</p>"
    );
    put!(s, "<ul class=\"facts\"><li>{}</li>", escape(&m.date));
    put!(s, "<li><b>{}</b>, {} threads, {}</li>", escape(&m.processor), m.threads, escape(&m.system));
    let adapter = m.adapter.as_deref().unwrap_or("none");
    put!(s, "<li>GPU adapter <b>{}</b></li><li>version {}</li>", escape(adapter), m.version);
    put!(s, "<li>{} run</li></ul>", if report.quick { "quick" } else { "full" });
    if report.scenes.len() > 1 {
        put!(s, "<nav>");
        for (i, scene) in report.scenes.iter().enumerate() {
            put!(s, "<a href=\"#scene{i}\">{}</a>", escape(&scene.name));
        }
        put!(s, "</nav>");
    }
    put!(s, "</div></header><main>");
    for left_out in &report.left_out {
        put!(s, "<p class=\"verdict loud\">{}</p>", escape(left_out));
    }
    overview(&mut s, report);
    for (i, scene) in report.scenes.iter().enumerate() {
        scene_section(&mut s, scene, i)?;
    }
    if let Some(consistency) = &report.consistency {
        consistency_section(&mut s, consistency);
    }
    definitions(&mut s);
    put!(s, "</main></body></html>");
    Ok(s)
}

/// All scenes at a glance.
fn overview(s: &mut String, report: &Report) {
    put!(
        s,
        "<h2>At a glance</h2><p class=\"lead\">The most accurate setting of each technique, per scene and backend, and how long the \
             path tracer takes to the same error on this machine's CPU.</p><div class=\"card\" style=\"margin-top:14px\"><table><tr>\
             <th>scene</th><th class=\"n\">triangles</th><th>technique</th><th>where</th><th>setting</th><th class=\"n\">frame</th>\
             <th class=\"n\">rel. RMSE</th><th class=\"n\">bias</th><th class=\"n\">FLIP</th><th class=\"n\">path tracer needs</th></tr>"
    );
    for (i, scene) in report.scenes.iter().enumerate() {
        let mut named = false;
        for technique in &scene.techniques {
            for backend in [Backend::Gpu, Backend::Cpu] {
                let of =
                    scene.runs.iter().filter(|r| r.technique == technique.technique && r.backend == backend);
                let Some(run) = of.min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse())) else { continue };
                let (name, triangles) = if named {
                    (String::new(), String::new())
                } else {
                    (format!("<a href=\"#scene{i}\">{}</a>", escape(&scene.name)), thousands(scene.triangles))
                };
                named = true;
                put!(
                    s,
                    "<tr><td>{name}</td><td class=\"n\">{triangles}</td><td>{}</td><td>{}</td><td><code>{}</code></td>\
                     <td class=\"n\">{}</td>{}<td class=\"n\">{}</td></tr>",
                    technique.technique,
                    backend.name().to_uppercase(),
                    escape(&run.label),
                    time(run.frame_ms),
                    error_cells(run),
                    baseline_time(scene, run.rel_rmse())
                );
            }
        }
    }
    put!(
        s,
        "</table></div><p class=\"caption\">Frame: camera, maps, virtual lights and gather, everything anew, as when camera and \
             lights move; building pipelines and ray structures is not in it. Errors are of the indirect light alone.</p>"
    );
}

fn scene_section(s: &mut String, scene: &SceneReport, index: usize) -> Outcome {
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
        technique_section(s, scene, technique);
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

fn curve(s: &mut String, scene: &SceneReport) {
    let mut series = vec![Series {
        colour: 0,
        marker: Marker::Front,
        dashed: false,
        points: scene.front.iter().map(|i| point(&scene.runs[*i])).collect(),
    }];
    let mut legend = String::new();
    let mut colours: Vec<(&str, usize)> = Vec::new();
    let mut first = 0;
    while let Some(run) = scene.runs.get(first) {
        let key = |r: &Run| (r.technique.clone(), r.backend, r.curve);
        let length = scene.runs[first..].iter().take_while(|r| key(r) == key(run)).count();
        let runs = &scene.runs[first..first + length];
        first += length;
        let next = colours.len();
        let identity = (run.technique.as_str(), run.curve);
        let colour = colours.iter().position(|c| *c == identity).unwrap_or_else(|| {
            colours.push(identity);
            next
        });
        let (marker, dashed) = match (run.technique.as_str(), run.backend) {
            (REFERENCE, _) => (Marker::Diamond, false),
            (_, Backend::Gpu) => (Marker::Circle, false),
            (_, Backend::Cpu) => (Marker::Square, true),
        };
        let name = if run.technique == REFERENCE {
            "path tracer, 1 sample per pixel and up (CPU)".to_owned()
        } else {
            format!("{}, {} ({})", run.technique, varied(runs), run.backend.name().to_uppercase())
        };
        put!(legend, "<li>{}{}</li>", swatch(colour, marker, dashed), escape(&name));
        series.push(Series { colour, marker, dashed, points: runs.iter().map(point).collect() });
    }
    let chart = Chart {
        x: Axis { title: "time per frame", format: time, base: 10.0 },
        y: Axis { title: "relative RMSE of the indirect light", format: percent, base: 10.0 },
        series,
        level: Some((scene.truth.noise, "noise of the truth: differences below it cannot be seen from here")),
        alt: "Error against time, both logarithmic, one curve per technique",
    };
    put!(
        s,
        "<h3>Error against time</h3><figure class=\"card\" style=\"margin:0\">{}<ul class=\"legend\">{legend}</ul></figure>",
        chart.svg()
    );
    put!(
        s,
        "<p class=\"caption\">Lower and further left is better; both axes are logarithmic. Each curve is one technique as its main setting \
         grows (rest the pointer on a mark for its setting). A curve that flattens has reached what its model leaves out: more work \
         does not help. The path tracer falls with the square root of time and has no such floor. The yellow band is the Pareto front. \
         CPU and GPU curves share a chart because they share the task, but they are different hardware.</p>"
    );
}

fn point(run: &Run) -> Point {
    Point {
        x: run.frame_ms,
        y: run.rel_rmse(),
        tip: format!(
            "{} on the {}: {}\n{} in {}",
            title(&run.technique),
            run.backend.name().to_uppercase(),
            run.label,
            percent(run.rel_rmse()),
            time(run.frame_ms)
        ),
    }
}

/// What changes along a curve and what stays, from the labels of its runs.
fn varied(runs: &[Run]) -> String {
    let words = |r: &Run| r.label.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let (Some(first), Some(last)) = (runs.first().map(words), runs.last().map(words)) else {
        return String::new();
    };
    let word = |(a, b): (&String, &String)| match (a.split_once('='), b.split_once('=')) {
        (Some((key, from)), Some((_, to))) if from != to => format!("{key} {from} to {to}"),
        _ => a.replace('=', " "),
    };
    first.iter().zip(&last).map(word).collect::<Vec<_>>().join(", ")
}

fn swatch(colour: usize, marker: Marker, dashed: bool) -> String {
    let dash = if dashed { " stroke-dasharray=\"5 4\"" } else { "" };
    let class = colour % 8;
    let dot = match marker {
        Marker::Front => String::new(),
        Marker::Circle => format!("<circle class=\"dot s{class}\" cx=\"17\" cy=\"6\" r=\"4.5\"/>"),
        Marker::Square => format!("<rect class=\"dot s{class}\" x=\"13\" y=\"2\" width=\"8\" height=\"8\"/>"),
        Marker::Diamond => format!("<path class=\"dot s{class}\" d=\"M17 .5l5.5 5.5l-5.5 5.5l-5.5 -5.5z\"/>"),
    };
    format!("<svg viewBox=\"0 0 34 12\"><path class=\"line s{class}\"{dash} d=\"M0 6h34\"/>{dot}</svg>")
}

fn pictures(s: &mut String, scene: &SceneReport) -> Outcome {
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

fn technique_section(s: &mut String, scene: &SceneReport, technique: &TechniqueReport) {
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
            escape(&d.pass),
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

fn all_runs(s: &mut String, scene: &SceneReport) {
    put!(
        s,
        "<details><summary>All {} runs of {}</summary><div class=\"card\" style=\"margin-top:10px\"><table><tr><th>technique</th><th>where</th>\
         <th>setting</th><th class=\"n\">frame</th><th class=\"n\">rel. RMSE</th><th class=\"n\">bias</th><th class=\"n\">FLIP</th>\
         <th class=\"n\">rel. MSE</th><th class=\"n\">p50</th><th class=\"n\">p95</th><th class=\"n\">p99</th></tr>",
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
            "<tr><td>{}</td><td>{}</td><td><code>{}</code></td><td class=\"n\">{}</td>{}{rest}</tr>",
            title(&run.technique),
            run.backend.name().to_uppercase(),
            escape(&run.label),
            time(run.frame_ms),
            error_cells(run)
        );
    }
    put!(s, "</table></div></details>");
}

/// Cells for rel_rmse, bias and FLIP; grey where the reference's noise hides the value.
fn error_cells(run: &Run) -> String {
    let (Some(e), Some(below)) = (&run.error, &run.below_floor) else {
        return "<td class=\"n\">–</td><td class=\"n\">–</td><td class=\"n\">–</td>".into();
    };
    let cell = |text: String, hidden: bool| {
        if hidden {
            format!("<td class=\"n hidden-by-noise\" title=\"below the noise of the truth\">≈ {text}</td>")
        } else {
            format!("<td class=\"n\">{text}</td>")
        }
    };
    cell(percent(e.luminance.rel_rmse), below.rel_rmse)
        + &cell(signed(e.luminance.bias), below.bias)
        + &cell(digits(e.flip), false)
}

fn consistency_section(s: &mut String, c: &Consistency) {
    let curve = |colour, marker, dashed, y: fn(&super::data::ConsistencyPoint) -> f64| Series {
        colour,
        marker,
        dashed,
        points: c
            .points
            .iter()
            .map(|p| Point {
                x: f64::from(p.resolution),
                y: y(p),
                tip: format!("{0}² texels, {1} lights: {2}", p.resolution, p.vpls, percent(y(p))),
            })
            .collect(),
    };
    let chart = Chart {
        x: Axis { title: "texels along each side of the shadow map", format: digits, base: 2.0 },
        y: Axis { title: "relative RMSE against the matched reference", format: percent, base: 10.0 },
        series: vec![
            curve(1, Marker::Circle, false, |p| p.rel_rmse_away),
            curve(2, Marker::Square, true, |p| p.rel_rmse),
        ],
        level: Some((c.noise_floor, "noise of the matched reference")),
        alt: "Error of the gather against shadow map resolution",
    };
    put!(
        s,
        "<h2>Does the gather converge to what it should?</h2><p class=\"lead\">With every texel as a virtual light, the gather must approach one \
         bounce without visibility, which the path tracer computes too. Fixture <code>{}</code>.</p><figure class=\"card\" style=\"margin:14px 0 0\">{}\
         <ul class=\"legend\"><li>{}away from the corner, by a tenth of the scene</li><li>{}all pixels</li></ul></figure>\
         <p class=\"caption\">A straight line down means that only the resolution limits the error: the model is implemented right. In the \
         corner virtual lights touch their receivers, and the error falls more slowly there.</p>",
        c.scene,
        chart.svg(),
        swatch(1, Marker::Circle, false),
        swatch(2, Marker::Square, true)
    );
}

fn definitions(s: &mut String) {
    put!(
        s,
        "<h2>What the numbers mean</h2><div class=\"card\"><table>\
         <tr><td>rel. RMSE</td><td>√mean((x − r)²) / mean(r): x the technique's and r the truth's indirect radiance (luminance), over pixels that see a surface</td></tr>\
         <tr><td>bias</td><td>mean(x) / mean(r) − 1: negative is too dark. What remains when noise is averaged away</td></tr>\
         <tr><td>FLIP</td><td>mean of the perceived difference (Andersson et al. 2020), 0 to 1, at the exposure of the pictures</td></tr>\
         <tr><td>rel. MSE</td><td>mean((x − r)² / (r² + 0.01·mean(r)²)): weighs dark regions as much as bright ones</td></tr>\
         <tr><td>p50, p95, p99</td><td>percentiles of |x − r| / mean(r)</td></tr>\
         <tr><td>≈ grey</td><td>the truth's own noise is as large as the difference: take it as “no more than that”</td></tr>\
         </table></div><footer>Written by <code>cargo xtask report</code>. The same numbers, and more, are in report.json and report.csv beside this page.</footer>"
    );
}

/// Time that the path tracer takes to an error, from its curve; beyond the curve's ends it is extrapolated with the square
/// root law.
fn baseline_time(scene: &SceneReport, error: f64) -> String {
    let curve: Vec<_> = scene
        .runs
        .iter()
        .filter(|r| r.technique == REFERENCE && r.rel_rmse().is_finite())
        .map(|r| (r.frame_ms.ln(), r.rel_rmse().max(1e-12).ln()))
        .collect();
    let (Some(first), Some(last)) = (curve.first(), curve.last()) else { return "–".into() };
    if !(error > 0.0 && error.is_finite()) {
        return "–".into();
    }
    let e = error.ln();
    if e >= first.1 {
        return format!("&lt; {}", time(first.0.exp()));
    }
    if e <= last.1 {
        return format!("about {}", time((last.0 + 2.0 * (last.1 - e)).exp()));
    }
    let pair = curve.windows(2).find(|p| p[1].1 <= e && e <= p[0].1);
    pair.map_or_else(
        || "–".into(),
        |p| {
            let t = (p[0].1 - e) / (p[0].1 - p[1].1).max(1e-12);
            time((p[0].0 + t * (p[1].0 - p[0].0)).exp())
        },
    )
}

fn title(technique: &str) -> &str {
    if technique == REFERENCE { "path tracer" } else { technique }
}

fn signed(v: f64) -> String {
    format!("{}{}", if v < 0.0 { "−" } else { "+" }, percent(v.abs()))
}

/// One digit after the point and a power of ten; plain 0.
fn power(v: f64) -> String {
    if v == 0.0 { "0".into() } else { format!("{v:.1e}") }
}

/// Digits in groups of three.
fn thousands(n: usize) -> String {
    let text = n.to_string();
    let mut out = String::new();
    for (i, c) in text.chars().enumerate() {
        if i > 0 && (text.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}
