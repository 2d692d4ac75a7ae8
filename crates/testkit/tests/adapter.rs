//! Without an adapter a GPU test is skipped where all can see it, or fails where one is demanded.

use std::process::Command;

use indirect_gpu::ADAPTER_VARIABLE;
use testkit::REQUIRE_GPU_VARIABLE;

#[test]
fn a_gpu_test() {
    let Some(gpu) = testkit::gpu() else { return };
    assert!(gpu.describe().contains(&gpu.info.name));
}

/// Runs `a_gpu_test` in a process of its own: whether it passed, and all it printed.
fn run(variables: &[(&str, &str)]) -> (bool, String) {
    let mut command = Command::new(std::env::current_exe().expect("a test has a path"));
    command.args(["--exact", "a_gpu_test"]).env_remove(REQUIRE_GPU_VARIABLE).env_remove(ADAPTER_VARIABLE);
    let output = command.envs(variables.iter().copied()).output().expect("a test can run itself");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    (output.status.success(), text.into_owned())
}

/// Hides every driver from the Vulkan loader, under its new and its old name of the variable. Other systems have other
/// backends, which cannot be hidden.
#[cfg(target_os = "linux")]
#[test]
fn no_adapter_is_a_visible_skip_or_a_failure() {
    let hidden = [("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")];
    let (passed, text) = run(&hidden);
    assert!(passed && text.contains("SKIPPED a_gpu_test: no GPU adapter"), "{text}");
    let (passed, text) = run(&[hidden[0], hidden[1], (REQUIRE_GPU_VARIABLE, "1")]);
    assert!(!passed && text.contains("INDIRECT_REQUIRE_GPU=1, but no GPU adapter"), "{text}");
}

#[test]
fn a_named_adapter_must_exist() {
    let (passed, text) = run(&[(ADAPTER_VARIABLE, "an adapter that nobody has")]);
    assert!(!passed && text.contains("no GPU adapter named"), "{text}");
}
