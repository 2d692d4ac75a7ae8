//! Warnings, one line per kind however many elements it concerns.

use std::collections::BTreeMap;

/// Collects warnings: the number of elements per message, and the first of them by name.
#[derive(Default)]
pub(super) struct Warnings(BTreeMap<String, (usize, String)>);

impl Warnings {
    /// Notes that `message` holds for `element`.
    pub(super) fn add(&mut self, message: impl Into<String>, element: impl Into<String>) {
        self.0.entry(message.into()).or_insert_with(|| (0, element.into())).0 += 1;
    }

    /// One line per message, in a stable order.
    pub(super) fn into_lines(self) -> Vec<String> {
        let line = |(message, (count, first)): (String, (usize, String))| match (count, first.is_empty()) {
            (_, true) => message,
            (1, _) => format!("{first}: {message}"),
            _ => format!("{first} and {} more: {message}", count - 1),
        };
        self.0.into_iter().map(line).collect()
    }
}
