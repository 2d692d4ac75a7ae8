//! Settings that are declared once: [`settings!`](macro@crate::settings) makes the struct with its documentation, its default, the check
//! of its ranges and the table from which a command line lists and parses it; [`choice!`](crate::choice) makes an enum with words.
//!
//! ```
//! use indirect_core::settings::{Kind, Settings, Value};
//!
//! indirect_core::choice! {
//!     /// Where a pixel looks.
//!     pub enum Scale {
//!         /// At every pixel.
//!         #[default]
//!         Full = "full",
//!         /// At one of 2 × 2.
//!         Half = "half",
//!     }
//! }
//!
//! indirect_core::settings! {
//!     /// What is fixed when the technique is made.
//!     pub struct Options {
//!         /// Samples per probe. Higher: less noise.
//!         pub bounce_samples: u32 = 32, 1..=1024;
//!         /// How far a probe looks, as a share of the diagonal.
//!         pub range: f32 = 1.0, 0.01..=1.0;
//!         /// Resolution at which pixels read the field.
//!         pub scale: Scale = Scale::Full;
//!     }
//! }
//!
//! // A method for each setting: code that is written so goes on compiling when settings are added.
//! let mut options = Options::default().range(0.5);
//! assert_eq!(options, Options { range: 0.5, ..Options::default() });
//! options.set("bounce-samples", "64")?;
//! options.set("scale", "half")?;
//! assert_eq!((options.bounce_samples, options.scale), (64, Scale::Half));
//! assert_eq!(options.get("range"), Some(Value::Number(0.5)));
//! assert_eq!(Options::KEYS[0].kind, Kind::Int { min: 1, max: 1024 });
//! let error = options.set("range", "2").unwrap_err();
//! assert_eq!(error.to_string(), "range is 2, it must be in 0.01..=1");
//! options.range = 7.0;
//! assert!(options.validate().is_err() && options.set("radius", "1").is_err());
//! # Ok::<(), indirect_core::settings::BadOption>(())
//! ```

use core::fmt;
use core::ops::RangeInclusive;

use thiserror::Error;

/// A setting is outside its range, or there is no such setting.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{option} is {value}, it must be {requirement}")]
pub struct BadOption {
    /// Name of the setting.
    pub option: String,
    /// The value, printed.
    pub value: String,
    /// What it must be.
    pub requirement: String,
}

impl BadOption {
    /// An error from its parts.
    #[must_use]
    pub fn new(option: &str, value: impl fmt::Display, requirement: impl fmt::Display) -> Self {
        Self { option: option.to_owned(), value: value.to_string(), requirement: requirement.to_string() }
    }
}

/// What values a setting takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number within a range, its ends included.
    Int {
        /// Least.
        min: u32,
        /// Greatest.
        max: u32,
    },
    /// A finite number within a range, its ends included.
    Number {
        /// Least.
        min: f32,
        /// Greatest.
        max: f32,
    },
    /// One of some words.
    Choice(&'static [&'static str]),
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int { min, max } => write!(f, "{min}..={max}"),
            Self::Number { min, max } => write!(f, "{min}..={max}"),
            Self::Choice(words) => f.write_str(&words.join("|")),
        }
    }
}

/// The value of a setting, whatever its type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A whole number.
    Int(u32),
    /// A number.
    Number(f32),
    /// A word.
    Word(&'static str),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int(v) => write!(f, "{v}"),
            Self::Number(v) => write!(f, "{v}"),
            Self::Word(v) => f.write_str(v),
        }
    }
}

/// One row of the table of a [`Settings`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Name, as the field's; a command line writes hyphens for underscores.
    pub name: &'static str,
    /// The field's documentation.
    pub doc: &'static str,
    /// What values it takes.
    pub kind: Kind,
    /// Its value in [`Default`].
    pub default: Value,
}

/// A struct that [`settings!`](macro@crate::settings) declared.
pub trait Settings: Default + Clone + fmt::Debug {
    /// All settings, in the order of the fields.
    const KEYS: &'static [Key];

