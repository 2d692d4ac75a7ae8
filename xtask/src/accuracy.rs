//! `cargo xtask accuracy`: what the formulas of `sh-math` and `indirect_core::form_factor` cost in accuracy, as Markdown.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use glam::DVec3;
use sh_math::{
    Mean, PackedSh, Rotation, Sh, Zonal, basis, basis_and_gradient, basis_by_recurrence, gauss_legendre, unit,
};

/// A line of the page. Writing to a string cannot fail.
macro_rules! line {
    ($page:expr, $($arg:tt)*) => {{ let _ = writeln!($page, $($arg)*); }};
}

mod form_factors;
mod random;

use random::Random;

/// The page `docs/accuracy.md`. Deterministic; some seconds.
pub(crate) fn run() -> String {
    let mut page = String::from(
        "# Accuracy of the formulas\n\nMade by `cargo xtask accuracy`; every figure is computed by that command.\n",
    );
    precision(&mut page);
    irradiance(&mut page);
    deringing(&mut page);
    form_factors::parallel_squares(&mut page);
    form_factors::all_poses(&mut page);
    page
}

/// Directions, in f32: random, the axes, and close to the axes.
fn directions(count: usize) -> Vec<[f32; 3]> {
    let mut random = Random(1);
    let mut out: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    for axis in DVec3::AXES {
        for e in [0.0, 1e-7, 1e-4] {
            let near = (axis + e * DVec3::new(0.3, -0.9, 0.5)).normalize();
            out.extend([near, -near]);
        }
    }
    out.iter().map(|d| d.as_vec3().to_array()).collect()
}

/// Deviations of f32 results from f64 ones.
#[derive(Default)]
struct Deviation {
    max: f64,
    squares: f64,
    reference: f64,
    count: f64,
}

impl Deviation {
    fn add(&mut self, single: f32, double: f64) {
        let e = f64::from(single) - double;
        self.max = self.max.max(e.abs());
        self.squares += e * e;
        self.reference += double * double;
        self.count += 1.0;
    }

    fn add_all(&mut self, single: &[f32], double: &[f64]) {
        single.iter().zip(double).for_each(|(s, d)| self.add(*s, *d));
    }

    fn row(&self, page: &mut String, name: &str) {
        let scale = (self.reference / self.count).sqrt();
        line!(
            page,
            "| {name} | {:.1e} | {:.1e} |",
            self.max / scale,
            (self.squares / self.count).sqrt() / scale
        );
    }
}

fn widen<const N: usize>(d: [f32; N]) -> [f64; N] {
    d.map(f64::from)
}

fn narrow<const N: usize>(sh: &Sh<N, f64>) -> Sh<N> {
    sh.map(|c| c as f32)
}

fn per_order<const N: usize>(page: &mut String) {
    let directions = directions(20_000);
    let l = Sh::<N>::BANDS - 1;
    let mut random = Random(2);
    let mut d: [Deviation; 7] = Default::default();
    for &direction in &directions {
        let wide = widen(direction);
        d[0].add_all(&basis::<N, f32>(direction), &basis::<N, f64>(wide));
        d[1].add_all(&basis_by_recurrence::<N, f32>(direction), &basis_by_recurrence::<N, f64>(wide));
        let scale = 10.0_f32.powf(30.0 * random.signed() as f32);
        let long = direction.map(|x| x * scale);
        if let (Some(a), Some(b)) = (unit::<f32>(long), unit::<f64>(widen(long))) {
            d[2].add_all(&basis::<N, f32>(a), &basis::<N, f64>(b));
        }
        let (_, gradient) = basis_and_gradient::<N, f32>(direction);
        let (_, wide_gradient) = basis_and_gradient::<N, f64>(wide);
        d[3].add_all(gradient.as_flattened(), wide_gradient.as_flattened());
        // An HDR field: values near the limit of half floats.
        let sh = random.sh::<N>() * 65_504.0;
        d[4].add(narrow(&sh).evaluate(direction), narrow(&sh).map(f64::from).evaluate(wide));
        d[5].add(narrow(&sh).irradiance(direction), narrow(&sh).map(f64::from).irradiance(wide));
        d[6].add(
            narrow(&sh).hemisphere_integral(direction),
            narrow(&sh).map(f64::from).hemisphere_integral(wide),
        );
    }
    let names = [
        "basis",
        "basis by the recurrence",
        "basis, input of length 1e±30 through `unit`",
        "gradient of the basis",
        "evaluate, coefficients to 65 504",
        "irradiance, the same",
        "hemisphere integral, the same",
    ];
    for (name, d) in names.iter().zip(&d) {
        d.row(page, &format!("{name}, l ≤ {l}"));
    }
    let (mut turned, mut repeated, mut packed) =
        (Deviation::default(), Deviation::default(), Deviation::default());
    let (mut projected, mut polygon, mut sphere) =
        (Deviation::default(), Deviation::default(), Deviation::default());
    for case in 0..200 {
        let (sh, m) = (random.sh::<N>(), random.rotation().as_mat3());
        let rotation = Rotation::<N>::new(&m.as_dmat3());
        turned.add_all(&rotation.apply(&narrow(&sh)).0, &rotation.apply(&sh).0);
        if case < 20 {
            let (mut single, mut double) = (narrow(&sh), sh);
            for _ in 0..1000 {
                (single, double) = (rotation.apply(&single), rotation.apply(&double));
            }
            repeated.add_all(&single.0, &double.0);
        }
        packed.add_all(&PackedSh::new(&narrow(&sh)).unpack().0, &sh.0);
        let (mut single, mut double) = (Sh::<N>::default(), Sh::<N, f64>::default());
        for d in directions.iter().take(1000) {
            let value = random.next() as f32;
            single.project_add(*d, value);
            double.project_add(widen(*d), f64::from(value));
        }
        projected.add_all(&single.0, &double.0);
        let corner = |random: &mut Random| (DVec3::Z * 1.5 + random.direction()).as_vec3().to_array();
        let corners: [[f32; 3]; 3] = core::array::from_fn(|_| corner(&mut random));
        polygon.add_all(
            &Sh::<N>::polygon_light(&corners).0,
            &Sh::<N, f64>::polygon_light(&corners.map(widen)).0,
        );
        let radius = random.next() as f32;
        sphere.add_all(
            &Sh::<N>::sphere_light(corners[0], radius).0,
            &Sh::<N, f64>::sphere_light(widen(corners[0]), f64::from(radius)).0,
        );
    }
    turned.row(page, &format!("rotation, l ≤ {l}"));
    repeated.row(page, &format!("a thousand rotations, l ≤ {l}"));
    projected.row(page, &format!("projection of 1000 samples, l ≤ {l}"));
    polygon.row(page, &format!("triangle light, l ≤ {l}"));
    sphere.row(page, &format!("sphere light, l ≤ {l}"));
    packed.row(page, &format!("half floats (`PackedSh`), l ≤ {l}"));
}

