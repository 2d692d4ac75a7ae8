//! The harness: composes the crates of the workspace, holds techniques against the truth and their twins, and reports.

mod accuracy;
mod bake;
mod bench_peers;
mod ci;
mod cli;
mod console;
mod diagrams;
mod doctor;
mod failure;
mod fixtures;
mod gpu;
mod layers;
mod loc;
mod measure;
mod packages;
mod page;
mod paths;
mod progress;
mod render;
mod report;
mod setup;
mod stage;
mod sweep;
mod technique;
mod temporal;
mod validate;
mod web;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use cli::{Cli, Command};
use failure::{Failure, Outcome};

pub(crate) use console::{say, warn};
pub(crate) use paths::{root, target};

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) if matches!(e.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            say(e.to_string().trim_end());
            return ExitCode::SUCCESS;
        }
        Err(e) if e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            say(e.to_string().trim_end());
            return ExitCode::from(2);
        }
        // clap's first paragraph says what is wrong; usage and tips follow.
        Err(e) => {
            let text = e.to_string();
            let first = text.split("\n\n").next().unwrap_or(&text);
            return fail(&Failure::Input(first.trim_start_matches("error: ").to_owned()));
        }
    };
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => fail(&failure),
    }
}

fn run(cli: &Cli) -> Outcome {
    if cli.list {
        say(technique::list());
        return Ok(());
    }
    match &cli.command {
        Some(Command::Report(args)) => report::run(args),
        Some(Command::Render(args)) => render::run(args),
        Some(Command::Bake(args)) => bake::run(args),
        Some(Command::Validate(args)) => validate::run(args),
        Some(Command::Sweep(args)) => sweep::run(args),
        Some(Command::Temporal(args)) => temporal::run(args),
        Some(Command::Test(args)) => ci::run(args),
        Some(Command::Fixtures(args)) => fixtures::run(args),
        Some(Command::Doctor) => doctor::run(),
        Some(Command::Accuracy) => failure::write(&root().join("docs/accuracy.md"), accuracy::run()),
        Some(Command::BenchPeers(args)) => bench_peers::run(args),
        Some(Command::CheckLayers) => layers::run(),
        Some(Command::Diagrams(args)) => diagrams::run(args.check),
        Some(Command::Loc) => loc::run(),
        Some(Command::Web(args)) => web::run(args),
        // clap shows the help where there is neither a command nor --list.
        None => Ok(()),
    }
}

fn fail(failure: &Failure) -> ExitCode {
    // Nowhere to report a failure to write a failure.
    let _ = writeln!(std::io::stderr(), "error: {}", failure.line());
    ExitCode::from(failure.exit_code())
}
