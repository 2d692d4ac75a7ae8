//! Settings of a technique as the command line gives them.

use std::fmt::Write;

use indirect_core::SceneProfile;
use indirect_core::settings::{BadOption, Key, Settings, Value};
use indirect_technique::Technique;
use serde_json::{Map, Number, Value as Json};

use crate::failure::{Failure, Outcome};

/// `KEY=VALUE` pairs, each checked against the table of the technique that they belong to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Values(Vec<(String, String)>);

impl Values {
    /// Pairs for a technique without settings.
    pub(crate) fn none<S: AsRef<str>>(name: &str, pairs: &[S]) -> Outcome<Self> {
        match pairs.first() {
            None => Ok(Self::default()),
            Some(pair) => {
                Err(Failure::Input(format!("--set {}: {name} has no settings to set", pair.as_ref())))
            }
        }
    }

    /// Pairs for `T`.
    pub(crate) fn parse<T: Technique, S: AsRef<str>>(pairs: &[S]) -> Outcome<Self> {
        let mut values = Self::default();
        for pair in pairs.iter().map(AsRef::as_ref) {
            let bad = |why: String| Failure::Input(format!("--set {pair}: {why}"));
            let (key, value) = pair.split_once('=').ok_or_else(|| bad("must be KEY=VALUE".into()))?;
            values.0.push((key.trim().to_owned(), value.trim().to_owned()));
            values.settings::<T>(&SceneProfile::default()).map_err(bad)?;
        }
        let (options, params) = values.settings::<T>(&SceneProfile::default()).map_err(Failure::Input)?;
        options
            .validate()
            .and_then(|()| params.validate())
            .map_err(|e| Failure::Input(format!("--set: {e}")))?;
        Ok(values)
    }

    /// The settings that a scene of this kind is given, changed by the pairs.
    pub(crate) fn settings<T: Technique>(
        &self,
        profile: &SceneProfile,
    ) -> Result<(T::Options, T::Params), String> {
        let (mut options, mut params) = T::for_scene(profile);
        let say = |e: BadOption| e.to_string();
        for (key, value) in &self.0 {
            if T::Params::key(key).is_some() {
                params.set(key, value).map_err(say)?;
            } else if T::Options::key(key).is_some() {
                options.set(key, value).map_err(say)?;
            } else {
                let names: Vec<_> = keys::<T>().map(spelled).collect();
                return Err(format!(
                    "unknown key `{key}`; the keys of {} are: {}",
                    T::NAME,
                    names.join(", ")
                ));
            }
        }
        Ok((options, params))
    }

    /// All settings for JSON, numbers as numbers.
    pub(crate) fn json<T: Technique>(&self, profile: &SceneProfile) -> Result<Map<String, Json>, String> {
        let (options, params) = self.settings::<T>(profile)?;
        let value = |key: &Key| match options.get(key.name).or_else(|| params.get(key.name)) {
            Some(Value::Int(v)) => v.into(),
            // By its decimals: 0.1 is not 0.10000000149011612.
            Some(Value::Number(v)) => v.to_string().parse::<Number>().map_or(Json::Null, Json::Number),
            // A word that is a number is one.
            Some(Value::Word(v)) => v.parse::<u32>().map_or_else(|_| v.into(), Json::from),
            None => Json::Null,
        };
        Ok(keys::<T>().map(|key| (spelled(key), value(key))).collect())
    }
}

/// All settings of a technique.
pub(crate) fn keys<T: Technique>() -> impl Iterator<Item = &'static Key> {
    T::Options::KEYS.iter().chain(T::Params::KEYS)
}

/// A key as the command line writes it.
pub(crate) fn spelled(key: &Key) -> String {
    key.name.replace('_', "-")
}

/// The table of `--list`.
pub(crate) fn table<T: Technique>() -> String {
    const WIDTH: usize = 100;
    let mut out = String::new();
    for key in keys::<T>() {
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "    {:<16} default {:<12} range {}",
            spelled(key),
            key.default.to_string(),
            key.kind
        );
        let mut line = String::new();
        for word in plain(key.doc).split_whitespace() {
            if line.len() + word.len() > WIDTH {
                let _ = writeln!(out, "       {line}");
                line.clear();
            }
            line += " ";
            line += word;
        }
        let _ = writeln!(out, "       {line}");
    }
    out
}

/// Documentation without what rustdoc alone reads: link brackets, their targets, ticks.
fn plain(doc: &str) -> String {
    let mut text = String::new();
    let mut rest = doc;
    while let Some(open) = rest.find("](") {
        let (before, after) = rest.split_at(open);
        text += before;
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    text += rest;
    text.replace(['`', '[', ']'], "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rsm_gather::RsmGather;

    #[test]
    fn pairs_change_the_defaults_within_their_range() {
        let profile = SceneProfile::default();
        let values = Values::parse::<RsmGather, _>(&["vpls=12", " select = grid", "seed=7"]).unwrap();
        let (options, params) = values.settings::<RsmGather>(&profile).unwrap();
        assert_eq!((options.vpls, options.select.word(), params.seed), (12, "grid", 7));
        let json = values.json::<RsmGather>(&profile).unwrap();
        assert_eq!((&json["vpls"], &json["select"]), (&Json::from(12), &Json::from("grid")));
        let error = |pair: &str| Values::parse::<RsmGather, _>(&[pair]).unwrap_err().line();
        assert_eq!(error("vpls=0"), "--set vpls=0: vpls is 0, it must be in 1..=16777216");
        assert_eq!(error("form=x"), "--set form=x: form is x, it must be one of disc|point");
        assert_eq!(
            error("x=1"),
            "--set x=1: unknown key `x`; the keys of rsm-gather are: resolution, select, vpls, cells, form, seed"
        );
        assert_eq!(error("vpls"), "--set vpls: must be KEY=VALUE");
        assert!(
            Values::none("reference", &["x=1"]).is_err() && Values::none::<&str>("reference", &[]).is_ok()
        );
    }

    #[test]
    fn documentation_reads_as_text() {
        assert_eq!(plain("As [`A::b`] and [the page](crate::x), `1..`."), "As A::b and the page, 1...");
    }
}
