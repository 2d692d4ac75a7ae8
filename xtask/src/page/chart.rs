//! Log-log charts as inline SVG whose colours come from the page's style sheet, so that they follow light and dark mode.

use std::fmt::Write;

/// A chart with logarithmic axes.
pub(crate) struct Chart<'a> {
    pub(crate) x: Axis<'a>,
    pub(crate) y: Axis<'a>,
    pub(crate) series: Vec<Series>,
    /// A level of y drawn as a dashed line, with its label.
    pub(crate) level: Option<(f64, &'a str)>,
    /// Read aloud, and shown where the chart cannot be.
    pub(crate) alt: &'a str,
}

/// One axis.
pub(crate) struct Axis<'a> {
    pub(crate) title: &'a str,
    pub(crate) format: fn(f64) -> String,
    /// Powers of this number carry a label: 10, or 2 for sizes.
    pub(crate) base: f64,
}

/// A curve with a marker at each point.
pub(crate) struct Series {
    /// Chooses the colour: `0..8`, or `FRONT`.
    pub(crate) colour: usize,
    pub(crate) marker: Marker,
    pub(crate) dashed: bool,
    pub(crate) points: Vec<Point>,
}

pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Shown when the pointer rests on the marker.
    pub(crate) tip: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Marker {
    Circle,
    Square,
    Diamond,
    /// A wide line behind everything else, without markers: the Pareto front.
    Front,
}

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 430.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 52.0;

/// A logarithmic range in which all values lie, with a little room.
struct Range {
    lo: f64,
    hi: f64,
}

impl Range {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (lo, hi) = values
            .filter(|v| v.is_finite() && *v > 0.0)
            .fold((f64::INFINITY, 0.0_f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
        (hi > 0.0).then(|| {
            // At least half a decade, so that a single point is not the whole axis.
            let (lo, hi) = (lo.ln() - 0.15, hi.ln() + 0.15);
            let room = (1.2 - (hi - lo)).max(0.0) / 2.0;
            Self { lo: lo - room, hi: hi + room }
        })
    }

    fn fraction(&self, v: f64) -> f64 {
        (v.ln() - self.lo) / (self.hi - self.lo)
    }

    fn contains(&self, v: f64) -> bool {
        (0.0..=1.0).contains(&self.fraction(v))
    }

    /// Values with a grid line, and whether the line has a label.
    fn ticks(&self, base: f64) -> Vec<(f64, bool)> {
        let power = |v: f64| (v / base.ln()).floor() as i32;
        let decades = (self.hi - self.lo) / base.ln();
        let steps: &[f64] = match base as u32 {
            10 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        (power(self.lo)..=power(self.hi))
            .flat_map(|p| steps.iter().map(move |s| (s * base.powi(p), *s == 1.0 || decades < 2.3)))
            .filter(|(v, _)| self.contains(*v))
            .collect()
    }
}

impl Chart<'_> {
    /// The chart as an `<svg>` element; empty where there is no positive value to draw.
    pub(crate) fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|s| &s.points);
        let level = self.level.iter().map(|l| l.0);
        let (Some(xs), Some(ys)) =
            (Range::of(points().map(|p| p.x)), Range::of(points().map(|p| p.y).chain(level)))
        else {
            return String::new();
        };
        let x = |v: f64| LEFT + xs.fraction(v) * (WIDTH - LEFT - RIGHT);
        let y = |v: f64| HEIGHT - BOTTOM - ys.fraction(v) * (HEIGHT - TOP - BOTTOM);
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        let mut s = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" class=\"chart\" aria-label=\"{}\">",
            escape(self.alt)
        );
        for (v, labelled) in xs.ticks(self.x.base) {
            let (class, px) = (if labelled { "grid" } else { "grid minor" }, x(v));
            push(
                &mut s,
                format_args!(
                    "<line class=\"{class}\" x1=\"{px:.1}\" x2=\"{px:.1}\" y1=\"{TOP}\" y2=\"{bottom}\"/>"
                ),
            );
            if labelled {
                let text = (self.x.format)(v);
                push(
                    &mut s,
                    format_args!(
                        "<text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                        bottom + 18.0
                    ),
                );
            }
        }
        for (v, labelled) in ys.ticks(self.y.base) {
            let (class, py) = (if labelled { "grid" } else { "grid minor" }, y(v));
            push(
                &mut s,
                format_args!(
                    "<line class=\"{class}\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{py:.1}\" y2=\"{py:.1}\"/>"
                ),
            );
            if labelled {
                let text = (self.y.format)(v);
                push(
                    &mut s,
                    format_args!(
                        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                        LEFT - 8.0,
                        py + 4.0
                    ),
                );
            }
        }
        push(
            &mut s,
            format_args!(
                "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                (LEFT + right) / 2.0,
                HEIGHT - 10.0,
                escape(self.x.title)
            ),
        );
        let middle = (TOP + bottom) / 2.0;
        push(
            &mut s,
            format_args!(
                "<text class=\"axis\" transform=\"translate(16 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                escape(self.y.title)
            ),
        );
        if let Some((v, label)) = self.level.filter(|l| l.0 > 0.0 && l.0.is_finite()) {
            let py = y(v);
            push(
                &mut s,
                format_args!(
                    "<line class=\"level\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{py:.1}\" y2=\"{py:.1}\"/>"
                ),
            );
            push(
                &mut s,
                format_args!(
                    "<text class=\"level\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                    LEFT + 6.0,
                    py - 5.0,
                    escape(label)
                ),
            );
        }
        for series in &self.series {
            series.draw(&mut s, &x, &y);
        }
        s.push_str("</svg>");
        s
    }
}

