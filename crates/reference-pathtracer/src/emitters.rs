use glam::{Vec2, Vec3};
use indirect_core::{AlphaMode, Scene, math};
use indirect_sampling::mapping;

/// The emissive triangles, drawn with a density proportional to the luminance they emit.
#[derive(Debug)]
pub(crate) struct Emitters {
    triangles: Vec<Emissive>,
    /// Running share of the power, ends at 1.
    cumulative: Vec<f64>,
    /// Probability per m² of a point of each material's triangles: its mean luminance over the power of all.
    density: Vec<f32>,
    flux: f64,
}

#[derive(Debug)]
struct Emissive {
    v0: Vec3,
    e1: Vec3,
    e2: Vec3,
    normal: Vec3,
    two_sided: bool,
    /// Whether an alpha test may cut holes into it.
    masked: bool,
    /// Where not textured.
    radiance: Option<Vec3>,
    inverse_density: f32,
    triangle: u32,
}

/// A point drawn on an emissive triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EmitterPoint {
    pub(crate) position: Vec3,
    /// Unit normal of the front.
    pub(crate) normal: Vec3,
    pub(crate) two_sided: bool,
    /// Emitted radiance; 0 where the alpha test leaves a hole.
    pub(crate) radiance: Vec3,
    /// 1 / probability density per m².
    pub(crate) inverse_density: f32,
}

impl Emitters {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mesh = &scene.mesh;
        // The mean over the texture, holes included, stands for the mean over a triangle: where they differ the density is off
        // its ideal, and the weights make up for it.
        let strength: Vec<f64> = scene
            .materials
            .iter()
            .map(|m| match m.emission_texture {
                Some(t) if m.is_emissive() => {
                    let texture = &scene.textures[t.texture as usize];
                    let sum = texture.texels.iter().fold(glam::DVec3::ZERO, |s, t| {
                        s + glam::DVec3::new(f64::from(t[0]), f64::from(t[1]), f64::from(t[2]))
                    });
                    let mean = sum / (65535.0 * texture.texels.len() as f64);
                    f64::from(math::luminance(m.emission * mean.as_vec3()))
                }
                _ => f64::from(math::luminance(m.emission)),
            })
            .collect();
        let (mut triangles, mut cumulative, mut total) = (Vec::new(), Vec::new(), 0.0);
        for (t, &m) in mesh.materials.iter().enumerate() {
            let power = strength[m as usize] * f64::from(mesh.area(t as u32));
            if power > 0.0 {
                total += power;
                triangles.push(t as u32);
                cumulative.push(total);
            }
        }
        cumulative.iter_mut().for_each(|c| *c /= total);
        let density: Vec<f32> =
            strength.iter().map(|s| if total > 0.0 { (s / total) as f32 } else { 0.0 }).collect();
        let emissive = |triangle: u32| {
            let [v0, b, c] = mesh.corners(triangle);
            let m = mesh.materials[triangle as usize] as usize;
            let material = &scene.materials[m];
            Emissive {
                v0,
                e1: b - v0,
                e2: c - v0,
                normal: mesh.geometric_normal(triangle),
                two_sided: material.double_sided,
                masked: material.alpha_mode != AlphaMode::Opaque,
                radiance: material.emission_texture.is_none().then_some(material.emission),
                inverse_density: 1.0 / density[m],
                triangle,
            }
        };
        Self {
            triangles: triangles.into_iter().map(emissive).collect(),
            cumulative,
            density,
            flux: core::f64::consts::PI * total,
        }
    }

    /// Luminance of the flux of all to one side, W.
    pub(crate) fn flux(&self) -> f64 {
        self.flux
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Probability per m² with which [`Emitters::sample`] draws a point of this triangle.
    #[inline]
    pub(crate) fn density(&self, scene: &Scene, triangle: u32) -> f32 {
        self.density[scene.mesh.materials[triangle as usize] as usize]
    }

    /// Draws a point from a uniform `u`; there must be a triangle. `u.x` chooses the triangle and is stretched to be used
    /// again, so that a stratified `u` stratifies both; `fresh` supplies the digits that this costs.
    #[inline]
    pub(crate) fn sample(&self, scene: &Scene, u: Vec2, fresh: impl FnOnce() -> f32) -> EmitterPoint {
        let mut x = f64::from(u.x);
        if self.triangles.len() > 256 {
            x += f64::from(fresh()) * 2.0_f64.powi(-24);
        }
        let last = self.triangles.len() - 1;
        let i = self.cumulative.partition_point(|&c| c <= x).min(last);
        let lo = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let stretched = ((x - lo) / (self.cumulative[i] - lo)) as f32;
        let b = mapping::triangle_uniform(Vec2::new(stretched.clamp(0.0, 1.0), u.y));
        let Emissive { v0, e1, e2, normal, two_sided, masked, radiance, inverse_density, triangle } =
            self.triangles[i];
        let position = v0 + e1 * b.x + e2 * b.y;
        // Rays pass through a hole, so what is drawn there must not emit either.
        let radiance = if masked && !scene.is_solid(triangle, b.x, b.y) {
            Vec3::ZERO
        } else {
            radiance.unwrap_or_else(|| scene.emission(triangle, b.x, b.y))
        };
        EmitterPoint { position, normal, two_sided, radiance, inverse_density }
    }
}
