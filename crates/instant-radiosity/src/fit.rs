//! What a technique's frames need of a scene: made once, followed where it moves.

use std::sync::Arc;

use indirect_core::{Light, LightKind, Scene, math};
use indirect_sampling::rng::hash_combine;
use photon_tracing::{Emitters, solid_mean};

use crate::layout::{PointChoice, TriangleSurface};
use crate::settings::{Bounce, Options};
use crate::setup::{Fitted, Setup};

impl Setup {
    /// Virtual lights of a bounce that start in the lights' maps.
    pub(crate) fn map_lights(&self) -> u32 {
        self.options.per_bounce() - self.fitted.from_emitters
    }

    /// All slots of virtual lights, those on emitters behind the others.
    pub(crate) fn slots(&self) -> u32 {
        self.options.slots() + self.fitted.from_emitters
    }

    /// Of a run of `bounce`: the first source, how many, the first target, and the number of its sequence.
    pub(crate) fn run(&self, number: u32) -> BounceRun {
        let (n, emitters) = (self.options.per_bounce(), self.fitted.from_emitters);
        match number.checked_sub(u32::from(emitters > 0)) {
            None => {
                BounceRun { source: self.options.slots(), count: emitters, target: n - emitters, bounce: 0 }
            }
            Some(k) => BounceRun { source: k * n, count: n, target: (k + 1) * n, bounce: k + 1 },
        }
    }

    /// How a run of `bounce` chooses among points.
    pub(crate) fn choice(&self, run: BounceRun, frame: u32) -> PointChoice {
        let seed = hash_combine(hash_combine(self.params.seed, run.bounce), frame);
        let brightest = u32::from(self.options.bounce == Bounce::Brightest);
        PointChoice { each: self.options.points_per_map, brightest, seed, pad0: 0 }
    }

    /// What the random numbers of a frame's pixels begin with.
    pub(crate) const fn pixel_seed(&self, frame: u32) -> u32 {
        hash_combine(self.params.seed, frame)
    }

    /// What draws the lights that represent the branches of a frame's tree.
    pub(crate) const fn tree_seed(&self, frame: u32) -> u32 {
        hash_combine(self.pixel_seed(frame), 0x301)
    }

    /// Whether the last bounce stands for all that would follow: there is one before it to tell how much it keeps.
    pub(crate) fn has_tail(&self) -> bool {
        self.options.tail.is_on() && self.options.bounces > 1
    }

    /// Bounces whose lights the end of a path is lit by.
    pub(crate) fn path_bounces(&self) -> u32 {
        self.options.bounces - u32::from(!self.has_tail())
    }
}

/// Which virtual lights send rays, and where those that the rays find go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BounceRun {
    pub(crate) source: u32,
    pub(crate) count: u32,
    pub(crate) target: u32,
    pub(crate) bounce: u32,
}

impl Fitted {
    /// Looks at the scene once.
    #[must_use]
    pub fn new(accel: &indirect_accel::Accel<'_>, options: &Options) -> Self {
        let mut fitted = Self::with(accel, options);
        if options.has_points() {
            // The same points for every seed: they belong to the scene.
            let places =
                imperfect_shadow_maps::place(accel.scene(), options.points, &[], options.placement, 0);
            fitted.places = Arc::new(places);
            fitted.resolve(accel);
        }
        #[cfg(feature = "gpu")]
        let fitted = Self { tree: Arc::new(indirect_accel::FlatTree::of(accel)), ..fitted };
        fitted
    }

    fn resolve(&mut self, accel: &indirect_accel::Accel<'_>) {
        self.points = Arc::new(imperfect_shadow_maps::cpu::resolve(accel.scene(), &self.places));
    }