impl Series {
    fn draw(&self, s: &mut String, x: &dyn Fn(f64) -> f64, y: &dyn Fn(f64) -> f64) {
        let drawn: Vec<_> =
            self.points.iter().filter(|p| p.x > 0.0 && p.y > 0.0 && p.y.is_finite()).collect();
        let class =
            if self.marker == Marker::Front { "front".to_owned() } else { format!("s{}", self.colour % 8) };
        if drawn.len() > 1 {
            let path: Vec<_> = drawn.iter().map(|p| format!("{:.1},{:.1}", x(p.x), y(p.y))).collect();
            let dash = if self.dashed { " stroke-dasharray=\"5 4\"" } else { "" };
            push(s, format_args!("<polyline class=\"line {class}\"{dash} points=\"{}\"/>", path.join(" ")));
        }
        for p in drawn {
            let (px, py, tip) = (x(p.x), y(p.y), escape(&p.tip));
            match self.marker {
                Marker::Front => {}
                Marker::Circle => push(
                    s,
                    format_args!(
                        "<circle class=\"dot {class}\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4.5\"><title>{tip}</title></circle>"
                    ),
                ),
                Marker::Square => push(
                    s,
                    format_args!(
                        "<rect class=\"dot {class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\"><title>{tip}</title></rect>",
                        px - 4.0,
                        py - 4.0
                    ),
                ),
                Marker::Diamond => push(
                    s,
                    format_args!(
                        "<path class=\"dot {class}\" d=\"M{px:.1} {:.1}l5.5 5.5l-5.5 5.5l-5.5 -5.5z\"><title>{tip}</title></path>",
                        py - 5.5
                    ),
                ),
            }
        }
    }
}

/// Writing to a `String` cannot fail.
fn push(s: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = s.write_fmt(text);
}

/// Text made safe for HTML and XML content and attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// Milliseconds with a fitting unit and three digits.
pub(crate) fn time(ms: f64) -> String {
    match ms {
        ms if ms >= 1e3 => format!("{} s", digits(ms / 1e3)),
        ms if ms >= 0.1 => format!("{} ms", digits(ms)),
        ms => format!("{} µs", digits(ms * 1e3)),
    }
}

/// A share as a percentage with three digits.
pub(crate) fn percent(v: f64) -> String {
    format!("{} %", digits(v * 100.0))
}

/// Bytes with a fitting unit.
pub(crate) fn bytes(n: u64) -> String {
    match n as f64 {
        n if n >= 1e9 => format!("{} GB", digits(n / 1e9)),
        n if n >= 1e6 => format!("{} MB", digits(n / 1e6)),
        n if n >= 1e3 => format!("{} kB", digits(n / 1e3)),
        n => format!("{n} B"),
    }
}

/// Three significant digits without zeros at the end; with an exponent below a ten-thousandth.
pub(crate) fn digits(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    if v.abs() < 1e-4 {
        return format!("{v:.1e}");
    }
    let decimals = (2 - v.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(
            (time(0.0421), time(12.0), time(1234.0)),
            ("42.1 µs".into(), "12 ms".into(), "1.23 s".into())
        );
        assert_eq!((percent(0.012_34), percent(1.5)), ("1.23 %".into(), "150 %".into()));
        assert_eq!((bytes(999), bytes(1_500_000)), ("999 B".into(), "1.5 MB".into()));
        assert_eq!(
            (digits(100.0), digits(0.001_234), digits(0.0)),
            ("100".into(), "0.00123".into(), "0".into())
        );
    }

    #[test]
    fn chart_draws_what_is_positive() {
        let axis = |title| Axis { title, format: percent, base: 10.0 };
        let point = |x, y| Point { x, y, tip: "a <b>".into() };
        let series = Series {
            colour: 0,
            marker: Marker::Circle,
            dashed: false,
            points: vec![point(1.0, 0.1), point(10.0, 0.01), point(2.0, 0.0), point(3.0, f64::NAN)],
        };
        let mut chart = Chart { x: axis("x"), y: axis("y"), series: vec![series], level: None, alt: "c" };
        let svg = chart.svg();
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains("a &lt;b&gt;") && !svg.contains("NaN"));
        chart.series[0].points.drain(..2);
        assert_eq!(chart.svg(), "");
    }

    #[test]
    fn ticks_are_inside_and_increase() {
        for (lo, hi, base) in [(0.5, 2000.0, 10.0), (16.0, 512.0, 2.0), (1.0, 1.0, 10.0)] {
            let range = Range::of([lo, hi].into_iter()).unwrap();
            let ticks = range.ticks(base);
            assert!(!ticks.is_empty() && ticks.iter().any(|t| t.1), "{lo} {hi}");
            assert!(ticks.is_sorted_by(|a, b| a.0 < b.0));
        }
    }
}
