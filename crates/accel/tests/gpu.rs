//! The GPU's queries against their twin on the CPU.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::Random;
use glam::{Mat3, Vec3};
use indirect_accel::gpu::{AccelBuffers, HitUniform, RayUniform, Rays, TreeSizes};
use indirect_accel::{Accel, BuildPreset, FlatNode, FlatTree, FlatTriangle, STACK};
use indirect_core::{Hit, Ray, Scene};
use indirect_gpu::shaders::{ACCEL_RAYS, ACCEL_RAYS_MASKED, Module};
use indirect_gpu::{Context, GpuError, Kernel, Pass, PassTimer, Pipelines, SceneBuffers, workgroups_1d};
use testkit::layout::{check, check_constant};

#[test]
fn structs_and_constants_are_those_of_the_shaders() {
    for module in [&ACCEL_RAYS, &ACCEL_RAYS_MASKED] {
        check::<FlatNode>(module).unwrap();
        check::<FlatTriangle>(module).unwrap();
        check::<RayUniform>(module).unwrap();
        check::<HitUniform>(module).unwrap();
        check_constant(module, "ACCEL_STACK", STACK).unwrap();
        check_constant(module, "ACCEL_LEAF", 1_u32 << 31).unwrap();
        check_constant(module, "ACCEL_MASKED", FlatTriangle::MASKED).unwrap();
        check_constant(module, "ACCEL_LAST", FlatTriangle::LAST).unwrap();
        check_constant(module, "ACCEL_VOID", FlatTriangle::VOID).unwrap();
        check_constant(module, "ACCEL_NONE", HitUniform::NONE).unwrap();
        check_constant(module, "ACCEL_UNFINISHED", HitUniform::UNFINISHED).unwrap();
        check_constant(module, "ACCEL_SLAB_SLACK", 32.0 * f32::EPSILON).unwrap();
        check_constant(module, "ACCEL_EDGE_SLACK", 16.0 * f32::EPSILON).unwrap();
        check_constant(module, "ACCEL_POINT_SLACK", 4.0 * f32::EPSILON).unwrap();
        check_constant(module, "ACCEL_SHORTEST", 2.0_f32.powi(-64)).unwrap();
        check_constant(module, "ACCEL_LONGEST", 2.0_f32.powi(64)).unwrap();
        check_constant(module, "ACCEL_LEAST_SLOPE", 2.0_f32.powi(-30)).unwrap();
    }
}

/// What the GPU finds.
struct Answers {
    hits: Vec<HitUniform>,
    occluded: Vec<u32>,
}

fn cast(gpu: &Context, pipelines: &Pipelines, scene: &Scene, tree: &FlatTree, rays: &[Ray]) -> Answers {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let buffers = AccelBuffers::upload(device, queue, tree).unwrap();
    cast_on(gpu, pipelines, scene, &buffers, tree.is_masked(), rays)
}

fn cast_on(
    gpu: &Context,
    pipelines: &Pipelines,
    scene: &Scene,
    tree: &AccelBuffers,
    masked: bool,
    rays: &[Ray],
) -> Answers {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let count = rays.len() as u32;
    let buffers = Rays::new(device, count).unwrap();
    buffers.write(queue, rays);
    let mut pass = Pass::new("rays");
    buffers.cast_closest(pipelines, &mut pass, tree, masked).unwrap();
    buffers.cast_any(pipelines, &mut pass, tree, masked).unwrap();
    let scene = masked.then(|| SceneBuffers::upload(device, scene).unwrap());
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.encode(&mut encoder, &mut PassTimer::off(), scene.as_ref());
    queue.submit([encoder.finish()]);
    Answers {
        hits: buffers.read_hits(device, queue, count).unwrap(),
        occluded: buffers.read_occluded(device, queue, count).unwrap(),
    }
}

/// Rays with other answers than on the CPU: another triangle at the same distance, and all else.
fn compare(scene: &Scene, tree: &FlatTree, rays: &[Ray], gpu: &Answers, unit: f32) -> [usize; 2] {
    let solid = |t, u, v| scene.is_solid(t, u, v);
    let (mut ties, mut apart) = (0, 0);
    for (i, ray) in rays.iter().enumerate() {
        let near = 1e-5 * unit / ray.direction.length();
        assert_ne!(gpu.hits[i].triangle, HitUniform::UNFINISHED);
        match (tree.closest_hit(ray, solid), gpu.hits[i].hit()) {
            (None, None) => {}
            (Some(a), Some(b)) if (a.t - b.t).abs() <= near => ties += usize::from(a.triangle != b.triangle),
            _ => apart += 1,
        }
        apart += usize::from(gpu.occluded[i] != u32::from(gpu.hits[i].hit().is_some()));
        assert!(gpu.occluded[i] < 2);
    }
    [ties, apart]
}

