//! Looks for a Vulkan driver and installs the software one where that is possible.

use std::process::{Command, Stdio};

use indirect_gpu::Context;

use crate::{progress, say};

/// Said wherever the GPU is left out.
pub(crate) const NO_ADAPTER: &str = "no GPU adapter";

/// The one line that brings a software adapter to a Debian-like system.
pub(crate) const INSTALL: &str = "sudo apt-get install -y mesa-vulkan-drivers";

/// Whether the environment demands a GPU (`INDIRECT_REQUIRE_GPU=1`).
pub(crate) fn gpu_required() -> bool {
    std::env::var_os("INDIRECT_REQUIRE_GPU").is_some_and(|v| v == "1")
}

/// Makes sure that there is an adapter: where there is none and this is root on a system with apt, installs Mesa's
/// software driver; elsewhere says how to get it. Everything goes on without it.
pub(crate) fn vulkan_driver() {
    if !Context::adapters().is_empty() {
        return;
    }
    if may_install() {
        let bar = progress::spinner("installing the software Vulkan driver");
        let done =
            apt(&["update"]) && apt(&["install", "-y", "--no-install-recommends", "mesa-vulkan-drivers"]);
        bar.finish_and_clear();
        if done && !Context::adapters().is_empty() {
            say("installed mesa-vulkan-drivers, a Vulkan driver in software");
            return;
        }
    }
    say(format!("{NO_ADAPTER}: only the CPU is used. For a driver in software: {INSTALL}"));
}

fn may_install() -> bool {
    let quiet = |name: &str, args: &[&str]| {
        Command::new(name).args(args).stdin(Stdio::null()).stderr(Stdio::null()).output().ok()
    };
    cfg!(target_os = "linux")
        && quiet("id", &["-u"]).is_some_and(|o| o.stdout.trim_ascii() == b"0")
        && quiet("apt-get", &["--version"]).is_some_and(|o| o.status.success())
}

fn apt(args: &[&str]) -> bool {
    Command::new("apt-get")
        .args(args)
        .env("DEBIAN_FRONTEND", "noninteractive")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

/// Whether the toolchain has a target; adds it where that can be done.
pub(crate) fn rustup_has(target: &str) -> bool {
    let installed = || {
        let out = Command::new("rustup").args(["target", "list", "--installed"]).output().ok()?;
        Some(String::from_utf8_lossy(&out.stdout).lines().any(|l| l == target))
    };
    installed().unwrap_or(false)
        || Command::new("rustup")
            .args(["target", "add", target])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
}
