#![doc = include_str!("../README.md")]
//!
//! # Adding a shader
//!
//! 1. Put the file under `wgsl/<room>/<pass>.wgsl`, named like the Rust file of its CPU twin. Three lines of header: what it
//!    does, where its twin is, where the mathematics comes from.
//! 2. Add one entry to the table at the end of `src/lib.rs`: a constant, the files in reading order, the entry points.
//! 3. `INDIRECT_BLESS=1 cargo test -p indirect-shaders` writes what each entry point binds to `src/bindings.rs`; without the
//!    variable the same test fails where that file is not what the sources say.
//!
//! WGSL does not care about the order of declarations, so composition is concatenation. Names are shared by all files of a
//! module: prefix what is not obviously unique with the file's stem (`octahedral_encode`, not `encode`). Permutations are
//! `override` constants. Everything stays inside WebGPU's default limits and uses no optional feature; the tests of this
//! crate check that, and that every `.wgsl` file belongs to a module.
//!
//! Bind group 0 belongs to `core/scene.wgsl` in modules that include it; the rest of a module starts at group 1.

#![no_std]

extern crate alloc;

use alloc::string::String;

mod bindings;
mod entry_point;

pub use entry_point::{Binding, BindingKind, EntryPoint};

/// A shader module: WGSL files that are concatenated, and the entry points that the result has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Module {
    /// Name, for labels and messages.
    pub name: &'static str,
    /// Path below `wgsl/` and text of each file.
    pub files: &'static [(&'static str, &'static str)],
    /// Names of the entry points; empty for a library that other modules include.
    pub entry_points: &'static [&'static str],
}

impl Module {
    /// The composed WGSL source.
    #[must_use]
    pub fn source(&self) -> String {
        let mut source = String::with_capacity(self.files.iter().map(|(_, text)| text.len() + 1).sum());
        for (_, text) in self.files {
            source.push_str(text);
            if !text.ends_with('\n') {
                source.push('\n');
            }
        }
        source
    }

    /// What is known of an entry point; `None` where the module has none of that name.
    #[must_use]
    pub fn entry_point(&self, name: &str) -> Option<&'static EntryPoint> {
        bindings::ENTRY_POINTS.iter().find(|e| e.module == self.name && e.name == name)
    }

    /// The file and line (from 1) of a line (from 1) of [`Self::source`]; `None` beyond its end.
    #[must_use]
    pub fn locate(&self, line: usize) -> Option<(&'static str, usize)> {
        let mut rest = line.checked_sub(1)?;
        for (path, text) in self.files {
            let lines = text.lines().count();
            if rest < lines {
                return Some((path, rest + 1));
            }
            rest -= lines;
        }
        None
    }
}

