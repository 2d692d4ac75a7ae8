#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
mod row;

use indirect_core::settings::{BadOption, Settings};
use indirect_core::{GBuffer, Image, Scene, SceneProfile, View};

pub use row::Row;

/// A way to compute indirect light.
pub trait Technique: Sized + 'static {
    /// Its name, for command lines and reports.
    const NAME: &'static str;
    /// What is fixed when buffers are made.
    type Options: Settings + PartialEq;
    /// What may change from frame to frame.
    type Params: Settings + PartialEq;
    /// Both, and what was fitted to the scene.
    type Setup: Clone;
    /// Everything that frames compute on the CPU, the image among it.
    type Output: Default;
    /// What the lengths of GPU buffers follow from; `()` without the feature `gpu`.
    type Sizes;
    /// The GPU buffers; `()` without the feature `gpu`.
    type Buffers;
    /// What can go wrong.
    type Error: core::error::Error + From<BadOption>;

    /// The settings that a scene of this kind is best given, before a person changes them.
    #[must_use]
    fn for_scene(_profile: &SceneProfile) -> (Self::Options, Self::Params) {
        Default::default()
    }

    /// The options of a setup.
    fn options(setup: &Self::Setup) -> &Self::Options;

    /// The passes of a frame, in order.
    fn rows() -> Vec<Row<Self>>;

    /// The image of a frame: indirect radiance that leaves each pixel, W/(sr·m²).
    fn image(output: &Self::Output) -> &Image;

    /// Memory of a frame on the CPU, bytes.
    fn output_bytes(output: &Self::Output) -> u64;
}

/// What a frame on the CPU is given.
#[derive(Debug)]
pub struct Frame<'a, S> {
    /// The scene, for rays.
    #[cfg(feature = "cpu")]
    pub accel: &'a indirect_accel::Accel<'a>,
    /// The scene.
    pub scene: &'a Scene,
    /// The camera.
    pub view: &'a View,
    /// What the camera sees.
    pub camera: &'a GBuffer,
    /// Settings, and what was fitted to the scene.
    pub setup: &'a S,
}

// Derived ones would ask the same of `S`.
impl<S> Clone for Frame<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for Frame<'_, S> {}
