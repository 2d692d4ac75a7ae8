//! Error against time.

use super::chart::{Axis, Chart, Marker, Point, Series, escape, percent, time};
use super::text::{put, title};
use crate::measure::{Run, SceneReport};
use crate::technique::{Backend, REFERENCE};

pub(super) fn curve(s: &mut String, scene: &SceneReport) {
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

pub(super) fn swatch(colour: usize, marker: Marker, dashed: bool) -> String {
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
