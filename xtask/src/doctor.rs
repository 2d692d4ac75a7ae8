//! `doctor`: what this machine has, what is missing and how to get it.

use std::process::{Command, Stdio};

use indirect_gpu::{
    Context,
    wgpu::{Features, Limits},
};

use crate::failure::Outcome;
use crate::{gpu, say, setup};

pub(crate) fn run() -> Outcome {
    say(format!(
        "system     {} {}, {} threads, {}",
        std::env::consts::OS,
        std::env::consts::ARCH,
        threads(),
        cpu()
    ));
    for (name, args, get) in [
        ("rustc", ["--version"], "https://rustup.rs"),
        ("cargo", ["--version"], "https://rustup.rs"),
        ("typos", ["--version"], "cargo install --locked typos-cli (spell check of `test`)"),
        ("cargo-deny", ["--version"], "cargo install --locked cargo-deny (licence check of `test`)"),
        ("python3", ["--version"], "apt-get install python3 python3-venv (peers of `bench-peers`)"),
    ] {
        match version(name, &args) {
            Some(v) => say(format!("{name:<10} {v}")),
            None => say(format!("{name:<10} missing: {get}")),
        }
    }
    let adapters = Context::adapters();
    for info in &adapters {
        say(format!(
            "adapter    {} ({:?}, {:?}, {} {})",
            info.name, info.device_type, info.backend, info.driver, info.driver_info
        ));
    }
    if adapters.is_empty() {
        say(format!("adapter    missing: {}", setup::INSTALL));
        say("           without one every command works on the CPU, and GPU tests are skipped");
        return Ok(());
    }
    match gpu::Device::open(&Limits::default()) {
        Ok(gpu::Device { context, .. }) => {
            let features = context.device.features();
            let has = |f| if features.contains(f) { "yes" } else { "no" };
            say(format!(
                "chosen     {} (INDIRECT_ADAPTER=any or a part of a name chooses another)",
                context.info.name
            ));
            say(format!(
                "timestamps {} (without them passes are timed by the wall clock)",
                has(Features::TIMESTAMP_QUERY)
            ));
            let limits = context.device.limits();
            say(format!(
                "limits     storage binding {}, buffer {}",
                crate::page::bytes(limits.max_storage_buffer_binding_size),
                crate::page::bytes(limits.max_buffer_size)
            ));
        }
        Err(f) => say(format!("chosen     none: {}", f.line())),
    }
    Ok(())
}

fn version(name: &str, args: &[&str]) -> Option<String> {
    let out = Command::new(name).args(args).stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Number of hardware threads.
pub(crate) fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Name of the processor, where the system tells.
pub(crate) fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| "unknown processor".to_owned(), |(_, name)| name.trim().to_owned())
}
