use core::hash::Hasher;

use glam::Vec3;
use indirect_core::{AlphaMode, LightKind, Material, Projection, Scene, TextureRef, View};
use siphasher::sip128::{Hasher128, SipHasher13};

use crate::{Bounces, Settings};

/// Changes whenever the estimator does, so that older stored results are not taken for new ones.
const VERSION: u32 = 4;

/// Hash of everything an estimate depends on but the sample range: the same on every platform and in every process.
pub(crate) fn key(scene: &Scene, view: &View, size: [u32; 2], settings: &Settings) -> u128 {
    let mut h = Key(SipHasher13::new());
    h.u32(VERSION);
    h.scene(scene);
    h.view(view);
    h.u32s(&size);
    h.settings(settings);
    h.0.finish128().as_u128()
}

/// [`key`] of an estimate at points.
pub(crate) fn of_points(scene: &Scene, points: &[Vec3], normals: &[Vec3], settings: &Settings) -> u128 {
    let mut h = Key(SipHasher13::new());
    h.u32(VERSION);
    h.scene(scene);
    for list in [points, normals] {
        h.len(list.len());
        list.iter().for_each(|v| h.f32s(&v.to_array()));
    }
    h.settings(settings);
    h.0.finish128().as_u128()
}

struct Key(SipHasher13);

impl Key {
    fn u32(&mut self, v: u32) {
        self.0.write(&v.to_le_bytes());
    }

    fn u32s(&mut self, v: &[u32]) {
        v.iter().for_each(|&v| self.u32(v));
    }

    fn f32s(&mut self, v: &[f32]) {
        v.iter().for_each(|&v| self.u32(v.to_bits()));
    }

    /// A length goes in front of every list, so that lists cannot borrow from each other.
    fn len(&mut self, v: usize) {
        self.0.write(&(v as u64).to_le_bytes());
    }

    fn settings(&mut self, s: &Settings) {
        let Settings {
            components,
            bounces,
            unoccluded,
            samples,
            // Only when to stop, not what is estimated.
            noise_target: _,
            seed,
            pixel_filter,
            emitters,
            virtual_lights,
            roulette,
        } = *s;
        let bounces = match bounces {
            Bounces::Count(n) => [0, n],
            Bounces::Infinite => [1, 0],
        };
        self.u32s(&bounces);
        let flags = [unoccluded, roulette].map(u32::from);
        self.u32s(&flags);
        self.u32s(&[components as u32, pixel_filter as u32, emitters as u32, virtual_lights as u32]);
        self.u32s(&[samples.batch, seed]);
    }

    fn view(&mut self, v: &View) {
        for axis in [v.origin, v.right, v.up, v.forward] {
            self.f32s(&axis.to_array());
        }
        let (kind, half) = match v.projection {
            Projection::Perspective { tan_half } => (0, tan_half),
            Projection::Orthographic { half_size } => (1, half_size),
        };
        self.u32(kind);
        self.f32s(&[half.x, half.y, v.near, v.far]);
    }

    fn scene(&mut self, s: &Scene) {
        let mesh = &s.mesh;
        for list in [&mesh.positions, &mesh.normals, &mesh.colors] {
            self.len(list.len());
            list.iter().for_each(|v| self.f32s(&v.to_array()));
        }
        self.len(mesh.uvs.len());
        mesh.uvs.iter().for_each(|v| self.f32s(&v.to_array()));
        self.len(mesh.triangles.len());
        mesh.triangles.iter().for_each(|t| self.u32s(t));
        self.u32s(&mesh.materials);
        self.len(s.materials.len());
        s.materials.iter().for_each(|m| self.material(m));
        self.len(s.textures.len());
        for t in &s.textures {
            self.u32s(&[t.size[0], t.size[1], t.wrap[0] as u32, t.wrap[1] as u32]);
            for &[r, g, b, a] in &t.texels {
                self.u32s(&[u32::from(r) << 16 | u32::from(g), u32::from(b) << 16 | u32::from(a)]);
            }
        }
        self.len(s.lights.len());
        for l in &s.lights {
            match l.kind {
                LightKind::Directional { direction } => {
                    self.u32(0);
                    self.f32s(&direction.to_array());
                }
                LightKind::Point { position } => {
                    self.u32(1);
                    self.f32s(&position.to_array());
                }
                LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                    self.u32(2);
                    self.f32s(&position.to_array());
                    self.f32s(&direction.to_array());
                    self.f32s(&[inner_angle, outer_angle]);
                }
            }
            self.f32s(&l.power.to_array());
            self.f32s(&[l.range.unwrap_or(f32::INFINITY)]);
        }
    }

    fn material(&mut self, m: &Material) {
        self.f32s(&m.base_color.to_array());
        self.f32s(&[m.base_alpha, m.metallic]);
        self.f32s(&m.emission.to_array());
        for t in [m.base_color_texture, m.metallic_roughness_texture, m.emission_texture] {
            self.texture(t);
        }
        match m.alpha_mode {
            AlphaMode::Opaque => self.u32(0),
            AlphaMode::Mask { cutoff } => {
                self.u32(1);
                self.f32s(&[cutoff]);
            }
        }
        self.u32(u32::from(m.double_sided));
    }

    fn texture(&mut self, t: Option<TextureRef>) {
        self.u32(t.map_or(u32::MAX, |t| t.texture));
        if let Some(t) = t {
            self.f32s(&t.uv_transform.to_cols_array());
        }
    }
}
