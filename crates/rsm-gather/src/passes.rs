use glam::Vec3;
#[cfg(feature = "cpu")]
use indirect_core::GBuffer;
use indirect_core::{Image, SceneProfile};
#[cfg(feature = "cpu")]
use indirect_filter::cpu::shade;
use indirect_technique::{Row, Technique, passes};
#[cfg(feature = "cpu")]
use rsm::cpu::{Receivers, compact, gather, vpls};
use rsm::{Error, Rsm, Vpl};

use crate::settings::{Options, Params, Setup};

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct RsmGather;

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// The maps.
    pub rsm: Rsm,
    /// One VPL per slot of the selection, unlit slots included.
    pub slots: Vec<Vpl>,
    /// The VPLs with flux.
    pub vpls: Vec<Vpl>,
    /// Irradiance per pixel, W/m²; 0 where the camera sees nothing.
    pub irradiance: Vec<Vec3>,
    /// Indirect radiance that leaves each pixel, W/(sr·m²).
    pub image: Image,
}

impl Technique for RsmGather {
    const NAME: &'static str = "rsm-gather";
    const MAP_PASSES: &'static [&'static str] = &rsm::MAP_PASSES;
    type Options = Options;
    type Params = Params;
    type Setup = Setup;
    type Output = Output;
    #[cfg(feature = "gpu")]
    type Sizes = crate::buffers::Sizes;
    #[cfg(not(feature = "gpu"))]
    type Sizes = ();
    #[cfg(feature = "gpu")]
    type Buffers = crate::buffers::Buffers;
    #[cfg(not(feature = "gpu"))]
    type Buffers = ();
    type Error = Error;

    fn for_scene(_: &SceneProfile) -> (Options, Params) {
        Default::default()
    }

    fn options(setup: &Setup) -> &Options {
        &setup.options
    }

    fn rows() -> Vec<Row<Self>> {
        let mut rows = rsm::map_rows!(Self);
        rows.extend(passes!(
            Self,
            [
                Row {
                    name: "vpls",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let selection = f.setup.options.selection();
                        o.slots = vpls(&o.rsm, selection, &selection.points(f.setup.params.seed));
                    },
                    gpu: |b, pass, _| b.buffers.slots.draw(b.pipelines, pass, &b.buffers.rsm),
                    data: |b, o, x, _| x.elements("", &b.slots.buffers.slots, 0, &mut o.slots),
                },
                Row {
                    name: "compact",
                    times: |_| 1,
                    cpu: |_, o, _| o.vpls = compact(&o.slots),
                    gpu: |b, pass, _| b.buffers.list.compact(
                        b.pipelines,
                        pass,
                        &b.buffers.slots.buffers.slots
                    ),
                    data: |b, o, x, _| b.list.exchange(&mut o.vpls, x),
                },
                Row {
                    name: "gather",
                    times: |_| 1,
                    cpu: |f, o, _| o.irradiance = gather_pixels(&o.vpls, f.camera, f.setup.params.form),
                    gpu: |b, pass, _| b.buffers.list.gather(b.pipelines, pass, b.sizes.pixels, b.named()),
                    data: |b, o, x, _| x.vectors("irradiance", &b.own.irradiance, 0, &mut o.irradiance),
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| o.image = shade(f.camera, &o.irradiance),
                    gpu: |b, pass, _| {
                        b.compute(pass, (&indirect_gpu::shaders::FILTER_SHADE, "shade"), b.sizes.pixels, &[])
                    },
                    data: |b, o, x, _| x.image("image", &b.own.image, &mut o.image),
                },
            ]
        ));
        rows
    }

    fn image(output: &Output) -> &Image {
        &output.image
    }

    fn output_bytes(output: &Output) -> u64 {
        let lights = size_of_val(&output.slots[..]) + size_of_val(&output.vpls[..]);
        let images = size_of_val(&output.irradiance[..]) + size_of_val(&output.image.pixels[..]);
        (output.rsm.bytes() + lights + images) as u64
    }
}

/// `gather` at every pixel that sees something.
#[cfg(feature = "cpu")]
fn gather_pixels(vpls: &[Vpl], camera: &GBuffer, form: rsm::Form) -> Vec<Vec3> {
    let (receivers, pixels) = Receivers::of_surface(camera);
    let mut irradiance = vec![Vec3::ZERO; camera.len()];
    for (pixel, e) in pixels.into_iter().zip(gather(vpls, &receivers, form)) {
        irradiance[pixel as usize] = e;
    }
    irradiance
}
