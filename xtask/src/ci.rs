//! `test`: everything that CI runs, as named steps.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use cargo_metadata::semver::VersionReq;
use cargo_metadata::{DependencyKind, MetadataCommand, Package};

use crate::cli::TestArgs;
use crate::failure::{Failure, Outcome};
use crate::{diagrams, fixtures, layers, packages, say, setup, validate, web};

/// How a step ended.
enum End {
    Passed,
    /// Passed, with the number of tests that passed, failed and were skipped.
    Tests([usize; 3]),
    /// As [`End::Tests`], where some failed.
    TestsFailed([usize; 3]),
    Skipped(String),
    Failed(String),
}

/// One step: a name, what its failure means, and the work.
struct Step {
    name: String,
    /// Printed when the step fails: what to do about it.
    hint: &'static str,
    work: Box<dyn FnOnce() -> End>,
}

impl Step {
    fn new(name: impl Into<String>, hint: &'static str, work: impl FnOnce() -> End + 'static) -> Self {
        Self { name: name.into(), hint, work: Box::new(work) }
    }
}

pub(crate) fn run(args: &TestArgs) -> Outcome {
    let wanted =
        |step: &Step| args.only.is_empty() || args.only.iter().any(|o| step.name.contains(o.as_str()));
    let steps: Vec<_> = steps()?.into_iter().filter(wanted).collect();
    if args.list {
        steps.iter().for_each(|s| say(&s.name));
        return Ok(());
    }
    if steps.is_empty() {
        return Err(Failure::Input(format!("--only {}: no such step, see test --list", args.only.join(" "))));
    }
    setup::vulkan_driver();
    let start = Instant::now();
    let (mut passed, mut tests) = (0, [0; 3]);
    let (mut failed, mut skipped) = (Vec::new(), Vec::new());
    for step in steps {
        say(format!("\n== {}", step.name));
        let begin = Instant::now();
        let end = (step.work)();
        let seconds = begin.elapsed().as_secs_f64();
        match end {
            End::Passed => passed += 1,
            End::Tests(counts) => {
                passed += 1;
                tests = counts;
            }
            End::Skipped(why) => {
                say(format!("skipped: {why}"));
                skipped.push(format!("{} ({why})", step.name));
                continue;
            }
            End::TestsFailed(counts) => {
                tests = counts;
                let [ok, bad, _] = counts;
                say(format!("FAILED after {seconds:.0} s: {bad} tests failed, {ok} passed\n  {}", step.hint));
                failed.push(step.name);
                continue;
            }
            End::Failed(why) => {
                say(format!("FAILED after {seconds:.0} s: {why}\n  {}", step.hint));
                failed.push(step.name);
                continue;
            }
        }
        say(format!("ok, {seconds:.1} s"));
    }
    let [ok, bad, left] = tests;
    say(format!(
        "\n{passed} steps passed, {} failed, {} skipped in {:.0} s",
        failed.len(),
        skipped.len(),
        start.elapsed().as_secs_f64()
    ));
    skipped.iter().for_each(|s| say(format!("  skipped: {s}")));
    say(format!("tests: {ok} passed, {bad} failed, {left} skipped"));
    if failed.is_empty() {
        Ok(())
    } else {
        Err(Failure::Check(format!("failed steps: {}", failed.join(", "))))
    }
}

