//! Queries of a [`FlatTree`]: the twin of `shaders/wgsl/accel/traverse.wgsl`, operation by operation.
//!
//! # Why nothing leaks
//!
//! WGSL has no f64 to find exact signs with, it may round either way, fuse a product with a sum, and err in a quotient by 2.5 ulp. So
//! an operation errs by up to `ε = 2⁻²³` of its result, and two triangles may see a common vertex differently. Instead of exact
//! signs, whatever may be inside counts, and a ray through a common edge or vertex meets all that share it.
//!
//! *Triangle.* As Woop, Benthin & Wald (2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)): vertices are moved and sheared so
//! that the ray is the z axis. With `d` the largest depth of a vertex along the axis of the ray's longest component, `s ≤ 1`
//! the larger slope of the ray against that axis, `w` the largest sheared |x| or |y|: a sheared vertex `x − s·z` errs by at most
//! `ε(|x| + 2s|z| + w) ≤ ε(3sd + 2w)`, below the `4ε(sd + w)` by which the triangle's rectangle is widened. An edge function, the
//! difference of two products of such coordinates, errs by `4w·ε(3sd + 2w)` through them and by `4εw²` through its own rounding, together
//! `12εw(sd + w)`; `16εw(sd + w)` is allowed. A triangle whose exact edge functions have one sign is therefore never missed;
//! one that the ray passes at up to about `32ε(sd + w)` of its plane's distances may be met too. The weights are clamped, so that the hit
//! is always a point of the triangle. A triangle that is seen so exactly from its edge that all three edge functions round to
//! 0 has no such point and is left to its neighbours, whose edges there are within their bounds.
//!
//! *Boxes.* With `D` the largest distance (in any axis) from the ray's origin to the bounds of all: sheared vertices
//! carry `5εD`, their slope `3.5εD`, the slab distances `4.5εD` at either end, the boxes of split triangles `6εD`, the hit distance `8εD`:
//! less than the `32εD` by which the ray's origin moves for near and far planes. Rounding that moved origin costs up to
//! `ε(|box| + D)`; boxes have grown by `4ε|box|`. Components of a direction below `2⁻³⁰` of the longest are taken as that
//! long there, which moves the ray by less than `εD/100`.
//!
//! All of it scales with the scene as long as no product leaves f32's normal range, below which a shader may round to 0: distances may
//! range from about 10⁻¹⁵ to 10¹⁵ m.

use glam::{Vec2, Vec3};
use indirect_core::{Hit, Ray};

use crate::flat::{FlatNode, FlatTree, FlatTriangle, STACK};
use crate::layout::LEAF;

/// How far the bounds are widened, in shares of what they are widened by (see the module).
#[derive(Clone, Copy)]
struct Slack {
    slab: f32,
    edge: f32,
    point: f32,
}

const SLACK: Slack =
    Slack { slab: 32.0 * f32::EPSILON, edge: 16.0 * f32::EPSILON, point: 4.0 * f32::EPSILON };

/// Directions count whose longest component lies in this range, `2⁻⁶⁴` to `2⁶⁴`.
const SHORTEST: f32 = 5.421_011e-20;
const LONGEST: f32 = 1.844_674_4e19;

/// `2⁻³⁰`: shorter components than this share of the longest are taken as that long where boxes are tested.
const LEAST_SLOPE: f32 = 9.313_226e-10;

/// For [`FlatTree::closest_hit`] and [`FlatTree::any_hit`]: masked triangles are as solid as others.
#[must_use]
#[inline]
pub const fn opaque(_triangle: u32, _u: f32, _v: f32) -> bool {
    true
}

