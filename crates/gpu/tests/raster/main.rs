//! The raster pass sees what rays see.

#![allow(clippy::unwrap_used, reason = "a test's helper fails as the test does")]

mod common;
mod fixtures;
mod hard_cases;