fn product<const N: usize>(page: &mut String) {
    let (mut random, mut d) = (Random(3), Deviation::default());
    for _ in 0..2000 {
        let (f, g) = (random.sh::<N>(), random.sh::<N>());
        d.add_all(&narrow(&f).product(&narrow(&g)).0, &f.product(&g).0);
    }
    d.row(page, &format!("product, l ≤ {}", Sh::<N>::BANDS - 1));
}

fn precision(page: &mut String) {
    line!(page, "\n## Spherical harmonics: f32 against f64\n");
    line!(
        page,
        "Both get the same f32 input: random directions, the axes and their neighbourhood. Errors are in units of the"
    );
    line!(page, "root-mean-square result of the operation; f32's half ulp is 6.0e-8.\n");
    line!(page, "| operation | max | rms |\n|---|---|---|");
    per_order::<4>(page);
    per_order::<9>(page);
    per_order::<25>(page);
    per_order::<121>(page);
    product::<4>(page);
    product::<9>(page);
    product::<25>(page);
}

/// Exact irradiance of a cap of radiance 1 (half angle `alpha`) whose axis is `theta` off the normal: over each ring of
/// the cap the clamped cosine has a closed mean.
fn cap_irradiance(alpha: f64, theta: f64) -> f64 {
    let n = 64;
    (0..n)
        .map(|k| {
            let (x, w) = gauss_legendre(n, k);
            let t = 0.5 * alpha * (x + 1.0);
            let (a, b) = (theta.cos() * t.cos(), theta.sin() * t.sin());
            let mean = if a >= b {
                a
            } else if a <= -b {
                0.0
            } else {
                let phi = (-a / b).acos();
                (a * phi + b * phi.sin()) / PI
            };
            0.5 * alpha * w * TAU * t.sin() * mean
        })
        .sum()
}

/// Mean and worst `|E − exact|` over the normals, and the least `E`, in units of the exact maximum.
fn irradiance_error(exact: &dyn Fn(f64) -> f64, series: &dyn Fn(f64) -> f64) -> [f64; 3] {
    let n = 500;
    let at = |k: usize| PI * (k as f64 + 0.5) / n as f64;
    let peak = exact(0.0);
    let mut out = [0.0, 0.0, f64::INFINITY];
    for theta in (0..n).map(at) {
        let e = series(theta);
        let error = (e - exact(theta)).abs() / peak;
        out[0] += error * theta.sin() * PI / n as f64 / 2.0;
        out[1] = error.max(out[1]);
        out[2] = out[2].min(e / peak);
    }
    out
}

