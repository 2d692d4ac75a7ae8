//! Which windows into the scene a light needs, fitted to the scene's bounds. No constant here has a unit.

use glam::{Vec2, Vec3};
use indirect_core::{Aabb, Light, LightKind, MapView, Projection, Scene, View};

use crate::layout::LightMap;

/// Widest cone, as the tangent of its half angle (60°), that one map covers. Beyond it the corner texels of a single map
/// shrink to less than 1/18 of the central solid angle, and the faces of a cube are the better use of texels.
const WIDEST_SINGLE_MAP: f32 = 1.732_050_8;

/// Narrowest cone half angle, as its tangent, that a map is made for; a cone of no opening has no flux.
const NARROWEST_MAP: f32 = 1e-4;

/// Nearest depth as a fraction of the farthest: what is closer to a light than this is not seen by its map.
const NEAR_OVER_FAR: f32 = 1e-5;

/// Slack of fitted depth ranges, relative to their size, against rounding of positions on the boundary.
const DEPTH_SLACK: f32 = 1e-3;

/// The maps of all lights of a scene that have power and can see its bounds, in the order of the lights.
///
/// * Spot: a square perspective map around the outer cone; beyond a half angle of 60° the five cube faces that the cone
///   can reach, each 90° wide.
/// * Point: the six faces of a cube.
/// * Directional: an orthographic map, fitted to the vertices in the light's own frame.
#[must_use]
pub fn views(scene: &Scene) -> Vec<MapView> {
    let Some(bounds) = scene.bounds().filter(|b| b.diagonal() > 0.0) else { return Vec::new() };
    let lit = scene.lights.iter().enumerate().filter(|(_, l)| l.power.max_element() > 0.0);
    lit.flat_map(|(light, l)| {
        let views =
            light_views(l, &bounds, |d| directional(d, scene.mesh.positions.iter().copied(), &bounds));
        views.into_iter().map(move |view| MapView { light, view })
    })
    .collect()
}

/// The maps of one light that shines on a scene within `bounds`, without a look at its vertices: for renderers whose scene moves and
/// that know its bounds. A directional light's map holds the whole box, at worst twice as wide and high as what [`views`] fits to the
/// vertices. No map for a light without power, or that cannot see the bounds.
#[must_use]
pub fn of(light: &Light, bounds: &Aabb) -> Vec<View> {
    if light.power.max_element() > 0.0 && bounds.diagonal() > 0.0 {
        light_views(light, bounds, |d| directional(d, bounds.corners(), bounds))
    } else {
        Vec::new()
    }
}

