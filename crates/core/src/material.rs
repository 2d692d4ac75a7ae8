use glam::{Affine2, Vec2, Vec3, Vec4};

/// How a texture coordinate outside `[0, 1]` is brought back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// Every other repetition is mirrored.
    Mirror,
    /// The border texel extends.
    Clamp,
}

/// A linear RGBA texture, 16-bit unsigned normalized per channel: the same bits on CPU and GPU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    /// Name, for messages.
    pub name: String,
    /// Width and height, texels, both at least 1.
    pub size: [u32; 2],
    /// Row-major, top row first; linear, 65535 is 1.0.
    pub texels: Vec<[u16; 4]>,
    /// Wrap mode of u and v.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// One texel as RGBA in `[0, 1]`.
    #[must_use]
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Vec4 {
        let t = self.texels[(y * self.size[0] + x) as usize];
        Vec4::new(f32::from(t[0]), f32::from(t[1]), f32::from(t[2]), f32::from(t[3])) / 65535.0
    }

    /// Bilinear lookup at `uv` (glTF: `(0, 0)` is the top left corner of the image).
    #[must_use]
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let size = Vec2::new(self.size[0] as f32, self.size[1] as f32);
        // Wrapped before it is scaled, so that a large coordinate keeps the digits of its fraction.
        let p = Vec2::new(wrap(uv.x, self.wrap[0]), wrap(uv.y, self.wrap[1])) * size - 0.5;
        let base = p.floor();
        let f = p - base;
        let ix = |offset: f32| neighbour(base.x + offset, self.size[0], self.wrap[0]);
        let iy = |offset: f32| neighbour(base.y + offset, self.size[1], self.wrap[1]);
        let top = self.texel(ix(0.0), iy(0.0)).lerp(self.texel(ix(1.0), iy(0.0)), f.x);
        let bottom = self.texel(ix(0.0), iy(1.0)).lerp(self.texel(ix(1.0), iy(1.0)), f.x);
        top.lerp(bottom, f.y)
    }
}

/// Brings a coordinate into `[0, 1]`; anything not finite becomes 0.
#[inline]
fn wrap(c: f32, mode: Wrap) -> f32 {
    if !c.is_finite() {
        return 0.0;
    }
    match mode {
        Wrap::Repeat => c - c.floor(),
        Wrap::Mirror => {
            let t = c - 2.0 * (c * 0.5).floor();
            if t > 1.0 { 2.0 - t } else { t }
        }
        Wrap::Clamp => c.clamp(0.0, 1.0),
    }
}

/// The texel index of `i`, which lies within one texel of `[0, n)`.
#[inline]
fn neighbour(i: f32, n: u32, mode: Wrap) -> u32 {
    let last = n - 1;
    if i < 0.0 {
        if mode == Wrap::Repeat { last } else { 0 }
    } else if i as u32 > last {
        if mode == Wrap::Repeat { 0 } else { last }
    } else {
        i as u32
    }
}

/// A texture with the transform of its coordinates (`KHR_texture_transform`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`](crate::Scene::textures).
    pub texture: u32,
    /// Applied to the mesh's texture coordinate before the lookup.
    pub uv_transform: Affine2,
}

/// What a surface does where its texture is transparent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface exists only where alpha is at least `cutoff`.
    Mask {
        /// `[0, 1]`.
        cutoff: f32,
    },
}

/// A glTF metallic-roughness material as this workspace uses it: Lambertian with albedo = base colour × (1 − metallic),
/// reflecting on both sides; emission on both sides only where `double_sided`.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, for messages.
    pub name: String,
    /// Linear base colour, `[0, 1]`.
    pub base_color: Vec3,
    /// Alpha factor, `[0, 1]`, multiplied with the texture's.
    pub base_alpha: f32,
    /// Multiplies `base_color` and `base_alpha`.
    pub base_color_texture: Option<TextureRef>,
    /// `[0, 1]`.
    pub metallic: f32,
    /// Perceptual roughness, `[0, 1]`.
    pub roughness: f32,
    /// Its blue channel multiplies `metallic`, its green channel `roughness`.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Share of light that passes through instead of being reflected diffusely, `[0, 1]`. Only Whitted ray tracing models it; else the
    /// surface is opaque.
    pub transmission: f32,
    /// Index of refraction behind the surface, at least 1.
    pub ior: f32,
    /// Emitted radiance, W/(sr·m²).
    pub emission: Vec3,
    /// Multiplies `emission`.
    pub emission_texture: Option<TextureRef>,
    /// Alpha test.
    pub alpha_mode: AlphaMode,
    /// Whether the back face emits too. Reflection is always two-sided.
    pub double_sided: bool,
}

impl Default for Material {
    /// A white, rough, one-sided, non-emitting dielectric: glTF's default but for `metallic`, which is 0 here.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::ONE,
            base_alpha: 1.0,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            transmission: 0.0,
            ior: 1.5,
            emission: Vec3::ZERO,
            emission_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// A diffuse material of the given albedo.
    #[must_use]
    pub fn diffuse(name: &str, albedo: Vec3) -> Self {
        Self { name: name.to_owned(), base_color: albedo, ..Self::default() }
    }

    /// Whether any point of the surface emits.
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        self.emission.max_element() > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(wrap: Wrap) -> Texture {
        let (o, i) = ([0, 0, 0, 65535], [65535, 65535, 65535, 65535]);
        Texture { name: "checker".into(), size: [2, 2], texels: vec![o, i, i, o], wrap: [wrap; 2] }
    }

    #[test]
    fn bilinear_hits_texel_centres_and_wraps() {
        for mode in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let t = checker(mode);
            assert_eq!(t.sample(Vec2::new(0.25, 0.25)).x, 0.0, "{mode:?}");
            assert_eq!(t.sample(Vec2::new(0.75, 0.25)).x, 1.0, "{mode:?}");
            assert_eq!(t.sample(Vec2::new(0.5, 0.5)).x, 0.5, "{mode:?}");
        }
        assert_eq!(checker(Wrap::Repeat).sample(Vec2::new(0.0, 0.25)).x, 0.5);
        assert_eq!(checker(Wrap::Clamp).sample(Vec2::new(0.0, 0.25)).x, 0.0);
        assert_eq!(checker(Wrap::Clamp).sample(Vec2::new(7.0, 0.25)).x, 1.0);
        assert_eq!(checker(Wrap::Mirror).sample(Vec2::new(1.25, 0.25)).x, 1.0);
        assert_eq!(checker(Wrap::Repeat).sample(Vec2::new(-0.75, 0.25)).x, 0.0);
    }

    #[test]
    fn no_coordinate_reads_outside() {
        for mode in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let t = checker(mode);
            for c in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30, -1e-30, 1.0, 0.999_999_94, -0.0] {
                assert!(t.sample(Vec2::new(c, c)).is_finite(), "{mode:?} {c}");
            }
        }
    }
}