macro_rules! modules {
    ($($(#[$doc:meta])* $name:ident = [$($file:literal),+ $(,)?] => [$($entry:literal),* $(,)?];)+) => {
        $(
            $(#[$doc])*
            pub const $name: Module = Module {
                name: stringify!($name),
                files: &[$(($file, include_str!(concat!("../wgsl/", $file)))),+],
                entry_points: &[$($entry),*],
            };
        )+

        /// Every module of the table.
        pub const MODULES: &[Module] = &[$($name),+];
    };
}

modules! {
    /// Octahedral unit vectors; twin of `indirect_core::octahedral`.
    OCTAHEDRAL = ["core/octahedral.wgsl"] => [];
    /// Form factors of points, discs and patches; twin of `indirect_core::form_factor`.
    FORM_FACTOR = ["core/form_factor.wgsl"] => [];
    /// Real spherical harmonics up to l = 2; twin of `sh_math::twins`.
    SH = ["sh/sh.wgsl"] => [];
    /// Counter-based hashes; twin of `indirect_sampling::rng`.
    RNG = ["sampling/rng.wgsl"] => [];
    /// The scrambled 2-D Sobol' sequence; twin of `indirect_sampling::sobol`.
    SOBOL = ["sampling/rng.wgsl", "sampling/sobol.wgsl"] => [];
    /// Radical inverses; twin of `indirect_sampling::halton`.
    HALTON = ["sampling/halton.wgsl"] => [];
    /// Discs, hemispheres, cones and triangles from the unit square; twin of `indirect_sampling::mapping`.
    MAPPING = ["sampling/mapping.wgsl"] => [];
    /// Index of an invocation in a one-dimensional grid of any size; twin of `indirect_gpu::workgroups_1d`.
    GRID = ["core/grid.wgsl"] => [];
    /// The sum of all values before each, in place; twin of `indirect_core::sort::exclusive_scan`.
    SCAN = ["core/grid.wgsl", "sort/scan.wgsl", "sort/scan_in_place.wgsl"] => ["scan_reduce", "scan_blocks", "scan_spread"];
    /// The same into a second buffer.
    SCAN_INTO = ["core/grid.wgsl", "sort/scan.wgsl", "sort/scan_into.wgsl"] => ["scan_reduce", "scan_blocks", "scan_spread"];
    /// Where elements that are kept go; twin of `indirect_core::sort::compact`.
    COMPACT = ["core/grid.wgsl", "sort/scan.wgsl", "sort/compact.wgsl"] => ["scan_reduce", "scan_blocks", "scan_spread"];
    /// A digit of a stable sort of pairs; twin of `indirect_core::sort::radix_sort_pairs`.
    RADIX_SORT = ["core/grid.wgsl", "sort/radix.wgsl"] => ["sort_count", "sort_scatter", "sort_copy"];
    /// Directions about a normal and origins of rays; twin of `indirect_core::math`.
    RAY = ["core/ray.wgsl"] => [];
    /// What rays hit, everything opaque; twin of `indirect_accel::FlatTree`.
    ACCEL_RAYS = [
        "core/grid.wgsl", "accel/layout.wgsl", "accel/traverse.wgsl", "accel/opaque.wgsl", "accel/rays.wgsl",
        "accel/rays_opaque.wgsl",
    ] => ["cast_closest", "cast_any"];
    /// What rays hit, alpha masks counted; twin of `indirect_accel::FlatTree`.
    ACCEL_RAYS_MASKED = [
        "core/grid.wgsl", "core/texture.wgsl", "core/scene.wgsl", "core/surface.wgsl", "accel/layout.wgsl",
        "accel/traverse.wgsl", "accel/masked.wgsl", "accel/rays.wgsl", "accel/rays_masked.wgsl",
    ] => ["cast_closest", "cast_any"];
    /// Flux and footprint of every texel of a reflective shadow map; twin of `rsm::cpu::flux`.
    RSM_FLUX = ["core/grid.wgsl", "rsm/layout.wgsl", "rsm/flux.wgsl"] => ["flux"];
    /// Mip pyramid of a reflective shadow map; twin of `rsm::cpu::pyramid`.
    RSM_PYRAMID = ["core/grid.wgsl", "core/cone.wgsl", "rsm/layout.wgsl", "rsm/pyramid.wgsl"] => [
        "pyramid_leaf", "pyramid_parent", "pyramid_top",
    ];
    /// Virtual point lights from reflective shadow maps; twin of `rsm::cpu::vpls`.
    RSM_VPLS = ["core/grid.wgsl", "sampling/warp.wgsl", "rsm/layout.wgsl", "rsm/vpls.wgsl"] => ["vpls_all", "vpls_grid", "vpls_importance"];
    /// Drops virtual point lights without flux; twin of `rsm::cpu::compact`.
    RSM_COMPACT = ["rsm/layout.wgsl", "rsm/compact.wgsl"] => ["compact"];
    /// Irradiance that virtual point lights cast on receivers; twin of `rsm::cpu::gather`.
    RSM_GATHER = ["core/grid.wgsl", "rsm/layout.wgsl", "rsm/kernel.wgsl", "rsm/gather.wgsl"] => ["gather"];
    /// Sorts a list of virtual point lights for a tree; twin of `keys` and `sort` in `rsm::cpu::LightTree`.
    RSM_TREE_SORT = [
        "core/grid.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "rsm/tree.wgsl", "rsm/tree_sort.wgsl",
    ] => ["tree_bounds", "tree_keys", "sort_blocks", "sort_pairs", "sort_merge"];
    /// The branches of a tree over a sorted list of virtual point lights; twin of `rsm::cpu::LightTree`.
    RSM_TREE = [
        "core/grid.wgsl", "core/cone.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "rsm/branch.wgsl",
        "rsm/reach.wgsl", "rsm/tree.wgsl", "rsm/tree_branches.wgsl",
    ] => ["tree_leaves", "tree_parents", "tree_reference", "tree_reach"];
    /// Gathers a cut through a tree of lights, without visibility; twin of `rsm::cpu::traverse`. A module that has a test of
    /// visibility replaces the last file.
    RSM_TRAVERSE = [
        "core/grid.wgsl", "rsm/weight.wgsl", "rsm/branch.wgsl", "rsm/kernel.wgsl", "rsm/traverse.wgsl", "rsm/unoccluded.wgsl",
    ] => ["traverse"];
    /// Radiance that leaves each pixel; twin of `indirect_filter::cpu::shade`.
    FILTER_SHADE = ["core/grid.wgsl", "filter/shade.wgsl"] => ["shade"];
    /// Irradiance blended with that of the frames before; twin of `indirect_filter::cpu::smooth`.
    FILTER_SMOOTH = ["core/grid.wgsl", "core/view.wgsl", "filter/smooth.wgsl"] => ["smooth_pixels"];
    /// Photons where light starts; twin of `photon_tracing::cpu::emit`.
    PHOTONS_EMIT = [
        "core/grid.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "sampling/sobol.wgsl", "sampling/mapping.wgsl",
        "photons/sources.wgsl", "photons/emitters.wgsl", "photons/layout.wgsl", "photons/emit.wgsl",
    ] => ["emit_photons"];
    /// A flight of photons and their reflection; twin of `photon_tracing::cpu::trace`.
    PHOTONS_TRACE = [
        "core/grid.wgsl", "core/texture.wgsl", "core/scene.wgsl", "core/surface.wgsl", "core/ray.wgsl", "sampling/rng.wgsl",
        "sampling/mapping.wgsl", "accel/layout.wgsl", "accel/traverse.wgsl", "accel/masked.wgsl", "photons/layout.wgsl",
        "photons/trace.wgsl",
    ] => ["trace_photons"];
    /// Photons that a surface has just reflected, with their cells; twin of `sh_grid_raytracer::cpu::Store`.
    SH_GRID_STORE = [
        "core/grid.wgsl", "core/ray.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "photons/layout.wgsl",
        "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/cells.wgsl", "sh_grid_raytracer/store.wgsl",
    ] => ["store_cells", "store_append"];
    /// Stored photons by their cells; twin of `sh_grid_raytracer::cpu::{sort, runs}`.
    SH_GRID_SORT = [
        "core/grid.wgsl", "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/sort.wgsl",
    ] => ["no_photons", "sort_keys", "run_marks", "run_begins"];
    /// The R-grid; twin of `sh_grid_raytracer::cpu::{radiance, levels}`.
    SH_GRID_RADIANCE = [
        "core/grid.wgsl", "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/radiance.wgsl",
    ] => ["sum_runs", "sum_cells", "sum_level"];
    /// Spherical harmonics at the active cells; twin of `sh_grid_raytracer::cpu::field`.
    SH_GRID_FIELD = [
        "core/grid.wgsl", "core/octahedral.wgsl", "sh/sh.wgsl", "sampling/rng.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl",
        "accel/traverse.wgsl", "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/cells.wgsl", "sh_grid_raytracer/lookup.wgsl",
        "sh_grid_raytracer/look_rays.wgsl", "sh_grid_raytracer/basis.wgsl", "sh_grid_raytracer/field_rays.wgsl",
        "sh_grid_raytracer/field.wgsl",
    ] => ["field"];
    /// The same with rays through the grids; twin of `sh_grid_raytracer::cpu::first_voxel` besides.
    SH_GRID_FIELD_VOXELS = [
        "core/grid.wgsl", "core/octahedral.wgsl", "sh/sh.wgsl", "sampling/rng.wgsl", "sh_grid_raytracer/layout.wgsl",
        "sh_grid_raytracer/lookup.wgsl", "sh_grid_raytracer/look_voxels.wgsl", "sh_grid_raytracer/basis.wgsl",
        "sh_grid_raytracer/field_voxels.wgsl", "sh_grid_raytracer/field.wgsl",
    ] => ["field"];
    /// Irradiance of the pixels from the field; twin of `sh_grid_raytracer::cpu::{gather, gather_samples}`.
    SH_GRID_GATHER = [
        "core/grid.wgsl", "core/ray.wgsl", "sh/sh.wgsl", "sampling/rng.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl",
        "accel/traverse.wgsl", "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/basis.wgsl",
        "sh_grid_raytracer/visible_rays.wgsl", "sh_grid_raytracer/interpolate.wgsl", "sh_grid_raytracer/gather.wgsl",
    ] => ["gather", "gather_samples"];
    /// The same without asking what is between pixels and cells.
    SH_GRID_GATHER_OPEN = [
        "core/grid.wgsl", "sh/sh.wgsl", "sampling/rng.wgsl", "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/basis.wgsl",
        "sh_grid_raytracer/visible_open.wgsl", "sh_grid_raytracer/interpolate.wgsl", "sh_grid_raytracer/gather.wgsl",
    ] => ["gather", "gather_samples"];
    /// Irradiance of the pixels by rays to the R-grid; twin of `sh_grid_raytracer::cpu::gather_final`.
    SH_GRID_FINAL = [
        "core/grid.wgsl", "core/ray.wgsl", "core/octahedral.wgsl", "sampling/rng.wgsl", "sampling/sobol.wgsl",
        "sampling/mapping.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl",
        "sh_grid_raytracer/layout.wgsl", "sh_grid_raytracer/cells.wgsl", "sh_grid_raytracer/lookup.wgsl",
        "sh_grid_raytracer/look_rays.wgsl", "sh_grid_raytracer/final.wgsl",
    ] => ["gather_final"];
    /// Virtual lights on emissive triangles; twin of `instant_radiosity::cpu::emit`.
    INSTANT_RADIOSITY_EMIT = [
        "core/grid.wgsl", "sampling/rng.wgsl", "sampling/mapping.wgsl", "rsm/layout.wgsl", "photons/sources.wgsl",
        "photons/emitters.wgsl", "instant_radiosity/layout.wgsl", "instant_radiosity/emit.wgsl",
    ] => ["emit"];
    /// Virtual lights of the next bounce; twin of `instant_radiosity::cpu::bounce_rays`.
    INSTANT_RADIOSITY_BOUNCE = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "sampling/mapping.wgsl",
        "rsm/layout.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/footprint.wgsl", "instant_radiosity/bounce.wgsl",
    ] => ["bounce_rays"];
    /// What virtual lights have in common; twin of `instant_radiosity::cpu::summary`.
    INSTANT_RADIOSITY_SUMMARY = [
        "sampling/rng.wgsl", "rsm/layout.wgsl", "instant_radiosity/layout.wgsl", "instant_radiosity/summary.wgsl",
    ] => ["summarise"];
    /// Irradiance of a pixel's part of the virtual lights, with rays; twin of `instant_radiosity::cpu::gather`.
    INSTANT_RADIOSITY_GATHER = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl",
        "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/shadow_rays.wgsl", "instant_radiosity/lights.wgsl", "instant_radiosity/gather_rays.wgsl",
        "instant_radiosity/gather.wgsl",
    ] => ["gather"];
    /// The same without visibility.
    INSTANT_RADIOSITY_GATHER_OPEN = [
        "core/grid.wgsl", "core/form_factor.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/shadow_open.wgsl", "instant_radiosity/lights.wgsl", "instant_radiosity/gather.wgsl",
    ] => ["gather"];
    /// The same with imperfect shadow maps.
    INSTANT_RADIOSITY_GATHER_MAPS = [
        "core/grid.wgsl", "core/form_factor.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "ism/layout.wgsl", "ism/query.wgsl",
        "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_maps.wgsl", "instant_radiosity/lights.wgsl",
        "instant_radiosity/gather.wgsl",
    ] => ["gather"];
    /// The virtual lights of all bounces as receivers see them; twin of `instant_radiosity::cpu::tailed`.
    INSTANT_RADIOSITY_TAILED = [
        "core/grid.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/tailed.wgsl",
    ] => ["tailed_lights"];
    /// Irradiance of a tile's cut through the tree over all virtual lights, with rays; twin of `instant_radiosity::cpu::gather_cuts`.
    INSTANT_RADIOSITY_CUTS = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl",
        "rsm/branch.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/shadow_rays.wgsl", "instant_radiosity/lights.wgsl", "instant_radiosity/gather_rays.wgsl",
        "instant_radiosity/cuts.wgsl",
    ] => ["gather_cuts"];
    /// The same without visibility.
    INSTANT_RADIOSITY_CUTS_OPEN = [
        "core/grid.wgsl", "core/form_factor.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "rsm/branch.wgsl",
        "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_open.wgsl", "instant_radiosity/lights.wgsl",
        "instant_radiosity/cuts.wgsl",
    ] => ["gather_cuts"];
    /// The same with imperfect shadow maps.
    INSTANT_RADIOSITY_CUTS_MAPS = [
        "core/grid.wgsl", "core/form_factor.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "rsm/branch.wgsl",
        "ism/layout.wgsl", "ism/query.wgsl", "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_maps.wgsl",
        "instant_radiosity/lights.wgsl", "instant_radiosity/cuts.wgsl",
    ] => ["gather_cuts"];
    /// What bounding virtual lights removes; twin of `instant_radiosity::cpu::compensate`.
    INSTANT_RADIOSITY_COMPENSATE = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "sampling/mapping.wgsl",
        "rsm/layout.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "photons/sources.wgsl",
        "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_rays.wgsl", "instant_radiosity/lights.wgsl",
        "instant_radiosity/compensate.wgsl",
    ] => ["compensate"];
    /// The same where nothing stands between virtual lights and the ends of paths.
    INSTANT_RADIOSITY_COMPENSATE_OPEN = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "sampling/mapping.wgsl",
        "rsm/layout.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "photons/sources.wgsl",
        "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_open.wgsl", "instant_radiosity/lights.wgsl",
        "instant_radiosity/compensate.wgsl",
    ] => ["compensate"];
    /// The same with imperfect shadow maps.
    INSTANT_RADIOSITY_COMPENSATE_MAPS = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "sampling/mapping.wgsl",
        "rsm/layout.wgsl", "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "ism/layout.wgsl",
        "ism/query.wgsl", "photons/sources.wgsl", "instant_radiosity/layout.wgsl", "instant_radiosity/shadow_maps.wgsl",
        "instant_radiosity/lights.wgsl", "instant_radiosity/compensate.wgsl",
    ] => ["compensate"];
    /// Virtual lights of the next bounce among points of the scene; twin of `instant_radiosity::cpu::bounce_points`.
    INSTANT_RADIOSITY_POINTS = [
        "core/grid.wgsl", "core/form_factor.wgsl", "core/ray.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl",
        "accel/layout.wgsl", "accel/opaque.wgsl", "accel/traverse.wgsl", "ism/layout.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/footprint.wgsl", "instant_radiosity/points.wgsl",
    ] => ["bounce_points"];
    /// Where pixels' surfaces were in the frame before; twin of `instant_radiosity::cpu::movement`.
    INSTANT_RADIOSITY_MOVEMENT = [
        "core/grid.wgsl", "sampling/rng.wgsl", "instant_radiosity/layout.wgsl", "instant_radiosity/movement.wgsl",
    ] => ["movement"];
    /// The pixels of a block put together, and with the frame before; twin of `instant_radiosity::cpu::merge`.
    INSTANT_RADIOSITY_MERGE = [
        "core/grid.wgsl", "core/view.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "instant_radiosity/layout.wgsl",
        "instant_radiosity/merge.wgsl",
    ] => ["merge"];
    /// Blocks of the camera's pixels; twin of `image_space_radiosity::cpu::mips`.
    IMAGE_SPACE_RADIOSITY_MIPS = [
        "core/grid.wgsl", "core/cone.wgsl", "image_space_radiosity/layout.wgsl", "image_space_radiosity/pixel.wgsl",
        "image_space_radiosity/mips.wgsl",
    ] => ["mips_parent"];
    /// Which blocks light is gathered at; twin of `image_space_radiosity::cpu::sources` and `refine`.
    IMAGE_SPACE_RADIOSITY_REFINE = [
        "core/grid.wgsl", "core/cone.wgsl", "rsm/weight.wgsl", "image_space_radiosity/layout.wgsl",
        "image_space_radiosity/levels.wgsl", "image_space_radiosity/pixel.wgsl", "image_space_radiosity/blocks.wgsl",
        "image_space_radiosity/sources.wgsl", "image_space_radiosity/refine.wgsl",
    ] => ["reference_irradiance", "refine", "stencil"];
    /// The valid blocks as a list; twin of `image_space_radiosity::cpu::compact`.
    IMAGE_SPACE_RADIOSITY_COMPACT = [
        "core/grid.wgsl", "image_space_radiosity/layout.wgsl", "image_space_radiosity/pixel.wgsl",
        "image_space_radiosity/blocks.wgsl", "image_space_radiosity/compact.wgsl",
    ] => ["compact_count", "compact_scan", "compact_write", "compact_arguments", "compact_points"];
    /// Texels of reflective shadow maps put together to lights; twin of `image_space_radiosity::cpu::patches`.
    IMAGE_SPACE_RADIOSITY_PATCHES = [
        "core/grid.wgsl", "core/cone.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "image_space_radiosity/layout.wgsl",
        "image_space_radiosity/texels.wgsl", "image_space_radiosity/patches.wgsl",
    ] => ["patches_texels", "patches_parent", "patches_sources", "patches_source_texels"];
    /// One list of lights without discontinuities; twin of `image_space_radiosity::cpu::clusters`.
    IMAGE_SPACE_RADIOSITY_CLUSTERS = [
        "core/grid.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "image_space_radiosity/layout.wgsl",
        "image_space_radiosity/levels.wgsl", "image_space_radiosity/texels.wgsl", "image_space_radiosity/flat.wgsl",
        "image_space_radiosity/clusters.wgsl",
    ] => ["clusters"];
    /// Lights in the order of a traversal; twin of `image_space_radiosity::cpu::tree`.
    IMAGE_SPACE_RADIOSITY_TREE = [
        "core/grid.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "rsm/branch.wgsl", "rsm/reach.wgsl",
        "image_space_radiosity/layout.wgsl", "image_space_radiosity/levels.wgsl", "image_space_radiosity/texels.wgsl",
        "image_space_radiosity/flat.wgsl", "image_space_radiosity/descend.wgsl", "image_space_radiosity/tree.wgsl",
    ] => ["tree", "tree_texels", "tree_list"];
    /// Where shadow maps of coarse patches stand; twin of `image_space_radiosity::cpu::shadow_lights`.
    IMAGE_SPACE_RADIOSITY_SHADOWS = [
        "core/grid.wgsl", "sampling/rng.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "image_space_radiosity/layout.wgsl",
        "image_space_radiosity/levels.wgsl", "image_space_radiosity/texels.wgsl", "image_space_radiosity/descend.wgsl",
        "image_space_radiosity/shadows.wgsl",
    ] => ["shadow_lights"];
    /// Gathers a cut through the tree with shadow maps; twin of `rsm::cpu::traverse_visible`.
    IMAGE_SPACE_RADIOSITY_TRAVERSE = [
        "core/grid.wgsl", "rsm/weight.wgsl", "rsm/layout.wgsl", "rsm/branch.wgsl", "rsm/kernel.wgsl", "ism/layout.wgsl",
        "ism/query.wgsl", "rsm/traverse.wgsl", "image_space_radiosity/visible.wgsl",
    ] => ["traverse"];
    /// Adds light after light by blending; twin of `image_space_radiosity::cpu::splat`.
    IMAGE_SPACE_RADIOSITY_SPLAT = [
        "core/grid.wgsl", "core/view.wgsl", "rsm/layout.wgsl", "rsm/weight.wgsl", "image_space_radiosity/layout.wgsl",
        "image_space_radiosity/splat.wgsl",
    ] => ["splat_vertex", "splat", "splat_bounded_vertex", "splat_bounded", "splat_resolve"];
    /// Irradiance from blocks to pixels; twin of `image_space_radiosity::cpu::upsample`.
    IMAGE_SPACE_RADIOSITY_UPSAMPLE = [
        "core/grid.wgsl", "image_space_radiosity/layout.wgsl", "image_space_radiosity/pixel.wgsl",
        "image_space_radiosity/blocks.wgsl", "image_space_radiosity/upsample.wgsl",
    ] => ["pull_pixels", "pull", "push_pixels", "push"];
    /// Samples of reflective shadow maps for radiance hints; twin of `radiance_hints::cpu::sample` and `near`.
    RADIANCE_HINTS_SAMPLE = [
        "core/grid.wgsl", "core/view.wgsl", "sampling/rng.wgsl", "sampling/sobol.wgsl", "sampling/warp.wgsl",
        "sampling/mapping.wgsl", "rsm/layout.wgsl", "radiance_hints/layout.wgsl",
        "radiance_hints/sample.wgsl", "radiance_hints/near.wgsl",
    ] => ["sample_importance", "sample_disc", "sample_near"];
    /// Occlusion between hints and samples; twin of `radiance_hints::cpu::occlusion`.
    RADIANCE_HINTS_OCCLUSION = [
        "core/grid.wgsl", "core/view.wgsl", "sampling/rng.wgsl", "radiance_hints/layout.wgsl",
        "radiance_hints/look.wgsl", "radiance_hints/depths.wgsl",
        "radiance_hints/occlusion.wgsl",
    ] => ["occlusion_depths", "occlusion_rsm", "occlusion_camera"];
    /// Hit distances of the directions of later bounces; twin of `radiance_hints::cpu::stops`.
    RADIANCE_HINTS_STOPS = [
        "core/grid.wgsl", "core/view.wgsl", "sampling/rng.wgsl", "sampling/sobol.wgsl", "sampling/mapping.wgsl",
        "radiance_hints/layout.wgsl", "radiance_hints/depths.wgsl",
        "radiance_hints/directions.wgsl", "radiance_hints/stops.wgsl",
    ] => ["stop_directions"];
    /// The first bounce at the hints; twin of `radiance_hints::cpu::estimate`.
    RADIANCE_HINTS_ESTIMATE = [
        "core/grid.wgsl", "sampling/rng.wgsl", "sh/sh.wgsl", "radiance_hints/layout.wgsl", "radiance_hints/look.wgsl",
        "radiance_hints/estimate.wgsl",
    ] => ["estimate"];
    /// Light from hint to hint; twin of `radiance_hints::cpu::bounce`.
    RADIANCE_HINTS_BOUNCE = [
        "core/grid.wgsl", "sampling/rng.wgsl", "sampling/sobol.wgsl", "sampling/mapping.wgsl", "sh/sh.wgsl",
        "radiance_hints/layout.wgsl", "radiance_hints/field.wgsl", "radiance_hints/directions.wgsl", "radiance_hints/bounce.wgsl",
    ] => ["bounce_directions", "bounce_sphere", "bounce_sphere_as_printed"];
    /// Irradiance of pixels from hints; twin of `radiance_hints::cpu::reconstruct`.
    RADIANCE_HINTS_RECONSTRUCT = [
        "core/grid.wgsl", "sh/sh.wgsl", "radiance_hints/layout.wgsl", "radiance_hints/field.wgsl",
        "radiance_hints/read.wgsl", "filter/reduced.wgsl", "radiance_hints/reconstruct.wgsl",
    ] => ["reconstruct"];
    /// Irradiance of every pixel from that of some; twin of `radiance_hints::cpu::upsample`.
    RADIANCE_HINTS_UPSAMPLE = [
        "core/grid.wgsl", "sh/sh.wgsl", "radiance_hints/layout.wgsl", "radiance_hints/field.wgsl",
        "radiance_hints/read.wgsl", "filter/reduced.wgsl", "filter/bilateral.wgsl", "radiance_hints/upsample.wgsl",
    ] => ["upsample"];
    /// Points of the scene drawn into imperfect shadow maps; twin of `imperfect_shadow_maps::cpu::splat`.
    ISM_SPLAT = ["core/grid.wgsl", "rsm/layout.wgsl", "ism/layout.wgsl", "ism/splat.wgsl"] => ["splat_clear", "splat"];
    /// Coarser levels of imperfect shadow maps; twin of `imperfect_shadow_maps::cpu::pull`.
    ISM_PULL = ["ism/layout.wgsl", "ism/pull.wgsl"] => ["pull"];
    /// Holes of imperfect shadow maps filled; twin of `imperfect_shadow_maps::cpu::push`.
    ISM_PUSH = ["ism/layout.wgsl", "ism/push.wgsl"] => ["push"];
    /// Queries of imperfect shadow maps for a list of pairs; twin of `imperfect_shadow_maps::cpu::Atlas`.
    ISM_VISIBLE = [
        "core/grid.wgsl", "rsm/layout.wgsl", "ism/layout.wgsl", "ism/query.wgsl", "ism/visible.wgsl",
    ] => ["visible"];
    /// Texels to rays and points to clip space; twin of `indirect_core::View`.
    VIEW = ["core/view.wgsl"] => [];
    /// A scene in storage buffers (bind group 0) and its surfaces; twin of `indirect_core::Scene`.
    SCENE = ["core/texture.wgsl", "core/scene.wgsl", "core/surface.wgsl"] => [];
    /// Draws triangle numbers and depth; host: `indirect_gpu::Raster`.
    VISIBILITY = [
        "core/view.wgsl", "core/texture.wgsl", "core/scene.wgsl", "core/surface.wgsl", "raster/visibility.wgsl",
    ] => ["visibility_vertex", "visibility", "visibility_masked"];
    /// Triangle numbers to G-buffer; host: `indirect_gpu::Raster`.
    RESOLVE = [
        "core/view.wgsl", "core/texture.wgsl", "core/scene.wgsl", "core/surface.wgsl", "raster/resolve.wgsl",
    ] => ["resolve"];
    /// Textures of a renderer's G-buffer to ours; host: `indirect_gpu::GBufferImport`.
    IMPORT = ["core/grid.wgsl", "core/view.wgsl", "core/octahedral.wgsl", "raster/import.wgsl"] => ["import_texels"];
    /// An image to a texture of half floats; host: `indirect_gpu::ImageExport`.
    EXPORT = ["core/grid.wgsl", "raster/export.wgsl"] => ["export_texels"];
    /// Vertices of objects that move; host: `indirect_gpu::MovingObjects`.
    POSE = ["core/grid.wgsl", "raster/pose.wgsl"] => ["pose_vertices"];
}
