//! The page: one HTML file with everything inside.

mod chart;
mod curve;
mod pictures;
mod scene;
mod technique;
mod text;

use crate::failure::Outcome;
use crate::measure::{Consistency, ConsistencyPoint, Report};
use crate::technique::Backend;
pub(crate) use chart::bytes;
use chart::{Axis, Chart, Marker, Point, Series, digits, escape, percent, time};
use curve::swatch;
use scene::scene_section;
use text::{baseline_time, error_cells, put, thousands};

const STYLE: &str = include_str!("style.css");

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

fn consistency_section(s: &mut String, c: &Consistency) {
    let curve = |colour, marker, dashed, y: fn(&ConsistencyPoint) -> f64| Series {
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
         <tr><td>matched</td><td>the same measures against the path tracer with only what these settings model: so many bounces, with or without visibility of \
         the first. What the sampling, the lattice and the maps cost, without what is left out on purpose</td></tr>\
         <tr><td>FLIP</td><td>mean of the perceived difference (Andersson et al. 2020), 0 to 1, at the exposure of the pictures</td></tr>\
         <tr><td>rel. MSE</td><td>mean((x − r)² / (r² + 0.01·mean(r)²)): weighs dark regions as much as bright ones</td></tr>\
         <tr><td>p50, p95, p99</td><td>percentiles of |x − r| / mean(r)</td></tr>\
         <tr><td>≈ grey</td><td>the truth's own noise is as large as the difference: take it as “no more than that”</td></tr>\
         </table></div><footer>Written by <code>cargo xtask report</code>. The same numbers, and more, are in report.json and report.csv beside this page.</footer>"
    );
}