fn irradiance_row<const N: usize>(light: &Sh<N, f64>, exact: &dyn Fn(f64) -> f64) -> String {
    let [mean, worst, least] =
        irradiance_error(exact, &|theta| light.irradiance([theta.sin(), 0.0, theta.cos()]));
    format!(" {:.2} % | {:.2} % | {:+.4} |", 100.0 * mean, 100.0 * worst, least)
}

fn irradiance(page: &mut String) {
    line!(page, "\n## Irradiance by the clamped cosine against the exact value\n");
    line!(
        page,
        "Mean and worst error over all normals and the least value, in units of the light's greatest irradiance. Published for"
    );
    line!(
        page,
        "`l ≤ 2`: about 1 % on average over environments, 9 % at worst (Ramamoorthi & Hanrahan 2001).\n"
    );
    line!(
        page,
        "| light | l ≤ 1 mean | worst | least | l ≤ 2 mean | worst | least | l ≤ 4 mean | worst | least |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let mut row = |name: &str, kernel: &dyn Fn(usize) -> f64, exact: &dyn Fn(f64) -> f64| {
        let axis = [0.0, 0.0, 1.0];
        line!(
            page,
            "| {name} |{}{}{}",
            irradiance_row(&Zonal::<4, f64>::from_factors(kernel).toward(axis), exact),
            irradiance_row(&Zonal::<9, f64>::from_factors(kernel).toward(axis), exact),
            irradiance_row(&Zonal::<25, f64>::from_factors(kernel).toward(axis), exact)
        );
    };
    row("point (distant)", &|_| 1.0, &|theta| theta.cos().max(0.0));
    for degrees in [10, 30, 60, 90, 120] {
        let alpha = f64::from(degrees).to_radians();
        let cap = Zonal::<25, f64>::cap(alpha);
        row(&format!("cap, half angle {degrees}°"), &|l| cap.factor(l), &|theta| {
            cap_irradiance(alpha, theta)
        });
    }
    row("uniform", &|l| if l == 0 { 4.0 * PI } else { 0.0 }, &|_| PI);
}

fn dering_row<const N: usize>(page: &mut String, degrees: f64) {
    let alpha = degrees.to_radians();
    let sharp = degrees == 0.0;
    let light: Sh<N, f64> = if sharp {
        Sh::directional_light([0.0, 0.0, 1.0])
    } else {
        Zonal::cap(alpha).toward([0.0, 0.0, 1.0])
    };
    let exact = |theta: f64| if sharp { theta.cos().max(0.0) } else { cap_irradiance(alpha, theta) };
    let e = light.convolve(&Zonal::clamped_cosine());
    let rms = |f: &Sh<N, f64>| {
        let n = 400;
        let square = |k: usize| {
            let theta = PI * (k as f64 + 0.5) / f64::from(n);
            (f.evaluate([theta.sin(), 0.0, theta.cos()]) - exact(theta)).powi(2) * theta.sin()
        };
        (0..n as usize).map(square).sum::<f64>().sqrt()
    };
    let (keep, adjust) = (e.non_negative(Mean::Keep), e.non_negative(Mean::Adjust));
    let window = e.convolve(&e.non_negative_window());
    let least = |f: &Sh<N, f64>| f.minimum(1e-4 * e.mean()).value / exact(0.0);
    let name = if sharp { "point (distant)".to_owned() } else { format!("cap, half angle {degrees}°") };
    line!(
        page,
        "| {name}, l ≤ {} | {:+.4} | {:+.4} | {:.2} | {:.2} ({:+.1} %) | {:.2} | {:.2} | {:.2} |",
        Sh::<N>::BANDS - 1,
        least(&e),
        least(&keep).min(least(&adjust)).min(least(&window)),
        rms(&keep) / rms(&e),
        rms(&adjust) / rms(&e),
        100.0 * (adjust.mean() / e.mean() - 1.0),
        rms(&window) / rms(&e),
        rms(&e.convolve(&Zonal::hann())) / rms(&e),
        rms(&e.convolve(&Zonal::lanczos())) / rms(&e),
    );
}

fn deringing(page: &mut String) {
    line!(page, "\n## De-ringing irradiance\n");
    line!(
        page,
        "Least irradiance in units of the exact maximum, before and after, and the growth of the root-mean-square error. `Keep` and"
    );
    line!(
        page,
        "`Adjust` are `Sh::non_negative` with the mean kept or free (its change in brackets), `window` is"
    );
    line!(
        page,
        "`Sh::non_negative_window`; Hann and Lanczos damp always and need not end at 0. Single lights are the hardest case;"
    );
    line!(page, "`crates/sh-math/tests/dering.rs` holds HDR environments to a growth of 1.5.\n");
    line!(
        page,
        "| light | least | after | Keep | Adjust | window | Hann | Lanczos |\n|---|---|---|---|---|---|---|---|"
    );
    for degrees in [0.0, 30.0, 60.0] {
        dering_row::<4>(page, degrees);
        dering_row::<9>(page, degrees);
        dering_row::<25>(page, degrees);
    }
}
