use std::io::Write;
use std::sync::OnceLock;

use indirect_gpu::{AdapterChoice, Context};

/// Environment variable that turns a skipped GPU test into a failure when it is `1`.
pub const REQUIRE_GPU_VARIABLE: &str = "INDIRECT_REQUIRE_GPU";

/// The device that the tests of one process share: a software adapter unless `INDIRECT_ADAPTER` names another.
///
/// Prints the adapter once. Where the machine has no adapter it prints `SKIPPED` and the test's name, past the test
/// harness's capture, and returns `None`: `let Some(gpu) = testkit::gpu() else { return };`.
///
/// # Panics
/// Where there is no adapter and `INDIRECT_REQUIRE_GPU=1`, or `INDIRECT_ADAPTER` names one that there is not.
#[must_use]
pub fn gpu() -> Option<&'static Context> {
    static CONTEXT: OnceLock<Result<Context, String>> = OnceLock::new();
    let choice = AdapterChoice::from_env();
    let context = CONTEXT.get_or_init(|| {
        let context = Context::new(&choice).map_err(|e| e.to_string());
        if let Ok(context) = &context {
            say(&format!("GPU tests run on {}", context.describe()));
        }
        context
    });
    match context {
        Ok(context) => Some(context),
        Err(reason) => {
            let required = std::env::var(REQUIRE_GPU_VARIABLE).is_ok_and(|v| v == "1");
            assert!(!required, "{REQUIRE_GPU_VARIABLE}=1, but {reason}");
            assert!(!matches!(choice, AdapterChoice::Named(_)), "{reason}");
            let thread = std::thread::current();
            say(&format!("SKIPPED {}: {reason}", thread.name().unwrap_or("a GPU test")));
            None
        }
    }
}

/// The print macros are captured for tests that pass; the stream itself is not.
fn say(line: &str) {
    let mut stderr = std::io::stderr().lock();
    // Nothing is left to tell it to when standard error is closed.
    let _ = writeln!(stderr, "{line}");
}
