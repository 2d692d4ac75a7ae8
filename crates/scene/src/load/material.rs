//! Materials: factors, textures, alpha.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Affine2, Vec2, Vec3, Vec4};
use gltf::json::material::{AlphaMode as JsonAlpha, Material as Json};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use indirect_core::{AlphaMode, Material, Texture, TextureRef};
use rayon::prelude::*;

use super::file::{File, label};
use super::options::LoadOptions;
use super::texture::{self, Content, Request, Sharing};
use super::warnings::Warnings;
use crate::SceneLoadError;

/// The most textures of the largest size that a scene may hold; of smaller ones, accordingly more. 2 GB at the default size.
const MAX_TEXTURES: u64 = 4096;

/// All materials of a file and what the meshes need to know about them.
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    /// Per material, the set of texture coordinates it reads, if any.
    pub(super) uv_set: Vec<Option<u32>>,
}

/// A texture that a material asks for.
#[derive(Clone, Copy)]
struct Slot {
    request: Request,
    set: u32,
    transform: Affine2,
}

fn slot(info: &Info, content: Content) -> Slot {
    let mut slot = Slot {
        request: Request { texture: info.index.value(), content },
        set: info.tex_coord,
        transform: Affine2::IDENTITY,
    };
    if let Some(t) = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()) {
        // KHR_texture_transform turns counter-clockwise in an image whose v axis points down: the angle is negated.
        slot.transform = Affine2::from_scale_angle_translation(
            Vec2::from(t.scale.0),
            -t.rotation.0,
            Vec2::from(t.offset.0),
        );
        slot.set = t.tex_coord.unwrap_or(slot.set);
    }
    slot
}

/// The three texture slots of a material: base colour, metallic-roughness, emission.
fn slots(json: &Json) -> [Option<Slot>; 3] {
    let pbr = &json.pbr_metallic_roughness;
    let opaque = matches!(json.alpha_mode, Checked::Valid(JsonAlpha::Opaque) | Checked::Invalid);
    let base = if opaque { Content::Color } else { Content::ColorAlpha };
    [
        pbr.base_color_texture.as_ref().map(|t| slot(t, base)),
        pbr.metallic_roughness_texture.as_ref().map(|t| slot(t, Content::Linear)),
        json.emissive_texture.as_ref().map(|t| slot(t, Content::Color)),
    ]
}

