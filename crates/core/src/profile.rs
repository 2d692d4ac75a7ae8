use crate::{AlphaMode, LightKind, Scene};

/// What a scene has, decided once: techniques ask it what they need to model, and reports say what was skipped and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SceneProfile {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of triangles whose material emits.
    pub emissive_triangles: usize,
    /// Number of directional lights with power.
    pub directional_lights: usize,
    /// Number of point lights with power.
    pub point_lights: usize,
    /// Number of spot lights with power.
    pub spot_lights: usize,
    /// Whether any albedo comes from a texture.
    pub textured: bool,
    /// Whether any triangle has an alpha test.
    pub alpha_masked: bool,
    /// Whether any mesh has vertex colours.
    pub vertex_colors: bool,
    /// Number of triangles with a metallic part or a roughness below 1: candidates for gloss.
    pub glossy_triangles: usize,
}

impl SceneProfile {
    /// Looks at every triangle and light once.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let mut p = Self {
            triangles: scene.mesh.triangles.len(),
            vertex_colors: !scene.mesh.colors.is_empty(),
            ..Self::default()
        };
        for &m in &scene.mesh.materials {
            let m = &scene.materials[m as usize];
            p.emissive_triangles += usize::from(m.is_emissive());
            p.textured |= m.base_color_texture.is_some() || m.metallic_roughness_texture.is_some();
            p.alpha_masked |= m.alpha_mode != AlphaMode::Opaque;
            p.glossy_triangles += usize::from(m.metallic > 0.0 || m.roughness < 1.0);
        }
        for l in scene.lights.iter().filter(|l| l.power.max_element() > 0.0) {
            match l.kind {
                LightKind::Directional { .. } => p.directional_lights += 1,
                LightKind::Point { .. } => p.point_lights += 1,
                LightKind::Spot { .. } => p.spot_lights += 1,
            }
        }
        p
    }

    /// Number of punctual lights with power.
    #[must_use]
    pub const fn punctual_lights(&self) -> usize {
        self.directional_lights + self.point_lights + self.spot_lights
    }
}