#[test]
fn fixtures_are_hit_as_on_the_cpu() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let mut random = Random(21);
    let (mut total, mut other) = (0, [0; 2]);
    for name in indirect_scene::fixtures::NAMES {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        let accel = Accel::build(&scene, BuildPreset::Balanced);
        let tree = FlatTree::of(&accel);
        let rays = common::rays(&accel, 96, &mut random);
        let found = cast(gpu, &pipelines, &scene, &tree, &rays);
        let [ties, apart] = compare(&scene, &tree, &rays, &found, accel.unit());
        println!("{name}: {} rays, {ties} ties, {apart} apart", rays.len());
        total += rays.len();
        other = [other[0] + ties, other[1] + apart];
    }
    println!("{total} rays, {other:?}");
    // Where the shader rounds, fuses or divides otherwise than the CPU, what lies within rounding of an edge falls to another side;
    // the flat tree and the wide one differ in 1 of 10⁴ rays for the same reason (tests/flat.rs).
    assert!(other[0] * 1000 <= total && other[1] * 1000 <= total, "{other:?}");
}

#[test]
fn soups_are_hit_as_on_the_cpu() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let mut random = Random(5);
    let (mut total, mut hits, mut other) = (0, 0, [0; 2]);
    for exponent in [-3, 0, 5] {
        for far in [0.0, 1.0, 100.0] {
            let size = 10.0_f32.powi(exponent);
            let offset = random.direction() * (far * size);
            let scene = common::soup(&mut random, 300, size, offset);
            let accel = Accel::build(&scene, BuildPreset::Best);
            let tree = FlatTree::of(&accel);
            let rays: Vec<Ray> = (0..4000)
                .map(|_| {
                    let origin = offset + random.cube() * (1.5 * size);
                    let direction = random.direction() * 10.0_f32.powf(4.0 * random.unit() - 2.0);
                    let endless = random.bits() & 1 == 0;
                    let t_max =
                        if endless { f32::INFINITY } else { size * random.unit() / direction.length() };
                    Ray { origin, direction, t_max }
                })
                .collect();
            let found = cast(gpu, &pipelines, &scene, &tree, &rays);
            hits += found.hits.iter().filter(|h| h.hit().is_some()).count();
            let [ties, apart] = compare(&scene, &tree, &rays, &found, accel.unit());
            other = [other[0] + ties, other[1] + apart];
            total += rays.len();
        }
    }
    println!("{total} rays, {hits} hits, {other:?}");
    assert!(hits * 10 > total, "{hits}");
    // Repeated triangles and those in one plane tie in many rays, and the smaller index wins on both sides.
    assert!(other[0] * 1000 <= total && other[1] * 1000 <= total, "{other:?}");
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let meshes = [
        ("bumpy sphere", common::bumpy_sphere(60)),
        ("fine cube", common::cube(16, Mat3::IDENTITY)),
        ("turned cube", common::cube(20, turn)),
    ];
    let mut random = Random(1);
    let mut total = 0;
    for (name, mesh) in meshes {
        for (offset, scale) in [(0.0, 1.0), (0.0, 1e-3), (0.0, 1e5), (1e3, 1.0), (1e3, 1e5)] {
            let centre = Vec3::new(offset, -offset, offset);
            let scene = common::placed(mesh.clone(), scale, centre);
            let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Best));
            let rays = common::aimed(&scene, centre, scale, 30_000, &mut random);
            let found = cast(gpu, &pipelines, &scene, &tree, &rays);
            let out = |i: &usize| found.hits[*i].hit().is_none() || found.occluded[*i] != 1;
            let leaks = (0..rays.len()).filter(out).count();
            assert_eq!(leaks, 0, "{name} at {offset} × {scale}");
            total += rays.len();
        }
    }
    println!("0 of {total} rays leave");
}

/// `ACCEL_RAYS` with a line of its WGSL replaced.
fn faulty(from: &str, to: &str) -> Module {
    let replaced = |(path, text): &(&'static str, &'static str)| -> (&'static str, &'static str) {
        (path, Box::leak(text.replace(from, to).into_boxed_str()))
    };
    let files: Vec<_> = ACCEL_RAYS.files.iter().map(replaced).collect();
    assert_ne!(files, ACCEL_RAYS.files, "{from}");
    Module { files: Box::leak(files.into_boxed_slice()), ..ACCEL_RAYS }
}

