#![doc = include_str!("../README.md")]
#![cfg_attr(not(any(feature = "std", test)), no_std)]

extern crate alloc;

pub mod analysis;
pub mod discrete;
pub mod halton;
pub mod mapping;
pub mod points;
pub mod radical;
pub mod rng;
pub mod sobol;
pub mod spherical_triangle;
pub mod warp;

mod math;

pub use glam;
