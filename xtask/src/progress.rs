//! What a person sees while work goes on: a bar on a terminal, nothing in a pipe.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A spinner with a message, on stderr, visible on a terminal only.
pub(crate) fn spinner(message: impl Into<String>) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(message.into());
    bar.set_style(style("{spinner} [{elapsed}] {msg}"));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// A bar of `steps`, on stderr, visible on a terminal only.
pub(crate) fn bar(steps: u64, message: impl Into<String>) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_message(message.into());
    bar.set_style(style("[{elapsed}] {wide_bar} {pos}/{len} {msg}"));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn style(template: &str) -> ProgressStyle {
    // Both templates above are valid; a plain bar is a fair fallback for one that is not.
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