impl FlatTree {
    /// The nearest hit with `0 ≤ t < ray.t_max`; of equally near ones that of the triangle with the smallest index. `None` for a ray
    /// whose direction is zero or shorter than `2⁻⁶⁴` or longer than `2⁶⁴` (by its longest component), that has a NaN, or
    /// infinity anywhere but in `t_max`.
    ///
    /// `solid` is asked for triangles with an alpha mask alone: [`opaque`], or
    /// `|triangle, u, v| scene.is_solid(triangle, u, v)`.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray, solid: impl Fn(u32, f32, f32) -> bool) -> Option<Hit> {
        self.closest(ray, solid, SLACK).0
    }

    /// Whether there is any hit with `0 ≤ t < ray.t_max`: the same answer as `closest_hit(ray, solid).is_some()`, sooner.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray, solid: impl Fn(u32, f32, f32) -> bool) -> bool {
        self.any(ray, solid, SLACK)
    }

    /// [`Self::closest_hit`] and how many pairs of boxes and triangles it looked at. A GPU looks at no more than 65 000
    /// (`ACCEL_ROUNDS`) and says so where that is not enough.
    #[must_use]
    pub fn closest_hit_counted(
        &self,
        ray: &Ray,
        solid: impl Fn(u32, f32, f32) -> bool,
    ) -> (Option<Hit>, usize) {
        self.closest(ray, solid, SLACK)
    }

    fn closest(
        &self,
        ray: &Ray,
        solid: impl Fn(u32, f32, f32) -> bool,
        slack: Slack,
    ) -> (Option<Hit>, usize) {
        let Some(ray) = Prepared::new(&self.nodes()[0], ray, slack) else { return (None, 0) };
        let mut best = Hit { t: ray.limit, u: 0.0, v: 0.0, triangle: u32::MAX };
        let (mut stack, mut height) = ([0_u32; STACK as usize], 0);
        let (mut link, mut rounds) = (0_u32, 0);
        loop {
            rounds += 1;
            let mut next = if link & LEAF != 0 {
                let triangle = &self.triangles()[(link & !LEAF) as usize];
                if let Some(hit) = ray.meet(triangle, best.t)
                    && (hit.t < best.t || hit.triangle < best.triangle)
                    && (triangle.flags & FlatTriangle::MASKED == 0 || solid(hit.triangle, hit.u, hit.v))
                {
                    best = hit;
                }
                if triangle.flags & FlatTriangle::LAST != 0 { 0 } else { link + 1 }
            } else {
                let node = &self.nodes()[link as usize];
                let first = ray.enter(node.lower_0, node.upper_0, best.t);
                let second = ray.enter(node.lower_1, node.upper_1, best.t);
                let child_0 = if first[0] <= first[1] { node.child_0 } else { 0 };
                let child_1 = if second[0] <= second[1] { node.child_1 } else { 0 };
                if child_0 != 0 && child_1 != 0 {
                    // The farther one waits.
                    let swap = second[0] < first[0];
                    stack[height] = if swap { child_0 } else { child_1 };
                    height += 1;
                    if swap { child_1 } else { child_0 }
                } else {
                    child_0 | child_1
                }
            };
            if next == 0 {
                if height == 0 {
                    return ((best.triangle != u32::MAX).then_some(best), rounds);
                }
                height -= 1;
                next = stack[height];
            }
            link = next;
        }
    }

    fn any(&self, ray: &Ray, solid: impl Fn(u32, f32, f32) -> bool, slack: Slack) -> bool {
        let Some(ray) = Prepared::new(&self.nodes()[0], ray, slack) else { return false };
        let (mut stack, mut height) = ([0_u32; STACK as usize], 0);
        let mut link = 0_u32;
        loop {
            let mut next;
            if link & LEAF != 0 {
                let triangle = &self.triangles()[(link & !LEAF) as usize];
                if let Some(hit) = ray.meet(triangle, ray.limit)
                    && (triangle.flags & FlatTriangle::MASKED == 0 || solid(hit.triangle, hit.u, hit.v))
                {
                    return true;
                }
                next = if triangle.flags & FlatTriangle::LAST != 0 { 0 } else { link + 1 };
            } else {
                let node = &self.nodes()[link as usize];
                let first = ray.enter(node.lower_0, node.upper_0, ray.limit);
                let second = ray.enter(node.lower_1, node.upper_1, ray.limit);
                let child_0 = if first[0] <= first[1] { node.child_0 } else { 0 };
                let child_1 = if second[0] <= second[1] { node.child_1 } else { 0 };
                next = child_0;
                if child_0 == 0 {
                    next = child_1;
                } else if child_1 != 0 {
                    stack[height] = child_1;
                    height += 1;
                }
            }
            if next == 0 {
                if height == 0 {
                    return false;
                }
                height -= 1;
                next = stack[height];
            }
            link = next;
        }
    }
}