/// The maps of one light; `parallel` makes that of a directional one.
fn light_views(light: &Light, bounds: &Aabb, parallel: impl Fn(Vec3) -> Option<View>) -> Vec<View> {
    let range = light.range.unwrap_or(f32::INFINITY);
    let face = |origin: Vec3, forward: Vec3, up: Vec3, tan_half: f32| {
        perspective(origin, forward, up, tan_half, range, bounds)
    };
    match light.kind {
        LightKind::Directional { direction } => parallel(direction).into_iter().collect(),
        LightKind::Point { position } => [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
            .into_iter()
            .filter_map(|forward| {
                let up = if forward.y == 0.0 { Vec3::Y } else { Vec3::Z };
                face(position, forward, up, 1.0)
            })
            .collect(),
        LightKind::Spot { position, direction, outer_angle, .. } => {
            let tan_half = outer_angle.tan();
            if (0.0..=WIDEST_SINGLE_MAP).contains(&tan_half) {
                let view = face(position, direction, Vec3::Y, tan_half.max(NARROWEST_MAP));
                return view.into_iter().collect();
            }
            let (t, b) = indirect_core::math::orthonormal_basis(direction);
            [(direction, t), (t, direction), (-t, direction), (b, direction), (-b, direction)]
                .into_iter()
                .filter_map(|(forward, up)| face(position, forward, up, 1.0))
                .collect()
        }
    }
}

/// A perspective view whose depth range spans `bounds`, but not beyond the light's `range`; `None` where the bounds lie
/// behind it.
fn perspective(
    origin: Vec3,
    forward: Vec3,
    up: Vec3,
    tan_half: f32,
    range: f32,
    bounds: &Aabb,
) -> Option<View> {
    let depths = bounds.corners().map(|c| (c - origin).dot(forward));
    let min = depths.into_iter().fold(f32::INFINITY, f32::min);
    let max = depths.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let far = (max + DEPTH_SLACK * bounds.diagonal()).min(range);
    let near = (min - DEPTH_SLACK * bounds.diagonal()).max(NEAR_OVER_FAR * far);
    let projection = Projection::Perspective { tan_half: Vec2::splat(tan_half) };
    (max > 0.0 && near < far).then(|| View::look_to(origin, forward, up, projection, near, far))
}

/// The orthographic view along `direction` that holds every point and no more.
fn directional(direction: Vec3, points: impl IntoIterator<Item = Vec3>, bounds: &Aabb) -> Option<View> {
    let projection = |half_size| Projection::Orthographic { half_size };
    let centre = bounds.centre();
    let frame = View::look_to(centre, direction, Vec3::Y, projection(Vec2::ONE), 0.0, 1.0);
    // Relative to the centre, so that a scene far from the origin is fitted as tightly.
    let fitted = Aabb::of(points.into_iter().map(|p| {
        let v = p - centre;
        Vec3::new(v.dot(frame.right), v.dot(frame.up), v.dot(frame.forward))
    }))?;
    let slack = DEPTH_SLACK * bounds.diagonal();
    let middle = fitted.centre();
    // A scene seen edge-on has no width; it also receives no light, and the map only needs to be finite.
    let half_size = (fitted.extent().truncate() * 0.5).max(Vec2::splat(slack));
    let origin =
        centre + frame.right * middle.x + frame.up * middle.y + frame.forward * (fitted.min.z - slack);
    let depth = fitted.extent().z + 2.0 * slack;
    Some(View { origin, projection: projection(half_size), near: 0.0, far: depth, ..frame })
}

impl LightMap {
    /// What the `flux` pass needs to know of `light` seen through `view`.
    #[must_use]
    pub fn new(light: &Light, view: &View, resolution: u32) -> Self {
        let (half, orthographic) = match view.projection {
            Projection::Perspective { tan_half } => (tan_half, 0),
            Projection::Orthographic { half_size } => (half_size, 1),
        };
        let (axis, cos_outer, spot_scale) = match light.kind {
            LightKind::Spot { direction, inner_angle, outer_angle, .. } => {
                let (ci, co) = (inner_angle.cos(), outer_angle.cos());
                (direction, co, 1.0 / (ci - co).max(0.001))
            }
            LightKind::Directional { .. } | LightKind::Point { .. } => (view.forward, -2.0, 1.0),
        };
        Self {
            right: view.right,
            half_width: half.x,
            up: view.up,
            half_height: half.y,
            forward: view.forward,
            orthographic,
            power: light.power,
            inverse_range: light.range.map_or(0.0, |r| 1.0 / r),
            axis,
            cos_outer,
            spot_scale,
            resolution,
            pad0: 0,
            pad1: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_core::Material;

    fn scene(kind: LightKind) -> Scene {
        let mut scene =
            Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
        let (x, y, z) = (Vec3::X, Vec3::Y * 0.3, Vec3::Z * 2.0);
        scene.mesh.push_polygon(&[-x + z, x + z, x - z, -x - z], 0);
        scene.mesh.push_polygon(&[-x - z, x - z, x - z + y, -x - z + y], 0);
        scene.lights.push(Light { name: String::new(), kind, power: Vec3::ONE, range: None });
        scene
    }

    #[test]
    fn bounds_alone_give_the_maps_that_vertices_give_or_larger_ones() {
        let (position, direction) = (Vec3::new(0.2, 2.0, 0.1), Vec3::new(0.3, -1.0, 0.4).normalize());
        let spot = |outer_angle| LightKind::Spot { position, direction, inner_angle: 0.1, outer_angle };
        for kind in
            [spot(0.5), spot(1.4), LightKind::Point { position }, LightKind::Directional { direction }]
        {
            let scene = scene(kind);
            let bounds = scene.bounds().unwrap();
            let (found, fitted) = (of(&scene.lights[0], &bounds), views(&scene));
            assert_eq!(found.len(), fitted.len());
            for (found, fitted) in found.iter().zip(&fitted) {
                let (Projection::Orthographic { half_size: a }, Projection::Orthographic { half_size: b }) =
                    (found.projection, fitted.view.projection)
                else {
                    assert_eq!(*found, fitted.view);
                    continue;
                };
                assert!(a.cmpge(b).all() && a.cmple(2.0 * b).all(), "{a} for {b}");
                let seen = |view: &View, p: Vec3| {
                    let at = view.image_point(p).unwrap_or(Vec2::splat(-1.0));
                    let depth = view.depth(p);
                    at.cmpge(Vec2::ZERO).all()
                        && at.cmple(Vec2::ONE).all()
                        && (0.0..=view.far).contains(&depth)
                };
                assert!(bounds.corners().iter().all(|p| seen(found, *p)));
                let half = Aabb { min: bounds.min * 0.5, max: bounds.max * 0.5 };
                let small = of(&scene.lights[0], &half);
                assert!(!bounds.corners().iter().all(|p| seen(&small[0], *p)), "any map would do");
            }
        }
    }

    #[test]
    fn no_map_without_power_or_extent() {
        let mut scene = scene(LightKind::Point { position: Vec3::Y });
        let bounds = scene.bounds().unwrap();
        assert!(of(&scene.lights[0], &Aabb { max: bounds.min, ..bounds }).is_empty());
        scene.lights[0].power = Vec3::ZERO;
        assert!(of(&scene.lights[0], &bounds).is_empty());
    }
}
