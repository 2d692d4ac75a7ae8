//! Figures and cells of tables as text.

use indirect_metrics::Comparison;

use super::chart::{digits, percent, time};
use crate::measure::{Run, SceneReport};
use crate::technique::REFERENCE;

/// Writing to a `String` cannot fail.
macro_rules! put {
    ($out:expr, $($arg:tt)*) => {{
        use std::fmt::Write as _;
        let _ = writeln!($out, $($arg)*);
    }};
}
pub(super) use put;

/// Cells for rel_rmse, bias and FLIP; grey where the reference's noise hides the value.
pub(super) fn error_cells(run: &Run) -> String {
    comparison_cells(run.error.as_ref())
}

/// As [`error_cells`], against the reference that models no more than the run does.
pub(super) fn matched_cells(run: &Run) -> String {
    comparison_cells(run.matched.as_ref().map(|m| &m.error))
}

fn comparison_cells(error: Option<&Comparison>) -> String {
    let Some(e) = error else {
        return "<td class=\"n\">–</td><td class=\"n\">–</td><td class=\"n\">–</td>".into();
    };
    let below = e.luminance.below_floor(&e.noise_floor);
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

/// Time that the path tracer takes to an error, from its curve; beyond the curve's ends it is extrapolated with the square
/// root law.
pub(super) fn baseline_time(scene: &SceneReport, error: f64) -> String {
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

pub(super) fn title(technique: &str) -> &str {
    if technique == REFERENCE { "path tracer" } else { technique }
}

pub(super) fn signed(v: f64) -> String {
    format!("{}{}", if v < 0.0 { "−" } else { "+" }, percent(v.abs()))
}

/// One digit after the point and a power of ten; plain 0.
pub(super) fn power(v: f64) -> String {
    if v == 0.0 { "0".into() } else { format!("{v:.1e}") }
}

/// Digits in groups of three.
pub(super) fn thousands(n: usize) -> String {
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
