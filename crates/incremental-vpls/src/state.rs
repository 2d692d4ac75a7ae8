//! The lights that are kept, and what happens to them in a frame.

use glam::{DVec3, Vec3};
use indirect_accel::Accel;
use indirect_core::math::offset_ray_origin_scaled;
use indirect_core::settings::{BadOption, Settings as _};
use indirect_core::{Light, Surface};
use rayon::prelude::*;
use rsm::Vpl;

use crate::frame::Frame;
use crate::pattern::Pattern;
use crate::settings::{Settings, Start};
use crate::sparse::even_point;

/// Sites that one thread tests at least: less is not worth a thread.
const PIECE: usize = 64;

/// What happened in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Update {
    /// Lights that were kept.
    pub reused: u32,
    /// Lights and empty directions that were given up: invalid, or where they were densest.
    pub removed: u32,
    /// Lights that are new.
    pub inserted: u32,
    /// Directions of the pattern, kept or new, in which the light meets no surface.
    pub empty: u32,
    /// Rays that were traced.
    pub rays: u32,
}

/// Where a direction of the pattern ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// On a surface, which may move: barycentric `(u, v)` of a triangle, and whether its front is lit.
    Surface { triangle: u32, u: f32, v: f32, front: bool },
    /// Nowhere, see [`Frame::empty_at`].
    Empty(Vec3),
}

/// A direction of the pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Site {
    place: Place,
    slot: u32,
    fresh: bool,
    /// Whether it was a light with flux in this or an earlier frame.
    listed: bool,
}

/// A lit surface point as the light sees it in this frame.
#[derive(Debug, Clone, Copy)]
struct Lit {
    position: Vec3,
    normal: Vec3,
    albedo: Vec3,
    distance: f32,
    cosine: f32,
}

/// A site in this frame: its point in the light's domain, and the surface there if there is one.
#[derive(Debug, Clone, Copy)]
struct Seen {
    site: Site,
    point: DVec3,
    lit: Option<Lit>,
}

/// The virtual point lights of one light, kept from frame to frame.
#[derive(Debug, Clone)]
pub struct State {
    settings: Settings,
    sites: Vec<Site>,
    vpls: Vec<Vpl>,
    slots: Vec<u32>,
    fresh: Vec<bool>,
}

impl State {
    /// A state without lights.
    ///
    /// # Errors
    /// [`BadOption`] where a setting is outside its range or `recalc_min` exceeds `recalc_max`.
    pub fn new(settings: Settings) -> Result<Self, BadOption> {
        settings.validate()?;
        Ok(Self { settings, sites: Vec::new(), vpls: Vec::new(), slots: Vec::new(), fresh: Vec::new() })
    }

    /// The settings it was made with.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The lights with flux, the oldest first.
    #[must_use]
    pub fn vpls(&self) -> &[Vpl] {
        &self.vpls
    }

    /// For each light its slot, `0..count`, which it has to itself for as long as it is kept: what was made for it
    /// alone (a shadow map, a list of what it sees) is found there.
    #[must_use]
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// For each light whether it is in the list for the first time: what its slot holds is that of another light.
    ///
    /// It may have been made in an earlier frame, if it had no flux then because the light that it comes from was
    /// switched off.
    #[must_use]
    pub fn fresh(&self) -> &[bool] {
        &self.fresh
    }

    /// Forgets all lights and makes as many anew, as the first [`State::update`] does.
    pub fn rebuild(&mut self, accel: &Accel<'_>, light: &Light) -> Update {
        let removed = self.sites.len() as u32;
        self.sites.clear();
        let update = self.update(accel, light);
        Update { removed, ..update }
    }

    /// The lights of the next frame: of `light` as it is now, in the scene of `accel` as it is now.
    ///
    /// A light stays while its surface still exists and lies in the light's domain, is lit from the same side, and
    /// nothing stands between; it goes with a surface that moves, as long as triangles keep their numbers. The fluxes
    /// of all lights follow from their Voronoi cells of this frame. A light that can send nothing anywhere (no scene,
    /// a position that is not finite, a cone without opening) leaves no lights.
    pub fn update(&mut self, accel: &Accel<'_>, light: &Light) -> Update {
        let before = core::mem::take(&mut self.sites);
        let mut update = Update { removed: before.len() as u32, ..Update::default() };
        self.vpls.clear();
        self.slots.clear();
        self.fresh.clear();
        let Some(frame) = Frame::new(light, accel, self.settings.density) else { return update };

        let valid: Vec<Option<Seen>> =
            before.par_iter().with_min_len(PIECE).map(|s| validate(&frame, accel, s)).collect();
        let mut seen: Vec<Seen> = valid.into_iter().flatten().collect();
        let points: Vec<DVec3> = seen.iter().map(|s| s.point).collect();
        let mut pattern = Pattern::new(frame.shape(), &points);
        let new = self.spread(&mut pattern, seen.len());
        let kept: Vec<usize> = (0..seen.len()).filter(|&id| pattern.point(id).is_some()).collect();
        update.removed -= kept.len() as u32;
        update.rays = (before.len() + new.len()) as u32;

        let free = free_slots(self.settings.count as usize, kept.iter().map(|&id| seen[id].site.slot));
        let rays: Vec<_> = new.into_iter().zip(free).collect();
        seen.par_extend(
            rays.into_par_iter().with_min_len(PIECE).map(|(p, slot)| trace(&frame, accel, p, slot)),
        );

        let cells = pattern.cells(|s| frame.held(s));
        for (id, s) in seen.iter().enumerate().filter(|(id, _)| pattern.point(*id).is_some()) {
            let mut site = s.site;
            match (&s.lit, site.fresh) {
                (None, _) => update.empty += 1,
                (Some(_), true) => update.inserted += 1,
                (Some(_), false) => update.reused += 1,
            }
            if let Some(vpl) = s.lit.and_then(|lit| reflect(&frame, &lit, cells[id])) {
                self.vpls.push(vpl);
                self.slots.push(site.slot);
                self.fresh.push(!site.listed);
                site.listed = true;
            }
            self.sites.push(site);
        }
        update
    }

