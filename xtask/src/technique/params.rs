//! Parameters of techniques: declared once, parsed, checked and printed alike.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Map, Value, json};

use crate::failure::{Failure, Outcome};

/// What values a parameter takes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    /// A whole number within a range.
    Int { min: u32, max: u32 },
    /// A number within a range.
    Number { min: f32, max: f32 },
    /// One of some words.
    Choice(&'static [&'static str]),
}

/// A parameter that `--set KEY=VALUE` changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Param {
    pub(crate) key: &'static str,
    pub(crate) default: &'static str,
    pub(crate) kind: Kind,
    /// What it is, and what a higher value does.
    pub(crate) doc: &'static str,
}

impl Param {
    /// The values that it takes, in words.
    pub(crate) fn range(&self) -> String {
        match self.kind {
            Kind::Int { min, max } => format!("{min}..={max}"),
            Kind::Number { min, max } => format!("{min}..={max}"),
            Kind::Choice(words) => words.join("|"),
        }
    }

    fn accepts(&self, value: &str) -> bool {
        match self.kind {
            Kind::Int { min, max } => value.parse().is_ok_and(|v: u32| (min..=max).contains(&v)),
            // False for NaN.
            Kind::Number { min, max } => value.parse().is_ok_and(|v: f32| (min..=max).contains(&v)),
            Kind::Choice(words) => words.contains(&value),
        }
    }
}

/// A value for every parameter of one technique.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Values(BTreeMap<&'static str, String>);

impl Values {
    /// The defaults, changed by `KEY=VALUE` pairs.
    pub(crate) fn parse<S: AsRef<str>>(technique: &str, params: &[Param], pairs: &[S]) -> Outcome<Self> {
        let mut values: BTreeMap<_, _> = params.iter().map(|p| (p.key, p.default.to_owned())).collect();
        for pair in pairs.iter().map(AsRef::as_ref) {
            let bad = |why: String| Failure::Input(format!("--set {pair}: {why}"));
            let (key, value) = pair.split_once('=').ok_or_else(|| bad("must be KEY=VALUE".into()))?;
            let (key, value) = (key.trim(), value.trim());
            let param = params.iter().find(|p| p.key == key).ok_or_else(|| {
                let known: Vec<_> = params.iter().map(|p| p.key).collect();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                bad(format!("unknown key `{key}`; the keys of {technique} are: {known}"))
            })?;
            if !param.accepts(value) {
                return Err(bad(format!("`{value}` is not in the range {}", param.range())));
            }
            values.insert(param.key, value.to_owned());
        }
        Ok(Self(values))
    }

    /// A number; 0 for a key that is no number, which only a technique that asks for another's key can see.
    pub(crate) fn int(&self, key: &str) -> u32 {
        self.word(key).parse().unwrap_or(0)
    }

    /// A number that need not be whole; 0 as for [`Self::int`].
    pub(crate) fn number(&self, key: &str) -> f32 {
        self.word(key).parse().unwrap_or(0.0)
    }

    pub(crate) fn word(&self, key: &str) -> &str {
        self.0.get(key).map_or("", String::as_str)
    }

    /// For JSON: numbers as numbers.
    pub(crate) fn json(&self) -> Map<String, Value> {
        let number = |v: &String| v.parse::<f64>().map_or_else(|_| json!(v), |n| json!(n));
        let value = |v: &String| v.parse::<u32>().map_or_else(|_| number(v), |n| json!(n));
        self.0.iter().map(|(k, v)| ((*k).to_owned(), value(v))).collect()
    }
}

/// The parameters as aligned text, indented.
pub(crate) fn table(params: &[Param]) -> String {
    let mut out = String::new();
    for p in params {
        // Writing to a String cannot fail.
        let _ =
            writeln!(out, "    {:<12} default {:<12} range {:<22} {}", p.key, p.default, p.range(), p.doc);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: [Param; 3] = [
        Param { key: "count", default: "8", kind: Kind::Int { min: 1, max: 16 }, doc: "" },
        Param { key: "mode", default: "a", kind: Kind::Choice(&["a", "b"]), doc: "" },
        Param { key: "tau", default: "0.5", kind: Kind::Number { min: 0.0, max: 1.0 }, doc: "" },
    ];

    #[test]
    fn defaults_are_changed_within_their_range() {
        let v = Values::parse("t", &PARAMS, &["count=12"]).unwrap();
        assert_eq!((v.int("count"), v.word("mode")), (12, "a"));
        assert_eq!(Value::from(v.json()).to_string(), r#"{"count":12,"mode":"a","tau":0.5}"#);
        let error = |pair: &str| Values::parse("t", &PARAMS, &[pair]).unwrap_err().line();
        assert_eq!(error("count=17"), "--set count=17: `17` is not in the range 1..=16");
        assert_eq!(error("count=-1"), "--set count=-1: `-1` is not in the range 1..=16");
        assert_eq!(error("mode=c"), "--set mode=c: `c` is not in the range a|b");
        assert_eq!(error("x=1"), "--set x=1: unknown key `x`; the keys of t are: count, mode, tau");
        assert_eq!(error("tau=nan"), "--set tau=nan: `nan` is not in the range 0..=1");
        assert_eq!(Values::parse("t", &PARAMS, &["tau=1e-3"]).unwrap().number("tau"), 1e-3);
        assert_eq!(error("count"), "--set count: must be KEY=VALUE");
    }
}