fn steps() -> Outcome<Vec<Step>> {
    let metadata = MetadataCommand::new()
        .manifest_path(crate::root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .map_err(|e| Failure::Check(format!("cargo metadata: {e}")))?;
    let published: Vec<_> =
        metadata.packages.iter().filter(|p| p.publish.as_ref().is_none_or(|to| !to.is_empty())).collect();
    // One profile for everything: release, which the tests need for their speed, so that dependencies are compiled once.
    let mut steps = vec![
        Step::new("format", "run `cargo fmt --all`", || cargo(&["fmt", "--all", "--check"])),
        Step::new("layers", "draw the edge in docs/architecture.md, or remove the dependency", || {
            own(layers::run())
        }),
        Step::new("clippy", "fix the lints above", || {
            cargo(&[
                "clippy",
                "--workspace",
                "--all-targets",
                "--all-features",
                "--release",
                "--quiet",
                "--",
                "-D",
                "warnings",
            ])
        }),
        Step::new("tests", "run the failing test alone: cargo test --release -p PACKAGE NAME", tests),
        Step::new("documentation", "fix the warnings of rustdoc above", || {
            let mut command =
                cargo_command(&["doc", "--workspace", "--no-deps", "--all-features", "--release", "--quiet"]);
            command.env("RUSTDOCFLAGS", "-D warnings");
            status(command)
        }),
    ];
    steps.extend(feature_builds(&published));
    steps.push(no_std(&published));
    steps.push(package(&published));
    steps.push(Step::new("published files", "see the lines above", {
        let folders: Vec<_> =
            published.iter().filter_map(|p| p.manifest_path.parent().map(Into::into)).collect();
        move || own(packages::check(&folders))
    }));
    steps.push(unpacked(&published));
    steps.push(Step::new("fixtures", "run `cargo xtask fixtures` and commit what changed", || {
        own(fixtures::check())
    }));
    steps.push(Step::new("diagrams", "run `cargo xtask diagrams` and commit what changed", || {
        without_adapter(diagrams::run(true))
    }));
    steps.push(Step::new("validate", "GPU and CPU disagree: see the passes above", || {
        without_adapter(validate::fixtures())
    }));
    steps.push(Step::new("browser", "what runs natively does not in a browser: see the lines above", || {
        match web::check() {
            Ok(()) => End::Passed,
            Err(web::Ended::Skipped(why)) => End::Skipped(why),
            Err(web::Ended::Failed(f)) => End::Failed(f.line()),
        }
    }));
    steps.push(tool("typos", &[], "fix the spelling, or add the word to typos.toml"));
    steps.push(tool("cargo-deny", &["--offline", "check", "licenses", "bans", "sources"], "see deny.toml"));
    Ok(steps)
}

/// Every published crate must build without its default features, and with any one of its features; where the default ones choose the
/// standard library's math, with `libm` in their place.
fn feature_builds(published: &[&Package]) -> Vec<Step> {
    published
        .iter()
        .filter(|p| p.features.contains_key("default"))
        .map(|p| {
            let package = p.name.to_string();
            let math = if p.features.contains_key("libm") { "libm" } else { "" };
            // None, then each alone; the source of math once, with none.
            let alone = p.features.keys().filter(|f| !["default", "libm"].contains(&f.as_str()));
            let sets: Vec<_> = core::iter::once(math.to_owned())
                .chain(alone.map(|f| if f == "std" { f.clone() } else { format!("{f},{math}") }))
                .collect();
            Step::new(format!("no default features: {package}"), "guard what needs the feature", move || {
                for set in &sets {
                    let args = ["clippy", "--release", "--quiet", "--no-default-features", "-p", &package];
                    let features = ["--features", set, "--", "-D", "warnings"];
                    if let End::Failed(why) = cargo(&[&args[..], &features].concat()) {
                        return End::Failed(format!("features `{set}`: {why}"));
                    }
                }
                End::Passed
            })
        })
        .collect()
}

/// The crates that promise `no_std` are those with a `libm` feature: they must build for a target that has no standard
/// library at all.
fn no_std(published: &[&Package]) -> Step {
    const TARGET: &str = "thumbv7em-none-eabihf";
    let packages: Vec<_> =
        published.iter().filter(|p| p.features.contains_key("libm")).map(|p| p.name.to_string()).collect();
    Step::new("no_std", "use core and libm only", move || {
        if packages.is_empty() {
            return End::Skipped("no package has a `libm` feature".into());
        }
        if !setup::rustup_has(TARGET) {
            return End::Skipped(format!("run `rustup target add {TARGET}` for this step"));
        }
        for package in &packages {
            let end = cargo(&[
                "check",
                "--release",
                "--quiet",
                "--no-default-features",
                "--features",
                "libm",
                "--target",
                TARGET,
                "-p",
                package,
            ]);
            if !matches!(end, End::Passed) {
                return end;
            }
        }
        End::Passed
    })
}

/// Every published crate, built from its package, crates before those that need them: no file outside its folder is needed.
fn package(published: &[&Package]) -> Step {
    let names: Vec<_> = published.iter().map(|p| p.name.to_string()).collect();
    Step::new(
        "package",
        "a file outside the crate's folder is used, or a manifest field is missing",
        move || {
            let mut args = vec!["package", "--quiet", "--allow-dirty"];
            for name in &names {
                args.extend(["-p", name]);
            }
            cargo(&args)
        },
    )
}

/// What packages hold, as a stranger gets them: unpacked side by side, they build with all features and the oldest `glam` that they
/// accept, and so do the tests, benches and examples of those that need nothing unpublished for them.
fn unpacked(published: &[&Package]) -> Step {
    let packages: Vec<_> = published.iter().map(|p| format!("{}-{}", p.name, p.version)).collect();
    let alone = |p: &&&Package| {
        p.dependencies
            .iter()
            .all(|d| d.kind != DependencyKind::Development || d.path.is_none() || d.req != VersionReq::STAR)
    };
    let complete: Vec<_> = published.iter().filter(alone).map(|p| p.name.to_string()).collect();
    Step::new("unpacked packages", "what a package carries must build from it: see `exclude`", move || {
        let found = packages::unpack(&packages).and_then(|workspace| {
            let run = |args: &[&str]| match cargo_in(&workspace, args) {
                End::Failed(why) => Err(Failure::Check(why)),
                _ => Ok(()),
            };
            run(&["update", "--quiet", "--package", "glam", "--precise", packages::OLDEST_GLAM])?;
            run(&["check", "--quiet", "--release", "--workspace", "--all-features"])?;
            // Their tests are written against the newest one.
            run(&["update", "--quiet", "--package", "glam"])?;
            let mut args = vec!["check", "--quiet", "--release", "--all-targets", "--all-features"];
            args.extend(complete.iter().flat_map(|name| ["-p", name]));
            run(&args)
        });
        own(found)
    })
}

/// [`cargo`] for a workspace elsewhere that shares what was built of dependencies.
fn cargo_in(workspace: &Path, args: &[&str]) -> End {
    let mut command = cargo_command(args);
    command.current_dir(workspace).env("CARGO_TARGET_DIR", crate::target());
    status(command)
}

/// An external tool, skipped where it is not installed.
fn tool(name: &'static str, args: &'static [&'static str], hint: &'static str) -> Step {
    Step::new(name, hint, move || {
        if Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err() {
            return End::Skipped(format!(
                "{name} is not installed: cargo install --locked {}",
                match name {
                    "typos" => "typos-cli",
                    other => other,
                }
            ));
        }
        let mut command = Command::new(name);
        command.args(args).current_dir(crate::root());
        status(command)
    })
}

fn own(outcome: Outcome) -> End {
    match outcome {
        Ok(()) => End::Passed,
        Err(f) => End::Failed(f.line()),
    }
}

/// [`own`] of a step that a machine without an adapter skips.
fn without_adapter(outcome: Outcome) -> End {
    match outcome {
        Err(Failure::Check(why)) if why.starts_with(setup::NO_ADAPTER) && !setup::gpu_required() => {
            End::Skipped(setup::NO_ADAPTER.to_owned())
        }
        outcome => own(outcome),
    }
}

fn cargo(args: &[&str]) -> End {
    status(cargo_command(args))
}

fn cargo_command(args: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(args).current_dir(crate::root());
    command
}

fn status(mut command: Command) -> End {
    match command.status() {
        Ok(s) if s.success() => End::Passed,
        Ok(s) => End::Failed(format!("{} ended with {s}", command.get_program().display())),
        Err(e) => End::Failed(format!("{}: {e}", command.get_program().display())),
    }
}

/// Runs all tests and sums up what each test binary reports.
fn tests() -> End {
    let mut command =
        cargo_command(&["test", "--workspace", "--all-features", "--release", "--no-fail-fast"]);
    let mut child = match command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn() {
        Ok(child) => child,
        Err(e) => return End::Failed(format!("cargo: {e}")),
    };
    // Tests without an adapter say so on stderr and end as passed, which they are not.
    let skipped = child.stderr.take().map(|err| {
        std::thread::spawn(move || {
            let lines = BufReader::new(err).lines().map_while(Result::ok);
            lines.inspect(|line| tell(line)).filter(|line| line.starts_with("SKIPPED ")).count()
        })
    });
    let mut counts = [0; 3];
    if let Some(out) = child.stdout.take() {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            say(&line);
            if let Some(found) = test_result(&line) {
                counts.iter_mut().zip(found).for_each(|(sum, n)| *sum += n);
            }
        }
    }
    let skipped = skipped.and_then(|thread| thread.join().ok()).unwrap_or(0).min(counts[0]);
    counts[0] -= skipped;
    counts[2] += skipped;
    match child.wait() {
        Ok(s) if s.success() && counts[0] > 0 => End::Tests(counts),
        Ok(s) if s.success() => End::Failed("no test ran".into()),
        // A build that fails has no counts.
        Ok(s) if counts[1] == 0 => End::Failed(format!("cargo test ended with {s}")),
        Ok(_) => End::TestsFailed(counts),
        Err(e) => End::Failed(format!("cargo: {e}")),
    }
}

/// One line to stderr, as it came.
fn tell(line: &str) {
    // Nobody is left to tell where standard error is closed.
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Passed, failed and ignored of a line `test result: ok. 3 passed; 0 failed; 1 ignored; …`.
fn test_result(line: &str) -> Option<[usize; 3]> {
    let counts = line.strip_prefix("test result: ")?.split_once(". ")?.1;
    let number = |what: &str| {
        counts.split("; ").find_map(|part| part.trim().strip_suffix(what)?.trim().parse::<usize>().ok())
    };
    Some([number("passed")?, number("failed")?, number("ignored")?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_results_are_read() {
        let line = "test result: FAILED. 12 passed; 3 failed; 4 ignored; 0 measured; 0 filtered out; finished in 0.07s";
        assert_eq!(test_result(line), Some([12, 3, 4]));
        assert_eq!(test_result("test result: ok."), None);
        assert_eq!(test_result("running 3 tests"), None);
    }
}
