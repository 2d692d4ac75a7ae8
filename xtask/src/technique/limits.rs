//! What techniques say before anything is made is what they make: limits and bytes, for any settings, image and number of maps.

use indirect_accel::{Accel, BuildPreset};
use indirect_core::settings::Kind;
use indirect_core::{Scene, SceneProfile};
use indirect_gpu::wgpu::{ErrorFilter, Limits, PollType};
use indirect_gpu::{AdapterChoice, Context, GBufferTarget, Pipelines, Plan};
use indirect_sampling::rng::{hash_combine, unit_f32};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Resources};
use proptest::prelude::*;

use super::settings::{Values, keys, spelled};

/// The scene only bounds what is fitted to it.
fn scene() -> Scene {
    indirect_scene::fixtures::build("plane_wall").unwrap()
}

/// Random settings: each key keeps its default half of the time; numbers are even in their logarithm. `None` where they contradict
/// each other.
fn random<T: Fit>(accel: &Accel<'_>, seed: u32) -> Option<T::Setup> {
    let mut pairs = Vec::new();
    for (i, key) in (0..).zip(keys::<T>()) {
        let h = hash_combine(seed, i);
        if h & 1 == 0 {
            continue;
        }
        let u = unit_f32(hash_combine(h, 1));
        let value = match key.kind {
            Kind::Int { min, max } => {
                let (low, high) = (f64::from(min) + 1.0, f64::from(max) + 1.0);
                let v = (low.ln() + f64::from(u) * (high.ln() - low.ln())).exp() - 1.0;
                (v as u32).clamp(min, max).to_string()
            }
            Kind::Number { min, max } => (min + u * (max - min)).to_string(),
            Kind::Choice(words) => words[(u * words.len() as f32) as usize % words.len()].to_owned(),
        };
        pairs.push(format!("{}={value}", spelled(key)));
    }
    let values = Values::parse::<T, _>(&pairs).ok()?;
    let (options, params) = values.settings::<T>(&SceneProfile::default()).ok()?;
    T::fit(accel, options, params).ok()
}

/// A plan fits the limits that it asks for and no smaller ones.
fn limits_are_exact(plan: &Plan) {
    let required = plan.required_limits();
    match plan.check(&required) {
        Ok(()) => {}
        // More elements than a shader can count fit no device.
        Err(e) => return assert!(e.to_string().contains("32-bit index"), "{e}"),
    }
    let default = Limits::default();
    let mut smaller = Vec::new();
    if required.max_storage_buffer_binding_size > default.max_storage_buffer_binding_size {
        let less = required.max_storage_buffer_binding_size - 1;
        smaller.push(Limits { max_storage_buffer_binding_size: less, ..required.clone() });
    }
    if required.max_buffer_size > default.max_buffer_size {
        smaller.push(Limits { max_buffer_size: required.max_buffer_size - 1, ..required.clone() });
    }
    if required.max_texture_dimension_2d > default.max_texture_dimension_2d {
        let less = required.max_texture_dimension_2d - 1;
        smaller.push(Limits { max_texture_dimension_2d: less, ..required.clone() });
    }
    for limits in smaller {
        assert!(plan.check(&limits).is_err());
    }
}

/// Largest plan that is made in earnest.
const MOST_BYTES: u64 = 1 << 30;

