use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Image;
use indirect_metrics::{Reference, compare};
use radiance_hints::{cpu, *};
use reference_pathtracer as rp;

fn envf(k: &str, d: f32) -> f32 { std::env::var(k).ok().and_then(|s| s.parse().ok()).unwrap_or(d) }

fn main() {
    let name = std::env::args().nth(1).unwrap_or("cornell_spot".into());
    let scene = indirect_scene::fixtures::build(&name).unwrap();
    let accel = Accel::build(&scene, BuildPreset::Best);
    let size = [128, 128];
    let view = scene.cameras[0].view(size);
    let camera = cast::gbuffer(&accel, &view, size);
    let truth = |bounces, unoccluded| {
        let s = rp::Settings {
            components: rp::Components::Indirect, bounces, unoccluded,
            samples: rp::Samples::count(512), noise_target: Some(0.004), seed: 9, pixel_filter: rp::PixelFilter::Center,
            ..rp::Settings::default()
        };
        rp::render_cached(std::path::Path::new("/tmp/rhcache"), &accel, &view, size, &s, &|_| ()).unwrap()
    };
    let mut matched = truth(rp::Bounces::Count(1), true);
    {
        let o = rsm::Options { resolution: 192, selection: rsm::Selection::All };
        let g = rsm::cpu::indirect(&accel, &camera, &o, &rsm::Params::default()).unwrap();
        matched.indirect = g.image;
        matched.indirect_variance.pixels.iter_mut().for_each(|v| *v = Vec3::ZERO);
    }
    let one = truth(rp::Bounces::Count(1), false);
    let three = truth(rp::Bounces::Count(3), false);
    let bounds = scene.bounds().unwrap();
    let res = envf("RH_RES", 16.0) as u32;
    let order = if envf("RH_ORDER", 3.0) == 2.0 { Order::Two } else { Order::Three };
    let lattice = Lattice::new(&bounds, [res; 3]).unwrap();
    let vis = match envf("RH_VIS", 0.0) as u32 { 1 => Visibility::RsmDepth, 2 => Visibility::CameraDepth, _ => Visibility::Off };
    let sampling = if envf("RH_DISC", 0.0) > 0.0 { Sampling::Disc { fraction: envf("RH_DISC", 0.5) } } else { Sampling::Importance };
    let options = Options { order, samples: envf("RH_NS", 60.0) as u32, visibility: vis, sampling, bounces: 3, bounce_samples: envf("RH_NB", 32.0) as u32, ..Options::default() };
    let transport = match envf("RH_T", 0.0) as u32 { 1 => Transport::Sphere, 2 => Transport::SphereAsPrinted, _ => Transport::Directions };
    let rec = if envf("RH_PRINTED", 0.0) > 0.0 { Reconstruction::AsPrinted } else { Reconstruction::NearSurface };
    let params = Params { jitter: envf("RH_JITTER", 0.5), footprint: envf("RH_FOOT", 1.0), transport, range: envf("RH_RANGE", 1.0), reconstruction: rec, enclosure: if envf("RH_ENC", 1.0) > 0.0 { Some(cpu::enclosure(&accel, &bounds)) } else { None }, ..Params::default() };
    println!("{:?}", params.enclosure); let rsm = rsm::cpu::generate(&accel, &rsm::Options { resolution: 512, ..rsm::Options::default() }).unwrap();
    let t0 = std::time::Instant::now();
    let samples = cpu::sample(&rsm, &lattice, &options, params.seed);
    let t1 = std::time::Instant::now();
    let blocked = cpu::visibility(&rsm, (&view, &camera), &lattice, &samples, &options, &params);
    let t2 = std::time::Instant::now();
    let est = cpu::estimate(&lattice, &samples, &blocked, &options, &params);
    let t3 = std::time::Instant::now();
    println!("sample {:?} visibility {:?} estimate {:?}", t1 - t0, t2 - t1, t3 - t2);
    let shade = |hints: &[f32]| {
        let field = cpu::Field { lattice: &lattice, order, hints };
        let e = cpu::reconstruct(&field, &camera, Scale::Full, &params);
        Image { size, pixels: e.iter().zip(&camera.albedo).map(|(e, a)| *a * *e * std::f32::consts::FRAC_1_PI).collect() }
    };
    let report = |what: &str, image: &Image, truth: &rp::Estimate| {
        let mut se = truth.indirect_variance.clone();
        se.pixels.iter_mut().for_each(|v| *v = v.map(f32::sqrt));
        let r = Reference { image: &truth.indirect, surface: &truth.surface, standard_error: Some(&se) };
        let c = compare(image, &r).unwrap();
        println!("{what:>28}: rel_rmse {:.4} bias {:+.4} flip {:.4} (floor {:.4})", c.luminance.rel_rmse, c.luminance.bias, c.flip, c.noise_floor.rel_rmse);
    };
    let first = shade(&est.hints);
    report("1 bounce vs matched", &first, &matched);
    report("1 bounce vs occluded", &first, &one);
    let mut last = est.hints.clone();
    for k in 2..=3 {
        last = cpu::bounce(&lattice, &est.hints, &last, &est.surroundings, k, &options, &params);
    }
    println!("bounces {:?}", t3.elapsed());
    let third = shade(&last);
    report("3 bounces vs occluded 3", &third, &three);
    let m = |i: &Image| i.mean();
    println!("means: est {:.5} ref1m {:.5} ref1o {:.5} est3 {:.5} ref3 {:.5}; later: est {:.5} ref {:.5}", m(&first), m(&matched.indirect), m(&one.indirect), m(&third), m(&three.indirect), m(&third) - m(&first), m(&three.indirect) - m(&one.indirect));
    let mut worst: Vec<(f32, usize)> = (0..first.pixels.len()).map(|i| ((first.pixels[i] - matched.indirect.pixels[i]).length_squared(), i)).collect();
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let total: f32 = worst.iter().map(|w| w.0).sum();
    let mut acc = 0.0;
    for n in [10, 100, 1000, 4000] { acc = worst[..n].iter().map(|w| w.0).sum::<f32>() / total; println!("worst {n}: {acc:.3}"); }
    let _ = acc;
    for (_, i) in worst.iter().step_by(20).take(12) { println!("{:?} n {:?} rh {:?} ref {:?}", camera.position[*i], camera.normal[*i], first.pixels[*i], matched.indirect.pixels[*i]); }
    let exposure = 0.5 / m(&three.indirect).element_sum().max(1e-9) * 3.0;
    for (n, i) in [("rh1", &first), ("rh3", &third), ("ref1", &matched.indirect), ("ref3", &three.indirect), ("ref1o", &one.indirect)] {
        let p = format!("/tmp/{n}.png");
        std::fs::write(&p, indirect_scene::png::encode_srgb(i, exposure).unwrap()).unwrap();
    }
    let _ = Vec3::ZERO;
}