/// A ray, prepared once for all boxes and triangles: WGSL's `AccelPrepared`.
struct Prepared {
    axis: usize,
    backward: [bool; 3],
    origin: Vec3,
    near_origin: Vec3,
    far_origin: Vec3,
    inverse: Vec3,
    shear: Vec3,
    lean: f32,
    limit: f32,
    slack: Slack,
}

/// The axes in cyclic order, `axis` last.
fn turn(v: Vec3, axis: usize) -> Vec3 {
    match axis {
        0 => Vec3::new(v.y, v.z, v.x),
        1 => Vec3::new(v.z, v.x, v.y),
        _ => v,
    }
}

fn select(a: Vec3, b: Vec3, which: [bool; 3]) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|i| if which[i] { b[i] } else { a[i] }))
}

impl Prepared {
    fn new(root: &FlatNode, ray: &Ray, slack: Slack) -> Option<Self> {
        let (origin, direction) = (ray.origin, ray.direction);
        let size = direction.abs();
        let axis = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let turned = turn(direction, axis);
        let longest = turned.z.abs();
        let valid = ray.t_max > 0.0
            && origin.is_finite()
            && direction.is_finite()
            && (SHORTEST..=LONGEST).contains(&longest);
        if !valid {
            return None;
        }
        let inverse = 1.0 / turned.z;
        let shear = Vec3::new(turned.x * inverse, turned.y * inverse, inverse);
        // No component is 0: no distance to a slab is 0/0.
        let least = Vec3::splat(longest * LEAST_SLOPE);
        let backward = direction.to_array().map(|d| d < 0.0);
        let short = [0, 1, 2].map(|i| size[i] < least[i]);
        let steep = select(direction, select(least, -least, backward), short);
        let of = Vec3::from_array;
        let above = of(root.upper_0).max(of(root.upper_1)) - origin;
        let below = origin - of(root.lower_0).min(of(root.lower_1));
        let reach = above.max(below).max_element().max(0.0);
        let margin = reach * slack.slab;
        Some(Self {
            axis,
            backward,
            origin,
            near_origin: select(origin + margin, origin - margin, backward),
            far_origin: select(origin - margin, origin + margin, backward),
            inverse: 1.0 / steep,
            shear,
            lean: shear.x.abs().max(shear.y.abs()),
            limit: ray.t_max.next_down(),
            slack,
        })
    }

    /// Parameters at which the ray enters and leaves a box within `[0, limit]`; it misses the box where the first is the larger.
    fn enter(&self, lower: [f32; 3], upper: [f32; 3], limit: f32) -> [f32; 2] {
        let (lower, upper) = (Vec3::from_array(lower), Vec3::from_array(upper));
        let near = (select(lower, upper, self.backward) - self.near_origin) * self.inverse;
        let far = (select(upper, lower, self.backward) - self.far_origin) * self.inverse;
        [near.max_element().max(0.0), far.min_element().min(limit)]
    }

    /// A vertex, moved and sheared so that the ray is the z axis.
    fn sheared(&self, vertex: [f32; 3]) -> Vec3 {
        let p = turn(Vec3::from_array(vertex) - self.origin, self.axis);
        Vec3::new(p.x - self.shear.x * p.z, p.y - self.shear.y * p.z, p.z)
    }