/// The triangle that each ray hits by a module of one's own.
fn cast_by(gpu: &Context, module: &Module, tree: &FlatTree, rays: &[Ray]) -> Vec<Option<Hit>> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let count = rays.len() as u32;
    let (buffers, tree) =
        (Rays::new(device, count).unwrap(), AccelBuffers::upload(device, queue, tree).unwrap());
    buffers.write(queue, rays);
    let kernel = Kernel::new(device, module, "cast_closest", &[]);
    let group = kernel.group(device, 0, &[&tree.named(), &buffers.buffers.named()]).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let workgroups = workgroups_1d(count.into(), 64).unwrap();
    kernel.dispatch(&mut encoder, &mut PassTimer::off(), "rays", &[&group], workgroups);
    queue.submit([encoder.finish()]);
    buffers.read_hits(device, queue, count).unwrap().iter().map(HitUniform::hit).collect()
}

#[test]
fn planted_faults_are_found() {
    let Some(gpu) = testkit::gpu() else { return };
    let scene = common::bumpy_sphere(60);
    let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Best));
    let rays = common::aimed(&scene, Vec3::ZERO, 1.0, 20_000, &mut Random(1));
    let misses = |module: &Module| cast_by(gpu, module, &tree, &rays).iter().filter(|h| h.is_none()).count();
    assert_eq!(misses(&ACCEL_RAYS), 0);
    // Edges shrunk by their bound instead of grown; rectangles too; the boxes far too small.
    let leaks = [
        faulty("ACCEL_EDGE_SLACK * width", "-ACCEL_EDGE_SLACK * width"),
        faulty("ACCEL_POINT_SLACK * spread", "-1e5 * ACCEL_POINT_SLACK * spread"),
        faulty("reach * ACCEL_SLAB_SLACK", "reach * -0.01"),
    ]
    .map(|module| misses(&module));
    println!("of {} rays leave {leaks:?}", rays.len());
    assert!(leaks.into_iter().all(|n| n > 100), "{leaks:?}");
    // The farther child first and nothing after it, or a forgotten shear: hits, but other ones.
    let expected: Vec<_> = rays.iter().map(|r| tree.closest_hit(r, indirect_accel::opaque)).collect();
    let farther = common::both(common::bumpy_sphere(60), common::placed(scene.clone(), 1.5, Vec3::ZERO));
    let both = FlatTree::of(&Accel::build(&farther, BuildPreset::Best));
    let wrong = |module: &Module, tree: &FlatTree| {
        let found = cast_by(gpu, module, tree, &rays);
        let differs = |(a, b): (&Option<Hit>, &Option<Hit>)| match (a, b) {
            (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-4,
            _ => true,
        };
        expected.iter().zip(&found).filter(|(a, b)| differs((a, b))).count()
    };
    assert_eq!(wrong(&ACCEL_RAYS, &both), 0);
    let first = faulty("if nearer && (", "if best.triangle == ACCEL_NONE && nearer && (");
    let order = faulty("&& second.x < first.x", "&& second.x > first.x");
    // Any order finds the nearest; the first that is found is not it.
    assert_eq!(wrong(&order, &both), 0);
    assert!(wrong(&first, &both) > 100);
    assert!(wrong(&faulty("p.x - ray.shear.x * p.z", "p.x"), &both) > 100);
}

#[test]
fn hard_cases() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let tree_of = |scene: &Scene| FlatTree::of(&Accel::build(scene, BuildPreset::Best));
    let good = Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::NEG_Y);
    let mut rays = common::odd_rays(good);
    let odd = rays.len();
    rays.extend([good, Ray { t_max: 1.0, ..good }, Ray { t_max: 1.0_f32.next_up(), ..good }]);
    // In the plane, and from it.
    rays.push(Ray::new(Vec3::new(-2.0, 0.0, 0.1), Vec3::X));
    rays.push(Ray::new(Vec3::new(0.3, 0.0, 0.1), Vec3::NEG_Y));
    let scene = common::square(0.0);
    let found = cast(gpu, &pipelines, &scene, &tree_of(&scene), &rays);
    let hit: Vec<bool> = found.hits.iter().map(|h| h.hit().is_some()).collect();
    assert!(hit[..odd].iter().all(|h| !h), "{hit:?}");
    assert_eq!(hit[odd..], [true, false, true, false, true]);
    assert!(found.occluded.iter().zip(&hit).all(|(o, h)| *o == u32::from(*h)));
    // Nothing: an empty tree, a tree of nothing that has an area, and buffers that nobody wrote.
    let line = common::scene(vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0], vec![[0, 1, 2]; 100]);
    let zeroed = AccelBuffers::new(&gpu.device, &TreeSizes { nodes: 0, triangles: 0 }).unwrap();
    for tree in [
        AccelBuffers::upload(&gpu.device, &gpu.queue, &tree_of(&Scene::default())).unwrap(),
        AccelBuffers::upload(&gpu.device, &gpu.queue, &tree_of(&line)).unwrap(),
        zeroed.clone(),
    ] {
        let found = cast_on(gpu, &pipelines, &scene, &tree, false, &rays);
        assert!(found.hits.iter().all(|h| h.triangle == HitUniform::NONE));
        assert!(found.occluded.iter().all(|o| *o == 0));
    }
    // No rays, and a tree that does not fit.
    let none = cast(gpu, &pipelines, &scene, &tree_of(&scene), &[]);
    assert!(none.hits.is_empty() && none.occluded.is_empty());
    let large = tree_of(&common::bumpy_sphere(10));
    assert!(matches!(zeroed.write(&gpu.queue, &large), Err(GpuError::Limit { .. })));
    // Directions of any length in range, scales and slopes next to nothing.
    for length in [1e-15_f32, 1e-3, 1e5, 1e15] {
        let rays = [Vec3::NEG_Y, Vec3::new(1e-38, -1.0, -1e-20), Vec3::new(0.1, -1.0, 0.0)]
            .map(|d| Ray::new(Vec3::new(0.3, 1.0, 0.1), d * length));
        let found = cast(gpu, &pipelines, &scene, &tree_of(&scene), &rays);
        for h in &found.hits {
            assert!((h.t * length - 1.0).abs() < 1e-6, "{length} {h:?}");
        }
    }
}