    /// The value of a setting; `None` where there is none of that name.
    fn get(&self, name: &str) -> Option<Value>;

    /// Parses and sets a value. Hyphens in the name count as underscores.
    ///
    /// # Errors
    /// [`BadOption`] for an unknown name, and for a value that is not of the setting's [`Kind`]. Relations between settings are
    /// left to [`Settings::validate`].
    fn set(&mut self, name: &str, text: &str) -> Result<(), BadOption>;

    /// Checks all ranges, and what the declaration names besides.
    ///
    /// # Errors
    /// The first [`BadOption`].
    fn validate(&self) -> Result<(), BadOption>;

    /// The row of that name; hyphens count as underscores.
    #[must_use]
    fn key(name: &str) -> Option<&'static Key> {
        let matches =
            |key: &&Key| key.name.bytes().eq(name.bytes().map(|b| if b == b'-' { b'_' } else { b }));
        Self::KEYS.iter().find(matches)
    }
}

/// A type that a setting can have.
pub trait Setting: Copy {
    /// How a declaration states the range: a range for numbers, nothing for choices.
    type Limits;
    /// The value, whatever its type.
    fn value(self) -> Value;
    /// Reads a value; `None` for what is not of this type.
    fn parse(text: &str) -> Option<Self>;
    /// Whether it lies in the range of the kind.
    fn is_in(self, kind: &Kind) -> bool;
}

/// The [`Kind`] and the erased default of a setting, as constants: what [`settings!`](macro@crate::settings) builds its table from.
#[doc(hidden)]
pub struct Row<T>(pub T);

impl Row<u32> {
    #[doc(hidden)]
    #[must_use]
    pub const fn key(self, name: &'static str, doc: &'static str, limits: RangeInclusive<u32>) -> Key {
        let kind = Kind::Int { min: *limits.start(), max: *limits.end() };
        Key { name, doc, kind, default: Value::Int(self.0) }
    }
}

impl Row<f32> {
    #[doc(hidden)]
    #[must_use]
    pub const fn key(self, name: &'static str, doc: &'static str, limits: RangeInclusive<f32>) -> Key {
        let kind = Kind::Number { min: *limits.start(), max: *limits.end() };
        Key { name, doc, kind, default: Value::Number(self.0) }
    }
}

impl Setting for u32 {
    type Limits = RangeInclusive<Self>;
    fn value(self) -> Value {
        Value::Int(self)
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
    fn is_in(self, kind: &Kind) -> bool {
        matches!(kind, Kind::Int { min, max } if (*min..=*max).contains(&self))
    }
}

impl Setting for f32 {
    type Limits = RangeInclusive<Self>;
    fn value(self) -> Value {
        Value::Number(self)
    }
    fn parse(text: &str) -> Option<Self> {
        text.parse().ok()
    }
    fn is_in(self, kind: &Kind) -> bool {
        // False for NaN.
        matches!(kind, Kind::Number { min, max } if (*min..=*max).contains(&self))
    }
}

/// Parses a setting and checks its range.
#[doc(hidden)]
pub fn parse<T: Setting>(key: &Key, text: &str) -> Result<T, BadOption> {
    let value = T::parse(text).filter(|v| v.is_in(&key.kind));
    value.ok_or_else(|| BadOption::new(key.name, text, requirement(&key.kind)))
}

/// Checks the range of a setting.
#[doc(hidden)]
pub fn check<T: Setting>(key: &Key, value: T) -> Result<(), BadOption> {
    if value.is_in(&key.kind) {
        return Ok(());
    }
    Err(BadOption::new(key.name, value.value(), requirement(&key.kind)))
}

fn requirement(kind: &Kind) -> String {
    match kind {
        Kind::Choice(_) => format!("one of {kind}"),
        Kind::Int { .. } | Kind::Number { .. } => format!("in {kind}"),
    }
}

/// The error for a name that is no setting.
#[doc(hidden)]
#[must_use]
pub fn unknown(name: &str, text: &str, keys: &[Key]) -> BadOption {
    let names: Vec<_> = keys.iter().map(|k| k.name.replace('_', "-")).collect();
    BadOption::new(name, text, format_args!("one of the settings {}", names.join(", ")))
}

/// Declares an enum whose variants have words: a [`Setting`] and a [`Default`], with `WORDS`, `word` and `ALL`.
#[macro_export]
macro_rules! choice {
    (
        $(#[$doc:meta])*
        $vis:vis enum $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $word:literal),+ $(,)? }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        $vis enum $name { $($(#[$variant_doc])* $variant),+ }

        impl $name {
            /// All variants.
            $vis const ALL: &'static [Self] = &[$(Self::$variant),+];
            /// Their words, in the same order.
            $vis const WORDS: &'static [&'static str] = &[$($word),+];

            /// The variant's word.
            #[must_use]
            $vis const fn word(self) -> &'static str {
                match self { $(Self::$variant => $word),+ }
            }

            #[doc(hidden)]
            #[must_use]
            $vis const fn key(self, name: &'static str, doc: &'static str) -> $crate::settings::Key {
                let kind = $crate::settings::Kind::Choice(Self::WORDS);
                $crate::settings::Key { name, doc, kind, default: $crate::settings::Value::Word(self.word()) }
            }
        }

        impl $crate::settings::Setting for $name {
            type Limits = ();
            fn value(self) -> $crate::settings::Value {
                $crate::settings::Value::Word(self.word())
            }
            fn parse(text: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|v| v.word() == text)
            }
            fn is_in(self, _: &$crate::settings::Kind) -> bool {
                true
            }
        }
    };
}

