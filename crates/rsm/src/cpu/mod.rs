//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod flux;
mod gather;
mod kernel;
mod pyramid;
mod reach;
mod receivers;
mod simd;
mod traverse;
mod tree;
mod vpls;
mod walk;

use indirect_accel::{Accel, cast};
use indirect_core::Scene;
use indirect_core::settings::BadOption;

pub use flux::{MIN_FOOTPRINT_COSINE, flux, texel_solid_angle};
pub use gather::gather;
pub use kernel::CHUNK;
pub use pyramid::pyramid;
pub use reach::{ALWAYS, reach};
pub use receivers::Receivers;
pub use traverse::{cut, traverse, traverse_visible, visit_cut};
pub use tree::LightTree;
pub use vpls::{compact, vpls};
pub use walk::Tile;

use crate::{
    Error,
    layout::LightMap,
    rsm::{MAX_RESOLUTION, Map, Pyramid, Rsm},
    views::views,
};

/// The reflective shadow maps of all lights of the scene, `resolution` texels along each side: all three passes.
///
/// # Errors
/// [`Error::BadOption`] where `resolution` is not in `1..=`[`MAX_RESOLUTION`].
pub fn generate(accel: &Accel<'_>, resolution: u32) -> Result<Rsm, Error> {
    if !(1..=MAX_RESOLUTION).contains(&resolution) {
        return Err(BadOption::new("resolution", resolution, "in 1..=8192").into());
    }
    let mut rsm = surface(accel, resolution);
    flux_of_maps(&mut rsm, accel.scene());
    pyramid_of_maps(&mut rsm);
    Ok(rsm)
}

/// `surface`: what the lights see, through the windows of [`views`]. The maps carry no light yet.
#[must_use]
pub fn surface(accel: &Accel<'_>, resolution: u32) -> Rsm {
    let map = |v: crate::MapView| Map {
        light: v.light,
        view: v.view,
        surface: cast::gbuffer(accel, &v.view, [resolution; 2]),
        texels: Vec::new(),
        pyramid: Pyramid::default(),
    };
    Rsm { resolution, maps: views(accel.scene()).into_iter().map(map).collect() }
}

/// [`flux`] of every map.
pub fn flux_of_maps(rsm: &mut Rsm, scene: &Scene) {
    for m in &mut rsm.maps {
        let map = LightMap::new(&scene.lights[m.light], &m.view, rsm.resolution);
        m.texels = flux(&map, &m.surface);
    }
}

/// [`pyramid`] of every map.
pub fn pyramid_of_maps(rsm: &mut Rsm) {
    for m in &mut rsm.maps {
        m.pyramid = pyramid(&m.surface, &m.texels);
    }
}