/// Makes the buffers: it succeeds exactly where the device's limits allow it, and the device then holds what the plan says. Whether
/// they were made.
fn creation_follows_the_plan<T: Fit + GpuTechnique>(
    context: &Context,
    pipelines: &Pipelines,
    (setup, size, maps): (&T::Setup, [u32; 2], usize),
) -> bool {
    let (device, queue) = (&context.device, &context.queue);
    let plan = Resources::<T>::plan(setup, size, maps);
    let fits = plan.check(&device.limits());
    let camera = GBufferTarget::plan(size);
    if camera.check(&device.limits()).is_err() || (fits.is_ok() && plan.bytes() + camera.bytes() > MOST_BYTES)
    {
        return false;
    }
    let camera = GBufferTarget::new(device, size).unwrap();
    let held = || {
        queue.submit([]);
        device.poll(PollType::wait_indefinitely()).unwrap();
        let hal = device.get_internal_counters().hal;
        (hal.buffers.read(), hal.texture_views.read(), hal.buffer_memory.read())
    };
    let before = held();
    let scope = device.push_error_scope(ErrorFilter::Validation);
    let made = Resources::<T>::new(pipelines, queue, setup, maps, &camera);
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
    assert_eq!(made.as_ref().err().map(ToString::to_string), fits.as_ref().err().map(ToString::to_string));
    let Ok(made) = made else { return false };
    assert_eq!(made.bytes(), plan.bytes());
    let after = held();
    let targets = ["visibility", "depth", "splats"];
    let (textures, buffers): (Vec<_>, Vec<_>) = plan.items().partition(|(name, _)| targets.contains(name));
    // wgpu keeps a second view of each render target, through which it clears it.
    let views = 2 * textures.len();
    assert_eq!((after.0 - before.0, after.1 - before.1), (buffers.len() as isize, views as isize));
    // The device rounds each buffer up to its alignment.
    let (sum, memory) = (buffers.iter().map(|b| b.1).sum::<u64>(), (after.2 - before.2) as u64);
    assert!(memory >= sum && memory <= sum + 512 * buffers.len() as u64, "{memory} bytes, {sum} planned");
    true
}

/// The image and the maps of a case.
fn shape(seed: u32) -> ([u32; 2], usize) {
    let side = |i, most: f32| (unit_f32(hash_combine(seed, i)).powi(3) * most) as u32 + 1;
    ([side(1, 7679.0), side(2, 4319.0)], hash_combine(seed, 3) as usize % 25)
}

macro_rules! for_technique {
    ($name:ident, $technique:ty) => {
        mod $name {
            use super::*;

            proptest! {
                #![proptest_config(ProptestConfig::with_cases(256))]
                #[test]
                fn required_limits_are_enough_and_not_too_much(seed: u32) {
                    let scene = scene();
                    let accel = Accel::build(&scene, BuildPreset::Fast);
                    let (size, maps) = shape(seed);
                    let setup = random::<$technique>(&accel, seed);
                    prop_assume!(setup.is_some());
                    limits_are_exact(&Resources::<$technique>::plan(&setup.unwrap(), size, maps));
                }
            }

            #[test]
            fn the_device_holds_what_was_planned() {
                // A device of its own: its counters are those of this test alone.
                if testkit::gpu().is_none() {
                    return;
                }
                let context = &Context::new(&AdapterChoice::from_env()).unwrap();
                let scene = scene();
                let accel = Accel::build(&scene, BuildPreset::Fast);
                let pipelines = Pipelines::new(&context.device);
                let made = (0..48).filter(|seed| {
                    let (size, maps) = shape(*seed);
                    random::<$technique>(&accel, *seed).is_some_and(|setup| {
                        creation_follows_the_plan::<$technique>(context, &pipelines, (&setup, size, maps))
                    })
                });
                // Cases that contradict themselves or are too large say nothing: enough must be left.
                let made = made.count();
                assert!(made >= 12, "only {made} of 48 were made");
            }

            #[test]
            fn webgpu_s_defaults_suffice_for_3840_by_2160() {
                let scene = scene();
                let accel = Accel::build(&scene, BuildPreset::Fast);
                let setup = <$technique>::fit(&accel, Default::default(), Default::default()).unwrap();
                let plan = Resources::<$technique>::plan(&setup, [3840, 2160], 6);
                let plan = plan.and(GBufferTarget::plan([3840, 2160]));
                plan.check(&Limits::default()).unwrap();
            }
        }
    };
}

for_technique!(gather, rsm_gather::RsmGather);
for_technique!(hints, radiance_hints::RadianceHints);
for_technique!(radiosity, image_space_radiosity::ImageSpaceRadiosity);
for_technique!(instant, instant_radiosity::InstantRadiosity);
for_technique!(sh_grid, sh_grid_raytracer::ShGridRaytracer);