    /// Makes room in the pattern and fills it; the new points, which follow the `kept` ones.
    fn spread(&self, pattern: &mut Pattern, kept: usize) -> Vec<DVec3> {
        let Settings { count, recalc_min, recalc_max, evenness, seed, start, .. } = self.settings;
        let count = count as usize;
        let most = (recalc_max as usize).min(count);
        let spacing = f64::from(evenness) * (pattern.shape().area() / count as f64).sqrt();
        pattern.remove_closer(most.saturating_sub(count - pattern.len()), spacing);
        let room = count - pattern.len();
        let new = room.clamp((recalc_min as usize).min(count), most);
        pattern.remove_densest(new.saturating_sub(room));
        if !pattern.is_empty() {
            return pattern.insert_sparsest(new, seed);
        }
        if start == Start::Dispersion {
            return pattern.insert_sparsest(count, seed);
        }
        let new: Vec<_> = (0..count as u32).map(|i| even_point(pattern.shape(), i, seed)).collect();
        let before = vec![DVec3::NAN; kept];
        *pattern = Pattern::new(pattern.shape(), &[before, new.clone()].concat());
        new
    }
}

/// The slots that no site has, in order.
fn free_slots(count: usize, used: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
    let mut free = vec![true; count];
    for slot in used {
        free[slot as usize] = false;
    }
    (0..count as u32).filter(move |&slot| free[slot as usize])
}

/// A site of the frame before as it is now; `None` where it is no longer valid.
fn validate(frame: &Frame<'_>, accel: &Accel<'_>, site: &Site) -> Option<Seen> {
    let site = Site { fresh: false, ..*site };
    match site.place {
        Place::Empty(v) => {
            let point = frame.point_of_empty(v)?;
            // Something came into the way: the direction is free for a light.
            (!accel.any_hit(&frame.ray(point))).then_some(Seen { site, point, lit: None })
        }
        Place::Surface { triangle, u, v, front } => {
            let scene = accel.scene();
            if triangle as usize >= scene.mesh.triangles.len() {
                return None;
            }
            let surface = scene.surface(triangle, u, v);
            let point = frame.point_of(surface.position)?;
            let (towards, distance) = frame.towards(surface.position)?;
            let facing = surface.geometric_normal.dot(towards);
            if facing == 0.0 || (facing > 0.0) != front {
                return None;
            }
            let (geometric, normal) = surface.facing(towards);
            let from = offset_ray_origin_scaled(surface.position, geometric, accel.unit());
            let lit = lit(&surface, normal, towards, distance);
            (!accel.any_hit(&frame.shadow_ray(from, towards, distance))).then_some(Seen {
                site,
                point,
                lit: Some(lit),
            })
        }
    }
}

/// A new site: where the ray of light of a point of the domain ends.
fn trace(frame: &Frame<'_>, accel: &Accel<'_>, point: DVec3, slot: u32) -> Seen {
    let ray = frame.ray(point);
    let found = accel.closest_hit(&ray).and_then(|hit| {
        let surface = accel.scene().surface(hit.triangle, hit.u, hit.v);
        let (towards, distance) = frame.towards(surface.position)?;
        let normal = surface.facing(towards).1;
        let front = surface.geometric_normal.dot(towards) > 0.0;
        let place = Place::Surface { triangle: hit.triangle, u: hit.u, v: hit.v, front };
        Some((place, lit(&surface, normal, towards, distance)))
    });
    let place = found.map_or_else(|| Place::Empty(frame.empty_at(point)), |f| f.0);
    Seen { site: Site { place, slot, fresh: true, listed: false }, point, lit: found.map(|f| f.1) }
}

fn lit(surface: &Surface, normal: Vec3, towards: Vec3, distance: f32) -> Lit {
    let Surface { position, albedo, .. } = *surface;
    Lit { position, normal, albedo, distance, cosine: normal.dot(towards) }
}

/// The light that a surface becomes with the flux and the solid angle (area, for a directional light) of its cell;
/// `None` without flux.
fn reflect(frame: &Frame<'_>, lit: &Lit, [flux, across]: [f64; 2]) -> Option<Vpl> {
    let window = frame.light.range_window(lit.distance);
    let flux = lit.albedo * frame.light.power * (flux as f32 * window);
    let area = frame.footprint(across, lit.distance, lit.cosine);
    let vpl = Vpl::new(lit.position, lit.normal, flux, area);
    (flux.is_finite() && flux.min_element() >= 0.0 && flux.max_element() > 0.0 && area.is_finite())
        .then_some(vpl)
}
