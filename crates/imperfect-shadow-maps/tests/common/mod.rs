//! Scenes, receivers and ray-traced truth that tests and the example share.
#![allow(dead_code, reason = "each user takes its own part")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use glam::Vec3;
use imperfect_shadow_maps::cpu::{Atlas, build, resolve};
use imperfect_shadow_maps::{Options, Placement, Point, place};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::offset_ray_origin_scaled;
use indirect_core::{Ray, Scene};
use indirect_sampling::rng::{philox4x32, unit_f32};
use rayon::prelude::*;
use rsm::{Selection, Vpl};

/// `count` VPLs of a scene, drawn by importance from maps of 128² texels.
pub(crate) fn vpls(accel: &Accel<'_>, count: u32, seed: u32) -> Vec<Vpl> {
    let maps = rsm::cpu::generate(accel, 128).unwrap();
    let selection = Selection::Importance { count };
    rsm::cpu::compact(&rsm::cpu::vpls(&maps, selection, &selection.points(seed)))
}

/// Random points of a scene's surface with the normals of their triangles.
pub(crate) fn receivers(scene: &Scene, count: u32, seed: u32) -> Vec<(Vec3, Vec3)> {
    let points = place(scene, count, &[], Placement::Random, seed);
    points
        .iter()
        .map(|p| {
            let s = scene.surface(p.triangle, p.u, p.v);
            (s.position, s.geometric_normal)
        })
        .collect()
}

/// A pair of a VPL and a receiver whose sides face each other, and whether a ray between them meets nothing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) vpl: usize,
    pub(crate) receiver: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) visible: bool,
}

/// Every receiver with `each` of the VPLs, drawn at random.
pub(crate) fn pairs(accel: &Accel<'_>, vpls: &[Vpl], receivers: &[(Vec3, Vec3)], each: u32) -> Vec<Pair> {
    (0..receivers.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let (receiver, normal) = receivers[i];
            (0..each).filter_map(move |k| {
                let [r, ..] = philox4x32([i as u32, k, 0, 0], [7, 7]);
                let j = (f64::from(unit_f32(r)) * vpls.len() as f64) as usize;
                let vpl = &vpls[j];
                let v = vpl.position - receiver;
                let normal = if normal.dot(v) < 0.0 { -normal } else { normal };
                (vpl.normal.dot(v) < 0.0).then(|| Pair {
                    vpl: j,
                    receiver,
                    normal,
                    visible: traced(accel, vpl, receiver, normal),
                })
            })
        })
        .collect()
}

/// Whether a ray from the VPL to a receiver meets nothing.
pub(crate) fn traced(accel: &Accel<'_>, vpl: &Vpl, receiver: Vec3, normal: Vec3) -> bool {
    let a = offset_ray_origin_scaled(vpl.position, vpl.normal, accel.unit());
    let b = offset_ray_origin_scaled(receiver, normal, accel.unit());
    !accel.any_hit(&Ray { origin: a, direction: b - a, t_max: 1.0 })
}

/// Shares of all pairs, percent: `leak` are those that the rays find blocked and the maps visible, `shade` the reverse.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wrong {
    pub(crate) leak: f64,
    pub(crate) shade: f64,
}

impl Wrong {
    pub(crate) fn of(pairs: &[Pair], visible: impl Fn(&Pair) -> bool + Sync) -> Self {
        let count = |truth: bool| {
            let wrong = pairs.par_iter().filter(|p| p.visible == truth && visible(p) != truth).count();
            100.0 * wrong as f64 / pairs.len().max(1) as f64
        };
        Self { leak: count(false), shade: count(true) }
    }

    pub(crate) fn sum(self) -> f64 {
        self.leak + self.shade
    }
}

/// A scene with VPLs, and pairs whose truth is known.
pub(crate) struct Stage<'a> {
    pub(crate) accel: Accel<'a>,
    pub(crate) vpls: Vec<Vpl>,
    pub(crate) pairs: Vec<Pair>,
}

impl<'a> Stage<'a> {
    /// 128 VPLs, 2000 receivers and 16 VPLs for each of these, by this seed.
    pub(crate) fn new(scene: &'a Scene, seed: u32) -> Self {
        Self::with(scene, 128, seed)
    }

    pub(crate) fn with(scene: &'a Scene, count: u32, seed: u32) -> Self {
        let accel = Accel::build(scene, BuildPreset::Fast);
        let vpls = vpls(&accel, count, seed);
        let pairs = pairs(&accel, &vpls, &receivers(scene, 2000, seed), 16);
        Self { accel, vpls, pairs }
    }

    pub(crate) fn points(&self, options: &Options, seed: u32) -> Vec<Point> {
        let scene = self.accel.scene();
        resolve(scene, &place(scene, options.points, &[], options.placement, seed))
    }

    /// Errors of the query with the receivers' normals.
    pub(crate) fn wrong(&self, atlas: &Atlas) -> Wrong {
        Wrong::of(&self.pairs, |p| atlas.visible_surface(p.vpl, p.receiver, p.normal))
    }

    /// Errors of maps made with these options.
    pub(crate) fn built(&self, options: Options, seed: u32) -> Wrong {
        self.wrong(&build(&self.vpls, &self.points(&options, seed), &options))
    }
}
