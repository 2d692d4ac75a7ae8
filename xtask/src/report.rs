//! `report`: one page, self-contained, and its numbers as JSON and CSV.

use std::fmt::Write;

use crate::cli::ReportArgs;
use crate::failure::{self, Failure, Outcome};
use crate::measure::{self, Effort, Machine, Report, SceneReport};
use crate::page::{self, bytes};
use crate::stage::Source;
use crate::technique::{self, Technique};
use crate::{doctor, gpu, say, setup, warn};

/// The scene of a report without arguments.
const DEFAULT_SCENE: &str = "cornell_spot";

pub(crate) fn run(args: &ReportArgs) -> Outcome {
    let quick = args.quick || args.scenes.is_empty();
    let scenes = if args.scenes.is_empty() { vec![DEFAULT_SCENE.to_owned()] } else { args.scenes.clone() };
    // An output folder that cannot be written is found before the work, not after.
    let json = args.out.join("report.json");
    failure::will_write(&json)?;
    if !args.cpu_only {
        setup::vulkan_driver();
    }
    let adapter = if args.cpu_only { None } else { gpu::describe() };
    let mut left_out = Vec::new();
    if adapter.is_none() {
        left_out.push(if args.cpu_only {
            "The GPU was left out on request: no GPU times, and GPU and CPU were not compared.".to_owned()
        } else {
            format!(
                "No GPU adapter was found: no GPU times, and GPU and CPU were not compared. For a software adapter run: {}",
                setup::INSTALL
            )
        });
    }
    let effort = Effort { quick };
    let techniques = technique::real_time();
    let (mut measured, mut failed) = (Vec::new(), None);
    for (i, argument) in scenes.iter().enumerate() {
        if scenes.len() > 1 {
            say(format!("[{}/{}] {argument}", i + 1, scenes.len()));
        }
        match scene(argument, &techniques, effort, adapter.is_some()) {
            Ok(report) => measured.push(report),
            // What the other scenes took hours for is not lost.
            Err(f) if scenes.len() > 1 => {
                warn(f.line());
                left_out.push(format!("{argument} was left out: {}", f.line()));
                failed.get_or_insert(f);
            }
            Err(f) => return Err(f),
        }
    }
    if measured.is_empty() {
        return failed.map_or(Ok(()), Err);
    }
    let report = Report {
        machine: machine(adapter),
        quick,
        scenes: measured,
        consistency: Some(measure::consistency(quick)?),
        left_out,
    };
    let page = args.out.join("index.html");
    failure::write(&page, page::html(&report)?)?;
    failure::write_json(&json, &report)?;
    failure::write(&args.out.join("report.csv"), csv(&report.scenes))?;
    say(format!("{}", page.display()));
    failed.map_or(Ok(()), Err)
}

/// Loads and measures a scene and says in a line what came out.
pub(crate) fn scene(
    argument: &str,
    techniques: &[Box<dyn Technique>],
    effort: Effort,
    with_gpu: bool,
) -> Outcome<SceneReport> {
    let source = Source::load(argument)?;
    source.warnings.iter().for_each(|w| warn(format!("{argument}: {w}")));
    let report = measure::scene(&source, techniques, effort, with_gpu)?;
    let peak = report.peak_bytes.map_or_else(String::new, |b| format!(", peak memory {}", bytes(b)));
    say(format!("{}: {} triangles, {:.0} s{peak}", report.name, report.triangles, report.seconds));
    for t in &report.techniques {
        for d in t.twins.iter().flatten() {
            if let Some(breach) = &d.breach {
                warn(format!("{argument}: {}: GPU and CPU differ in `{}`: {breach}", t.technique, d.pass));
            }
        }
    }
    Ok(report)
}

fn machine(adapter: Option<String>) -> Machine {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    Machine {
        date: date(since.as_secs() / 86_400),
        version: env!("CARGO_PKG_VERSION"),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        processor: doctor::cpu(),
        threads: doctor::threads(),
        adapter,
    }
}

/// `YYYY-MM-DD` of a number of days since 1970-01-01, in the Gregorian calendar: years are counted from March, so that the
/// leap day is the last of its year, and 400 years have 146 097 days.
fn date(days: u64) -> String {
    let shifted = days + 719_468;
    let (era, day) = (shifted / 146_097, shifted % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year + era * 400 + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

/// One row per run.
fn csv(scenes: &[SceneReport]) -> String {
    let mut out = String::from(
        "scene,technique,backend,settings,frame_ms,prepare_ms,bias,rel_rmse,rel_mse,p50,p95,p99,flip,\
         noise_floor_rel_rmse,cpu_bytes,gpu_bytes,matched_bounces,matched_occluded,matched_bias,matched_rel_rmse,matched_flip\n",
    );
    for scene in scenes {
        for run in &scene.runs {
            let error = run.error.as_ref().map_or_else(
                || ",,,,,,,".to_owned(),
                |e| {
                    let l = e.luminance;
                    let floor = e.noise_floor.rel_rmse;
                    format!(
                        "{},{},{},{},{},{},{},{floor}",
                        l.bias, l.rel_rmse, l.rel_mse, l.p50, l.p95, l.p99, e.flip
                    )
                },
            );
            let matched = run.matched.as_ref().map_or_else(
                || ",,,,".to_owned(),
                |m| {
                    let (t, l) = (m.transport, m.error.luminance);
                    format!("{},{},{},{},{}", t.bounces, t.occluded, l.bias, l.rel_rmse, m.error.flip)
                },
            );
            // Writing to a String cannot fail.
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{error},{},{},{matched}",
                quote(&scene.name),
                run.technique,
                run.backend.name(),
                quote(&run.label),
                run.frame_ms,
                run.prepare_ms,
                run.bytes.cpu,
                run.bytes.gpu
            );
        }
    }
    out
}

/// A CSV field (RFC 4180).
fn quote(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Writes `sweep`'s file: one scene, as report.json holds it.
pub(crate) fn write_scene(path: &std::path::Path, report: &SceneReport) -> Outcome {
    failure::write_json(path, report).map_err(|f| Failure::Input(f.line()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_known_days() {
        for (days, expected) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (20_454, "2026-01-01"),
            (20_148, "2025-03-01"),
        ] {
            assert_eq!(date(days), expected);
        }
    }

    #[test]
    fn fields_are_quoted_where_needed() {
        assert_eq!(
            (quote("a b"), quote("a,b"), quote("a\"b")),
            ("a b".into(), "\"a,b\"".into(), "\"a\"\"b\"".into())
        );
    }
}