/// Converts every material of the file; textures are only read for those that `used` marks. Its last entry, one past the
/// file's materials, stands for meshes without one.
pub(super) fn read(
    file: &File<'_>,
    used: &[bool],
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Materials, SceneLoadError> {
    let json = &file.root.materials;
    let mut requests = Vec::new();
    let mut numbers = HashMap::new();
    let mut sharing = Sharing::default();
    for (material, _) in json.iter().zip(used).filter(|(_, used)| **used) {
        for slot in slots(material).into_iter().flatten() {
            if numbers.contains_key(&slot.request) {
                continue;
            }
            let first = sharing.first(file, slot.request)?;
            let number = match numbers.get(&first) {
                Some(&number) => number,
                None => {
                    requests.push(first);
                    requests.len() - 1
                }
            };
            numbers.insert(slot.request, number);
        }
    }
    let texels = AtomicU64::new(0);
    // A small file may hold many images that are large once decoded: each adds to the sum before it is kept.
    let limit = MAX_TEXTURES * u64::from(options.max_texture_size.max(1)).pow(2);
    let read = |&request: &Request| {
        let texture = texture::read(file, request, options.max_texture_size)?;
        let own = texture.texels.len() as u64;
        let sum = texels.fetch_add(own, Ordering::Relaxed) + own;
        if sum > limit { Err("too many".to_owned()) } else { Ok(texture) }
    };
    let images: Vec<Result<Texture, String>> = requests.par_iter().map(read).collect();
    let texels = texels.into_inner();
    if texels > limit {
        let problem = format!("{texels} texels in all, more than the limit of {limit}");
        return Err(file.fault("its textures", problem));
    }
    let mut out = Materials { materials: Vec::new(), textures: Vec::new(), uv_set: Vec::new() };
    let mut indices = Vec::new();
    for image in images {
        indices.push(image.map(|texture| {
            out.textures.push(texture);
            out.textures.len() as u32 - 1
        }));
    }
    for (i, material) in json.iter().enumerate() {
        let name = label("material", i, material.name.as_deref());
        let lookup = |slot: Slot| -> Option<Result<u32, &str>> {
            numbers.get(&slot.request).map(|&n| indices[n].as_ref().map(|&t| t).map_err(String::as_str))
        };
        let (converted, set) = convert(file, material, &name, lookup, &out.textures, warnings)?;
        let black = converted.metallic >= 1.0 && converted.metallic_roughness_texture.is_none();
        if black && used[i] && !converted.is_emissive() {
            warnings.add("fully metallic (glTF's default): its diffuse albedo is 0", name);
        }
        out.materials.push(converted);
        out.uv_set.push(set);
    }
    if used.get(json.len()).copied().unwrap_or(false) {
        out.materials.push(Material::diffuse("default", Vec3::splat(0.8)));
        out.uv_set.push(None);
        warnings.add("some meshes have no material: a diffuse grey of albedo 0.8 is used", "");
    }
    Ok(out)
}

fn convert<'s>(
    file: &File<'_>,
    json: &Json,
    name: &str,
    lookup: impl Fn(Slot) -> Option<Result<u32, &'s str>>,
    textures: &[Texture],
    warnings: &mut Warnings,
) -> Result<(Material, Option<u32>), SceneLoadError> {
    let pbr = &json.pbr_metallic_roughness;
    let factors = Vec4::from(pbr.base_color_factor.0);
    let extensions = json.extensions.as_ref();
    let transmission =
        extensions.and_then(|e| e.transmission.as_ref()).map_or(0.0, |t| t.transmission_factor.0);
    let ior = extensions.and_then(|e| e.ior.as_ref()).map_or(1.5, |i| i.ior.0);
    let mut clamped = false;
    let mut unit = |v: f32| -> Result<f32, SceneLoadError> {
        if !v.is_finite() {
            return Err(file.fault(name, "a factor is not finite"));
        }
        clamped |= !(0.0..=1.0).contains(&v);
        Ok(v.clamp(0.0, 1.0))
    };
    let mut m = Material {
        name: json.name.clone().unwrap_or_default(),
        base_color: Vec3::new(unit(factors.x)?, unit(factors.y)?, unit(factors.z)?),
        base_alpha: unit(factors.w)?,
        metallic: unit(pbr.metallic_factor.0)?,
        roughness: unit(pbr.roughness_factor.0)?,
        transmission: unit(transmission)?,
        ior: if ior.is_finite() { ior.max(1.0) } else { 1.5 },
        double_sided: json.double_sided,
        ..Material::default()
    };
    if clamped {
        warnings.add("a factor outside [0, 1] was clamped", name);
    }
    let strength = json.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    m.emission = Vec3::from(json.emissive_factor.0) * strength.map_or(1.0, |s| s.emissive_strength.0);
    if !m.emission.is_finite() || m.emission.min_element() < 0.0 {
        return Err(file.fault(name, format!("emission {} must be finite and not negative", m.emission)));
    }
    m.alpha_mode = match json.alpha_mode {
        Checked::Valid(JsonAlpha::Mask) => {
            AlphaMode::Mask { cutoff: json.alpha_cutoff.map_or(0.5, |c| c.0.clamp(0.0, 1.0)) }
        }
        Checked::Valid(JsonAlpha::Blend) => {
            warnings.add("alpha mode BLEND is read as a test: solid where alpha ≥ 0.5", name);
            AlphaMode::Mask { cutoff: 0.5 }
        }
        Checked::Valid(JsonAlpha::Opaque) | Checked::Invalid => AlphaMode::Opaque,
    };
    if json.normal_texture.is_some() {
        warnings.add("normal maps are not modelled", name);
    }

    let slots = slots(json);
    // One set of coordinates per vertex: that of the first slot with a texture.
    let set = slots.iter().flatten().map(|s| s.set).next();
    let mut refs = [None; 3];
    for (k, slot) in slots.into_iter().enumerate() {
        let Some(slot) = slot else { continue };
        if !slot.transform.is_finite() {
            return Err(file.fault(name, "a texture transform is not finite"));
        }
        let Some(found) = lookup(slot) else { continue };
        match found {
            Ok(texture) if Some(slot.set) == set => {
                refs[k] = Some(TextureRef { texture, uv_transform: slot.transform });
            }
            Ok(texture) => {
                warnings.add(
                    "reads two sets of texture coordinates: of the second the mean colour is used",
                    name,
                );
                let mean = texture::mean(&textures[texture as usize]);
                match k {
                    0 => m.base_color *= mean,
                    1 => {
                        m.metallic *= mean.z;
                        m.roughness *= mean.y;
                    }
                    _ => m.emission *= mean,
                }
            }
            Err(problem) if k == 2 => {
                warnings
                    .add(format!("its emission texture is left out, and it does not emit: {problem}"), name);
                m.emission = Vec3::ZERO;
            }
            Err(problem) => {
                warnings.add(format!("a texture is left out, and its factor used alone: {problem}"), name);
            }
        }
    }
    [m.base_color_texture, m.metallic_roughness_texture, m.emission_texture] = refs;
    let set = refs.iter().any(Option::is_some).then_some(set).flatten();
    Ok((m, set))
}
