//! What the commands print.

use std::fmt::Display;
use std::io::Write;

/// One line to stdout. A reader that has gone away is no error.
pub(crate) fn say(text: impl Display) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// One line `warning: …` to stderr.
pub(crate) fn warn(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}
