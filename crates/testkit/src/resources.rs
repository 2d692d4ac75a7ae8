//! What every technique's buffers must be able to do: follow the size of the window, and begin with maps that a renderer has.

use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Projection, Scene, View};
use indirect_gpu::wgpu::{Buffer, CommandEncoder, CommandEncoderDescriptor};
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Inputs, Resources};
use rsm::gpu::Maps;

use crate::scenes;

type Settings<T> =
    (<T as indirect_technique::Technique>::Options, <T as indirect_technique::Technique>::Params);

/// A scene and a technique for it.
struct Stage<'a, T: GpuTechnique + Fit> {
    context: &'a Context,
    pipelines: Pipelines,
    scene: Scene,
    buffers: SceneBuffers,
    setup: T::Setup,
}

impl<T: GpuTechnique<Error: 'static> + Fit> Stage<'_, T> {
    fn new((options, params): Settings<T>) -> Option<Self> {
        let context = crate::gpu()?;
        let mut scene = scenes::corner(scenes::lights()[0], 1.0);
        scene.lights.push(scenes::light(scenes::lights()[1]));
        let buffers = must("the scene", SceneBuffers::upload(&context.device, &scene));
        let setup = must("the setup", T::fit(&Accel::build(&scene, BuildPreset::Fast), options, params));
        Some(Stage { context, pipelines: Pipelines::new(&context.device), scene, buffers, setup })
    }

    fn view(&self, size: [u32; 2]) -> View {
        let tan_half = glam::Vec2::new(0.6 * size[0] as f32 / size[1] as f32, 0.6);
        View { projection: Projection::Perspective { tan_half }, ..scenes::view(1.0) }
    }

    fn maps(&self) -> usize {
        rsm::views::views(&self.scene).len()
    }

    fn camera(&self, size: [u32; 2]) -> GBufferTarget {
        must("the camera", GBufferTarget::new(&self.context.device, size))
    }

    fn resources(&self, camera: &GBufferTarget) -> Resources<T> {
        let queue = &self.context.queue;
        must("resources", Resources::new(&self.pipelines, queue, &self.setup, self.maps(), camera))
    }

    fn prepare(&self, resources: &mut Resources<T>, camera: &GBufferTarget) {
        let (view, views) = (self.view(camera.size()), rsm::views::views(&self.scene));
        camera.prepare(&self.context.queue, &view);
        let inputs = Inputs { lights: &self.scene.lights, views: &views, camera: &view };
        must("prepare", resources.prepare(&self.context.queue, &inputs, &self.setup));
    }

    /// Draws the camera, then whatever `encode` adds, and reads the image.
    fn image(
        &self,
        resources: &Resources<T>,
        camera: &GBufferTarget,
        encode: impl FnOnce(&mut CommandEncoder, &mut PassTimer),
    ) -> Vec<Vec3Pad> {
        let device = &self.context.device;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let timer = &mut PassTimer::off();
        self.pipelines.raster().encode(&mut encoder, timer, "camera", &self.buffers, [camera]);
        encode(&mut encoder, timer);
        self.context.queue.submit([encoder.finish()]);
        must("the image", self.context.read(resources.image()))
    }

    fn whole(&self, resources: &Resources<T>, camera: &GBufferTarget) -> Vec<Vec3Pad> {
        self.image(resources, camera, |encoder, timer| resources.encode(encoder, timer, &self.buffers))
    }
}

fn must<V, E: core::fmt::Display>(what: &str, found: Result<V, E>) -> V {
    found.unwrap_or_else(|e| panic!("{what}: {e}"))
}

fn is_lit(image: &[Vec3Pad]) -> bool {
    image.iter().any(|p| p.xyz[0] > 0.0) && image.iter().flat_map(|p| p.xyz).all(f32::is_finite)
}

/// Fails where resources that follow an image to another size make another picture than new ones, bit for bit; also where the two sizes
/// have equally many pixels. `kept` are passes whose results a resize keeps: the picture is the same without them.
///
/// # Panics
/// Where it fails.
pub fn check_resize<T: GpuTechnique<Error: 'static> + Fit>(settings: Settings<T>, kept: &[&str]) {
    let Some(stage) = Stage::<T>::new(settings) else { return };
    let queue = &stage.context.queue;
    for [from, to] in [[[40, 24], [67, 41]], [[48, 20], [20, 48]], [[67, 41], [9, 5]]] {
        let (old, camera) = (stage.camera(from), stage.camera(to));
        let mut resources = stage.resources(&old);
        stage.prepare(&mut resources, &old);
        assert!(is_lit(&stage.whole(&resources, &old)));
        must("resize", resources.resize(&stage.pipelines, queue, &stage.setup, &camera));
        stage.prepare(&mut resources, &camera);
        let without = stage.image(&resources, &camera, |encoder, timer| {
            resources.encode_without(encoder, timer, Some(&stage.buffers), |pass| kept.contains(&pass));
        });
        let mut fresh = stage.resources(&camera);
        // As many frames have been prepared: some techniques count them.
        stage.prepare(&mut fresh, &camera);
        stage.prepare(&mut fresh, &camera);
        let wanted = stage.whole(&fresh, &camera);
        assert!(is_lit(&wanted) && wanted.len() == (to[0] * to[1]) as usize);
        assert!(without == wanted, "{}: another picture after {from:?} became {to:?}", T::NAME);
        assert_eq!(resources.bytes(), fresh.bytes());
    }
}

/// Fails where a technique makes another picture from maps that somebody else filled, surfaces alone or all of them, bit for bit, or
/// where it draws them all the same.
///
/// # Panics
/// Where it fails.
pub fn check_maps<T: GpuTechnique<Error: 'static, Maps = Maps> + Fit>(settings: Settings<T>) {
    let Some(stage) = Stage::<T>::new(settings) else { return };
    let camera = stage.camera([40, 24]);
    let mut own = stage.resources(&camera);
    stage.prepare(&mut own, &camera);
    let wanted = stage.whole(&own, &camera);
    let foreign = |all: bool, fill: bool| {
        let mut resources = stage.resources(&camera);
        stage.prepare(&mut resources, &camera);
        stage.image(&resources, &camera, |encoder, timer| {
            let copy = |encoder: &mut CommandEncoder, from: &Buffer, to: &Buffer| {
                encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
            };
            let pairs = own.maps().maps.iter().zip(&resources.maps().maps);
            for (from, to) in pairs.filter(|_| fill) {
                let (f, t) = (&from.surface, &to.surface);
                for (f, t) in [
                    (&f.position, &t.position),
                    (&f.normal, &t.normal),
                    (&f.albedo, &t.albedo),
                    (&f.triangle, &t.triangle),
                ] {
                    copy(encoder, f, t);
                }
                if all {
                    copy(encoder, &from.buffers.texels, &to.buffers.texels);
                    copy(encoder, &from.buffers.nodes, &to.buffers.nodes);
                }
            }
            if all {
                copy(encoder, &own.maps().tops, &resources.maps().tops);
                resources.encode_from_maps(encoder, timer, Some(&stage.buffers));
            } else {
                resources.encode_from_surfaces(encoder, timer, Some(&stage.buffers));
            }
        })
    };
    assert!(is_lit(&wanted));
    for all in [false, true] {
        assert!(foreign(all, true) == wanted, "{}: another picture, all maps {all}", T::NAME);
        assert!(foreign(all, false) != wanted, "{}: the maps are not asked, all maps {all}", T::NAME);
    }
}
