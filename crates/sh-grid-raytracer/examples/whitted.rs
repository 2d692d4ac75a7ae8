//! A picture of the Whitted stage: the Cornell box under a spot light with one box of metal, the other of glass.
//!
//!     cargo run --release -p sh-grid-raytracer --example whitted -- OUT.png [FILE.glb]

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Material;
use indirect_scene::{LoadOptions, fixtures, load, png};
use indirect_technique::cpu::Fit;
use sh_grid_raytracer::cpu::{Field, Frame, Whitted, indirect};
use sh_grid_raytracer::{Options, Params, ShGridRaytracer};

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let out = words.next().unwrap_or_else(|| "whitted.png".into());
    let scene = match words.next() {
        Some(file) => load(file.as_ref(), &LoadOptions::default())?.scene,
        None => {
            let mut scene = fixtures::build("cornell_spot").ok_or("no such fixture")?;
            let first = scene.materials.len() as u32;
            scene.materials.push(Material { transmission: 1.0, ..Material::diffuse("glass", Vec3::ONE) });
            let gold = Material::diffuse("gold", Vec3::new(0.95, 0.75, 0.45));
            scene.materials.push(Material { metallic: 1.0, roughness: 0.05, ..gold });
            // Floor, ceiling and back wall come first, then the short box and the tall one, ten triangles each.
            scene.mesh.materials[6..16].fill(first);
            scene.mesh.materials[16..26].fill(first + 1);
            scene
        }
    };
    let size = [480, 480];
    let accel = Accel::build(&scene, BuildPreset::Best);
    let view = scene.cameras[0].view(size);
    let camera = cast::gbuffer(&accel, &view, [1, 1]);
    let (options, params) = (Options::default(), Params::default());
    let setup = ShGridRaytracer::fit(&accel, options, params)?;
    let output = indirect(&Frame::new(&accel, &view, &camera, &setup))?;
    let field = Field {
        accel: &accel,
        voxels: &setup.fitted.voxels,
        cells: &output.field.coefficients,
        coefficients: options.coefficients(),
        weights: options.weights,
        reach: params.reach,
    };
    let whitted = Whitted {
        accel: &accel,
        field,
        sources: &setup.fitted.sources,
        depth: 6,
        emitter_points: 16,
        glossy_samples: 0,
        seed: 0,
    };
    let image = whitted.render(&view, size);
    png::write_srgb(out.as_ref(), &png::reinhard(&image, 0.18), 1.0)?;
    println!("{out}: mean {:.3} W/(sr·m²)", indirect_core::math::luminance(image.mean()));
    Ok(())
}
