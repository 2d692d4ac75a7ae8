//! All techniques behind one face.

use indirect_accel::Accel;
use indirect_core::settings::Settings;
use indirect_core::{Light, MapView, View};
use indirect_gpu::wgpu::{Buffer, CommandEncoder, Limits, Queue};
use indirect_gpu::{GBufferTarget, PassTimer, Pipelines, SceneBuffers};
use indirect_technique::Technique;
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Inputs, Resources};

use image_space_radiosity::ImageSpaceRadiosity;
use instant_radiosity::InstantRadiosity;
use radiance_hints::RadianceHints;
use rsm_gather::RsmGather;
use sh_grid_raytracer::ShGridRaytracer;

/// Names of the techniques.
pub const NAMES: [&str; 5] = [
    RsmGather::NAME,
    ImageSpaceRadiosity::NAME,
    RadianceHints::NAME,
    InstantRadiosity::NAME,
    ShGridRaytracer::NAME,
];

/// Settings that a renderer in software can bear, where they are not the defaults: what `cargo xtask render --set` is given for the same
/// picture.
#[must_use]
pub fn settings(name: &str) -> &'static [(&'static str, &'static str)] {
    match name {
        "sh-grid-raytracer" => &[("grid", "16"), ("photons", "32768"), ("directions", "100")],
        "instant-radiosity" => {
            &[("resolution", "64"), ("vpls", "256"), ("interleave", "4"), ("history", "off")]
        }
        "radiance-hints" => &[("resolution", "128"), ("lattice", "12")],
        _ => &[("resolution", "128")],
    }
}

/// A technique that is ready.
pub(crate) trait Running {
    fn prepare(
        &mut self,
        queue: &Queue,
        lights: &[Light],
        views: &[MapView],
        camera: &View,
    ) -> Result<(), String>;
    fn encode(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, scene: &SceneBuffers);
    fn image(&self) -> &Buffer;
}

struct Made<T: GpuTechnique> {
    setup: T::Setup,
    resources: Resources<T>,
}

impl<T: GpuTechnique> Running for Made<T> {
    fn prepare(
        &mut self,
        queue: &Queue,
        lights: &[Light],
        views: &[MapView],
        camera: &View,
    ) -> Result<(), String> {
        let inputs = Inputs { lights, views, camera };
        self.resources.prepare(queue, &inputs, &self.setup).map_err(|e| e.to_string())
    }

    fn encode(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, scene: &SceneBuffers) {
        self.resources.encode(encoder, timer, scene);
    }

    fn image(&self) -> &Buffer {
        self.resources.image()
    }
}

fn setup<T: GpuTechnique + Fit>(accel: &Accel<'_>) -> Result<T::Setup, String> {
    let profile = indirect_core::SceneProfile::of(accel.scene());
    let (mut options, mut params) = T::for_scene(&profile);
    for (key, value) in settings(T::NAME) {
        let set =
            if T::Options::key(key).is_some() { options.set(key, value) } else { params.set(key, value) };
        set.map_err(|e| e.to_string())?;
    }
    T::fit(accel, options, params).map_err(|e| e.to_string())
}

fn new<T: GpuTechnique + Fit>(
    pipelines: &Pipelines,
    queue: &Queue,
    accel: &Accel<'_>,
    maps: usize,
    camera: &GBufferTarget,
) -> Result<Box<dyn Running>, String> {
    let setup = setup::<T>(accel)?;
    let resources = Resources::<T>::new(pipelines, queue, &setup, maps, camera).map_err(|e| e.to_string())?;
    Ok(Box::new(Made { setup, resources }))
}

/// Calls a function of a technique's type by its name.
macro_rules! by_name {
    ($name:expr, $function:ident($($argument:expr),*)) => {
        match $name {
            "rsm-gather" => $function::<RsmGather>($($argument),*),
            "image-space-radiosity" => $function::<ImageSpaceRadiosity>($($argument),*),
            "radiance-hints" => $function::<RadianceHints>($($argument),*),
            "instant-radiosity" => $function::<InstantRadiosity>($($argument),*),
            "sh-grid-raytracer" => $function::<ShGridRaytracer>($($argument),*),
            other => Err(format!("no technique is called {other}: there are {}", NAMES.join(", "))),
        }
    };
}

pub(crate) fn make(
    name: &str,
    pipelines: &Pipelines,
    queue: &Queue,
    accel: &Accel<'_>,
    maps: usize,
    camera: &GBufferTarget,
) -> Result<Box<dyn Running>, String> {
    by_name!(name, new(pipelines, queue, accel, maps, camera))
}

fn limits<T: GpuTechnique + Fit>(accel: &Accel<'_>, size: [u32; 2], maps: usize) -> Result<Limits, String> {
    Ok(Resources::<T>::required_limits(&setup::<T>(accel)?, size, maps))
}

pub(crate) fn required_limits(
    name: &str,
    accel: &Accel<'_>,
    size: [u32; 2],
    maps: usize,
) -> Result<Limits, String> {
    by_name!(name, limits(accel, size, maps))
}