crate::choice! {
    /// Whether something is done.
    pub enum Switch {
        /// It is done.
        #[default]
        On = "on",
        /// It is not, and costs nothing.
        Off = "off",
    }
}

impl Switch {
    /// Whether it is on.
    #[must_use]
    pub const fn is_on(self) -> bool {
        matches!(self, Self::On)
    }
}

/// Declares a struct of settings: documentation, default and range of each field in one place. See the
/// [module](mod@crate::settings).
///
/// Numbers state their range after the default; choices have none. `where FUNCTION;` behind the last field names a function
/// `fn(&Self) -> Result<(), BadOption>` for relations between settings, which `validate` calls after the ranges.
#[macro_export]
macro_rules! settings {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident {
            $($(#[doc = $doc:literal])+ pub $field:ident: $ty:ty = $default:expr $(, $limits:expr)?;)*
            $(where $relations:expr;)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        $vis struct $name {
            $(
                $(#[doc = $doc])+
                $(#[doc = ""] #[doc = concat!("Range: `", stringify!($limits), "`.")])?
                #[doc = ""]
                #[doc = concat!("Default: `", stringify!($default), "`.")]
                pub $field: $ty,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        #[allow(dead_code, reason = "settings that are private to a crate may not need all of them")]
        impl $name {
            $(
                #[doc = concat!("These settings with another `", stringify!($field), "`, whose range `validate` checks.")]
                #[must_use]
                $vis const fn $field(mut self, $field: $ty) -> Self {
                    self.$field = $field;
                    self
                }
            )*
        }

        impl $crate::settings::Settings for $name {
            const KEYS: &'static [$crate::settings::Key] = &[$(
                $crate::setting_key!($ty, $default, stringify!($field), concat!($($doc),+) $(, $limits)?),
            )*];

            fn get(&self, name: &str) -> Option<$crate::settings::Value> {
                let _key = Self::key(name)?.name;
                $(if _key == stringify!($field) {
                    return Some($crate::settings::Setting::value(self.$field));
                })*
                None
            }

            fn set(&mut self, name: &str, text: &str) -> Result<(), $crate::settings::BadOption> {
                let Some(_key) = Self::key(name) else {
                    return Err($crate::settings::unknown(name, text, Self::KEYS));
                };
                $(if _key.name == stringify!($field) {
                    self.$field = $crate::settings::parse(_key, text)?;
                })*
                Ok(())
            }

            fn validate(&self) -> Result<(), $crate::settings::BadOption> {
                for _key in Self::KEYS {
                    $(if _key.name == stringify!($field) {
                        $crate::settings::check(_key, self.$field)?;
                    })*
                }
                $(let relations: fn(&Self) -> Result<(), $crate::settings::BadOption> = $relations;
                relations(self)?;)?
                Ok(())
            }
        }
    };
}

/// A row of the table of [`settings!`](crate::settings).
#[doc(hidden)]
#[macro_export]
macro_rules! setting_key {
    ($ty:ty, $default:expr, $name:expr, $doc:expr, $limits:expr) => {
        $crate::settings::Row::<$ty>($default).key($name, $doc, $limits)
    };
    ($ty:ty, $default:expr, $name:expr, $doc:expr) => {
        <$ty>::key($default, $name, $doc)
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::choice! {
        /// A word.
        enum Mode {
            /// First.
            #[default]
            First = "first",
            /// Second.
            Second = "second",
        }
    }

    crate::settings! {
        /// Some.
        struct Sample {
            /// A count.
            pub count: u32 = 8, 1..=16;
            /// A mode
            /// on two lines.
            pub some_mode: Mode = Mode::Second;
            /// A share.
            pub tau: f32 = 0.5, 0.0..=1.0;
            where |s| if s.count == 7 { Err(BadOption::new("count", 7, "no 7")) } else { Ok(()) };
        }
    }

    crate::settings! {
        /// None.
        struct Nothing {}
    }

    #[test]
    fn the_table_is_that_of_the_fields() {
        let names: Vec<_> =
            Sample::KEYS.iter().map(|k| (k.name, k.default.to_string(), k.kind.to_string())).collect();
        let expected =
            [("count", "8", "1..=16"), ("some_mode", "second", "first|second"), ("tau", "0.5", "0..=1")];
        assert!(names.iter().map(|(n, d, k)| (*n, d.as_str(), k.as_str())).eq(expected), "{names:?}");
        assert_eq!(Sample::KEYS[1].doc, " A mode on two lines.");
        let d = Sample::default();
        for key in Sample::KEYS {
            assert_eq!(d.get(key.name), Some(key.default));
        }
        assert!(Nothing::KEYS.is_empty() && Nothing {}.validate().is_ok() && Nothing {}.get("x").is_none());
    }

    #[test]
    fn values_are_parsed_within_their_range_and_unknown_keys_are_errors() {
        let mut s = Sample::default();
        s.set("count", "12").unwrap();
        s.set("some-mode", "first").unwrap();
        s.set("some_mode", "second").unwrap();
        s.set("tau", "1e-3").unwrap();
        assert_eq!(s, Sample { count: 12, some_mode: Mode::Second, tau: 1e-3 });
        let mut error = |key: &str, value: &str| s.set(key, value).unwrap_err().to_string();
        assert_eq!(error("count", "17"), "count is 17, it must be in 1..=16");
        assert_eq!(error("count", "-1"), "count is -1, it must be in 1..=16");
        assert_eq!(error("count", "1.5"), "count is 1.5, it must be in 1..=16");
        assert_eq!(error("tau", "nan"), "tau is nan, it must be in 0..=1");
        assert_eq!(error("some-mode", "x"), "some_mode is x, it must be one of first|second");
        assert_eq!(error("x", "1"), "x is 1, it must be one of the settings count, some-mode, tau");
        assert_eq!(s.count, 12, "an error changes nothing");
        assert!(s.get("x").is_none());
    }

    #[test]
    fn ranges_and_relations_are_checked() {
        let check = |s: Sample| s.validate();
        let d = Sample::default();
        assert!(check(d).is_ok());
        for bad in [
            Sample { count: 0, ..d },
            Sample { count: 7, ..d },
            Sample { tau: f32::NAN, ..d },
            Sample { tau: f32::INFINITY, ..d },
            Sample { tau: -1e-9, ..d },
        ] {
            assert!(check(bad).is_err(), "{bad:?}");
        }
    }
}
