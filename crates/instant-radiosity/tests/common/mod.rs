//! Small scenes and helpers that several tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, Scene, View};
use indirect_technique::cpu::{Fit, run};
use instant_radiosity::{InstantRadiosity, Options, Output, Params, Setup, Switch, cpu::Frame};
#[allow(unused_imports, reason = "each test binary uses its own part")]
pub(crate) use testkit::scenes::{corner, lamp, light, lights, square, view};

pub(crate) fn options() -> Options {
    Options { resolution: 64, vpls: 64, interleave: 4, ..Options::default() }
}

pub(crate) fn still(options: Options) -> Options {
    Options { history: Switch::Off, ..options }
}

/// A scene made ready, with its camera.
pub(crate) struct Stage<'a> {
    pub(crate) accel: Accel<'a>,
    pub(crate) view: View,
    pub(crate) camera: GBuffer,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(scene: &'a Scene, view: View, size: [u32; 2]) -> Self {
        let accel = Accel::build(scene, BuildPreset::Fast);
        let camera = cast::gbuffer(&accel, &view, size);
        Self { accel, view, camera }
    }

    pub(crate) fn setup(&self, options: Options, params: Params) -> Setup {
        InstantRadiosity::fit(&self.accel, options, params).unwrap()
    }

    /// The output of `frames` frames after `past`.
    pub(crate) fn run(&self, setup: &Setup, frames: u32, mut past: Output) -> Output {
        for _ in 0..frames {
            run::<InstantRadiosity>(&self.frame(setup), &mut past);
        }
        past
    }

    pub(crate) fn frame<'b>(&'b self, setup: &'b Setup) -> Frame<'b, Setup> {
        Frame::new(&self.accel, &self.view, &self.camera, setup)
    }
}

/// Largest component of all pixels.
pub(crate) fn most(pixels: &[Vec3]) -> f32 {
    pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max)
}