    /// All but what the GPU alone needs.
    fn with(accel: &indirect_accel::Accel<'_>, options: &Options) -> Self {
        let (scene, unit) = (accel.scene(), accel.unit());
        let mesh = &scene.mesh;
        let area = (0..mesh.triangles.len() as u32).map(|t| f64::from(mesh.area(t))).sum::<f64>() as f32;
        let Emitters { triangles: emitters, luminance: emitted, .. } = Emitters::new(scene);
        let from_emitters = Self::share(emitted, scene, options, unit);
        let surfaces = (0..mesh.triangles.len() as u32).map(|t| surface(scene, t)).collect();
        let follows = options.motion.is_on() && options.has_history();
        Self {
            emitters: Arc::new(emitters),
            emitted,
            from_emitters,
            surfaces: Arc::new(surfaces),
            places: Arc::default(),
            points: Arc::default(),
            area,
            unit,
            triangles: Arc::new(if follows { mesh.triangles.clone() } else { Vec::new() }),
            now: Arc::new(mesh.positions.clone()),
            before: Arc::default(),
            #[cfg(feature = "gpu")]
            tree: Arc::default(),
        }
    }

    /// Looks at a scene whose vertices may have moved since the frame before.
    pub fn refit(&mut self, accel: &indirect_accel::Accel<'_>, options: &Options) {
        if *self.now == accel.scene().mesh.positions {
            self.before = Arc::default();
            return;
        }
        let mut fitted = Self::with(accel, options);
        fitted.places = Arc::clone(&self.places);
        fitted.resolve(accel);
        #[cfg(feature = "gpu")]
        {
            // The lengths of buffers are fixed when they are made: the tree keeps its shape, and a scene of another size is refused there.
            fitted.tree = Arc::clone(&self.tree);
            if Arc::make_mut(&mut fitted.tree).refit(accel.scene()).is_err() {
                fitted.tree = Arc::new(indirect_accel::FlatTree::of(accel));
            }
        }
        // So is the number of virtual lights.
        fitted.from_emitters = if fitted.emitters.is_empty() { 0 } else { self.from_emitters };
        let before = core::mem::replace(self, fitted).now;
        if before.len() == self.now.len() && !self.triangles.is_empty() {
            self.before = before;
        }
    }

    /// Virtual lights that start at emitters: in proportion to their flux, and at least an eighth for either kind that there is.
    fn share(emitted: f32, scene: &Scene, options: &Options, unit: f32) -> u32 {
        let punctual: f32 = scene.lights.iter().map(|l| light_flux(l, unit)).sum();
        let (parts, all) = (options.parts(), options.per_bounce());
        if emitted <= 0.0 {
            return 0;
        }
        if punctual <= 0.0 {
            return all;
        }
        let share = (emitted / (emitted + punctual)).clamp(0.125, 0.875);
        ((share * (all / parts) as f32).round() as u32)
            .clamp(u32::from(all > parts), all / parts - u32::from(all > parts))
            * parts
    }
}

fn surface(scene: &Scene, triangle: u32) -> TriangleSurface {
    let mesh = &scene.mesh;
    let material = &scene.materials[mesh.materials[triangle as usize] as usize];
    let varies = material.base_color_texture.is_some()
        || material.metallic_roughness_texture.is_some()
        || !mesh.colors.is_empty();
    let albedo = if varies {
        solid_mean(scene, triangle, |u, v| scene.albedo(triangle, u, v)).0
    } else {
        scene.albedo(triangle, 0.25, 0.25)
    };
    TriangleSurface { normal: mesh.geometric_normal(triangle), albedo, ..TriangleSurface::default() }
}

/// Luminance of a light's flux, W; of a directional one, what falls onto a sphere around the scene.
fn light_flux(light: &Light, unit: f32) -> f32 {
    use core::f32::consts::PI;
    let power = math::luminance(light.power);
    match light.kind {
        LightKind::Point { .. } => 4.0 * PI * power,
        LightKind::Spot { inner_angle, outer_angle, .. } => {
            PI * power * (2.0 - inner_angle.cos() - outer_angle.cos())
        }
        LightKind::Directional { .. } => PI * 0.25 * unit * unit * power,
    }
}