#[test]
fn rays_pass_through_the_holes_of_a_mask() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let scene = common::masked(common::square(1.0), common::square(0.0));
    let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Best));
    let mut random = Random(9);
    let points: Vec<Vec3> = (0..10_000).map(|_| random.cube()).collect();
    let rays: Vec<Ray> = points
        .iter()
        .map(|p| Ray { t_max: 1.5, ..Ray::new(Vec3::new(p.x, 2.0, p.z), Vec3::NEG_Y) })
        .collect();
    let found = cast(gpu, &pipelines, &scene, &tree, &rays);
    for (i, p) in points.iter().enumerate() {
        if p.x.abs().min(p.z.abs()) > 1e-5 {
            // Bilinear alpha of the checkerboard crosses 1/2 on the two axes.
            let solid = p.x * p.z < 0.0;
            assert_eq!((found.hits[i].hit().is_some(), found.occluded[i]), (solid, u32::from(solid)), "{p}");
        }
    }
    // The same tree taken as opaque has no holes.
    let buffers = AccelBuffers::upload(&gpu.device, &gpu.queue, &tree).unwrap();
    let opaque = cast_on(gpu, &pipelines, &scene, &buffers, false, &rays);
    assert!(opaque.hits.iter().all(|h| h.t == 1.0));
    // Refitted, the mask lies elsewhere.
    let (mut moved, mut tree) = (scene.clone(), tree);
    for p in &mut moved.mesh.positions {
        p.y *= 0.75;
    }
    tree.refit(&moved).unwrap();
    buffers.write(&gpu.queue, &tree).unwrap();
    let found = cast_on(gpu, &pipelines, &moved, &buffers, false, &rays);
    assert!(found.hits.iter().all(|h| h.t == 1.25));
}

/// More triangles in the way than the shader looks at: it says so, and claims nothing.
#[test]
fn a_ray_without_end_says_so() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&gpu.device);
    let corners = [Vec3::new(-1.0, 0.0, -1.0), Vec3::new(3.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, 3.0)];
    let scene = common::scene(corners.to_vec(), vec![[0, 1, 2]; 70_000]);
    let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Fast));
    // Beside the triangle, within its box: any-hit must look at all of it, too.
    let rays = [
        Ray::new(Vec3::new(0.1, 1.0, 0.1), Vec3::NEG_Y),
        Ray::new(Vec3::new(2.5, 1.0, 2.5), Vec3::NEG_Y),
        Ray::new(Vec3::new(0.1, 1.0, 0.1), Vec3::Y),
    ];
    let found = cast(gpu, &pipelines, &scene, &tree, &rays);
    let triangles = found.hits.iter().map(|h| h.triangle).collect::<Vec<_>>();
    assert_eq!(triangles, [HitUniform::UNFINISHED, HitUniform::UNFINISHED, HitUniform::NONE]);
    assert_eq!(found.occluded, [1, 2, 0]);
    // The twin on the CPU has no such limit.
    let hit = tree.closest_hit(&rays[0], indirect_accel::opaque).unwrap();
    assert_eq!(hit.triangle, 0);
    assert!(tree.closest_hit(&rays[1], indirect_accel::opaque).is_none());
}