    /// Where the ray meets a triangle with `0 ≤ t ≤ limit`.
    fn meet(&self, triangle: &FlatTriangle, limit: f32) -> Option<Hit> {
        let [p, q, r] = [triangle.a, triangle.b, triangle.c].map(|v| self.sheared(v));
        let lower = p.truncate().min(q.truncate().min(r.truncate()));
        let upper = p.truncate().max(q.truncate().max(r.truncate()));
        let width = upper.x.max(-lower.x).max(upper.y.max(-lower.y));
        let depth = p.z.abs().max(q.z.abs().max(r.z.abs()));
        let spread = self.lean * depth + width;
        // Outside of the triangle's rectangle: what lies on the line of an edge, but beyond its ends, is not met.
        let point = Vec2::splat(self.slack.point * spread);
        if triangle.flags & FlatTriangle::VOID != 0 || lower.cmpgt(point).any() || upper.cmplt(-point).any() {
            return None;
        }
        let (a, b, c) = (edge(q, r), edge(r, p), edge(p, q));
        let slack = self.slack.edge * width * spread;
        if a.min(b.min(c)) < -slack && a.max(b.max(c)) > slack {
            return None;
        }
        // Weights of the nearest point that surely belongs to the triangle.
        let sign = if a + b + c < 0.0 { -1.0 } else { 1.0 };
        let w = (sign * Vec3::new(a, b, c)).max(Vec3::ZERO);
        let total = w.x + w.y + w.z;
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        let scale = 1.0 / total;
        let (u, v) = (w.y * scale, w.z * scale);
        let t = (p.z + (u * (q.z - p.z) + v * (r.z - p.z))) * self.shear.z;
        (t >= 0.0 && t <= limit).then_some(Hit { t, u, v, triangle: triangle.index })
    }
}

/// The edge function from `p` to `q` at the ray.
fn edge(p: Vec3, q: Vec3) -> f32 {
    q.x * p.y - q.y * p.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Accel, BuildPreset};
    use indirect_core::{Material, Scene};

    /// A closed, convex sphere of `2·n·n` triangles around the origin, its vertices shared.
    fn sphere(n: u32) -> Scene {
        let mut scene =
            Scene { materials: vec![Material::diffuse("m", Vec3::splat(0.5))], ..Scene::default() };
        for j in 0..=n {
            let theta = core::f32::consts::PI * j as f32 / n as f32;
            for i in 0..n {
                let phi = core::f32::consts::TAU * i as f32 / n as f32;
                // Sines that are not quite 0 at the poles would open the sphere there.
                let sin = if j == 0 || j == n { 0.0 } else { theta.sin() };
                let p = Vec3::new(sin * phi.cos(), theta.cos(), sin * phi.sin());
                scene.mesh.positions.push(p);
                scene.mesh.normals.push(Vec3::Y);
            }
        }
        let at = |j: u32, i: u32| j * n + i % n;
        for j in 0..n {
            for i in 0..n {
                scene.mesh.triangles.push([at(j, i), at(j, i + 1), at(j + 1, i + 1)]);
                scene.mesh.triangles.push([at(j, i), at(j + 1, i + 1), at(j + 1, i)]);
            }
        }
        scene.mesh.materials = vec![0; scene.mesh.triangles.len()];
        scene
    }

    /// How many rays from inside, aimed at the vertices and the middles of edges, leave the sphere.
    fn leaks(slack: Slack) -> usize {
        let scene = sphere(40);
        let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Fast));
        let mesh = &scene.mesh;
        let targets = mesh.triangles.iter().flat_map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5]
        });
        let leaks = targets.enumerate().filter(|(i, target)| {
            let origin = Vec3::new(0.1, 0.2, 0.3) * (i % 7) as f32 * 0.3;
            let ray = Ray::new(origin, *target - origin);
            tree.closest(&ray, opaque, slack).0.is_none() || !tree.any(&ray, opaque, slack)
        });
        leaks.count()
    }

    #[test]
    fn without_its_bounds_the_sphere_leaks() {
        assert_eq!(leaks(SLACK), 0);
        // What is within rounding of an edge left out, as it is where neighbours disagree about its sign.
        assert!(leaks(Slack { edge: -SLACK.edge, ..SLACK }) > 1000);
        assert!(leaks(Slack { point: -SLACK.point, ..SLACK }) > 0);
        // Boxes smaller by what they should be larger: only rays along a side of a box notice.
        assert!(leaks(Slack { slab: -SLACK.slab, ..SLACK }) > 0);
    }

    #[test]
    fn constants_are_the_powers_of_two_that_they_should_be() {
        assert_eq!((SHORTEST, LONGEST), (2.0_f32.powi(-64), 2.0_f32.powi(64)));
        assert_eq!(LEAST_SLOPE, 2.0_f32.powi(-30));
    }
}
