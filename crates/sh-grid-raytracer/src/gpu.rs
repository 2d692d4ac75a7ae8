//! Frames on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. The cells are made on the CPU. Photons see the scene's textures and alpha masks; all other rays treat
//! surfaces with a mask as solid: the scene does not fit beside the rest into the eight storage buffers that every device binds.

use glam::{Mat3, UVec2, Vec3, Vec4};
use indirect_accel::gpu::{AccelBuffers, TreeSizes};
use indirect_core::settings::Settings;
use indirect_gpu::shaders::{
    Module, SH_GRID_FIELD, SH_GRID_FIELD_VOXELS, SH_GRID_FINAL, SH_GRID_GATHER, SH_GRID_GATHER_OPEN,
    SH_GRID_RADIANCE, SH_GRID_SORT, SH_GRID_STORE,
};
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{
    Compact, GpuError, Named, Pass, Plan, RadixSort, Scan, SortSizes, Vec3Pad, buffers, named, uniform_buffer,
};
use indirect_technique::gpu::Exchange;
pub use indirect_technique::gpu::{GpuTechnique, Inputs};
use photon_tracing::gpu::{PhotonSizes, Photons};

use crate::cpu::RUN;
use crate::error::Error;
use crate::layout::{
    DirectionRange, DirectionSet, Faces, FrameSettings, GridLevel, LevelRange, StoredPhoton, Voxel,
};
use crate::output::{Output, ShGridRaytracer};
use crate::settings::{Gather, Traverse, Weights};
use crate::setup::Setup;

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<ShGridRaytracer>;

type Build<'a> = indirect_technique::gpu::Build<'a, ShGridRaytracer>;

/// Directions in which a cell looks, or rays that a pixel sends, in one dispatch: software renderers end a shader's loops after 65 535
/// rounds.
const BATCH: u32 = 64;

/// What the lengths of buffers follow from. Lists that follow the surfaces have room for a quarter more, so that these may move.
#[derive(Debug, Clone)]
pub struct Sizes {
    pub(crate) pixels: u64,
    setup: Setup,
}

/// A list's length with room for more.
const fn with_room(length: usize) -> u64 {
    (length + length / 4 + 64) as u64
}

impl Sizes {
    fn boundary(&self) -> u64 {
        with_room(self.setup.fitted.voxels.boundary as usize)
    }

    fn cells(&self) -> u64 {
        with_room(self.setup.fitted.voxels.cells.len())
    }

    fn faces(&self) -> u64 {
        with_room(self.setup.fitted.pyramid.len())
    }

    fn index(&self) -> u64 {
        (self.setup.fitted.voxels.index.len() + self.setup.fitted.pyramid.index.len()) as u64
    }

    fn photons(&self) -> u32 {
        self.setup.options.photons
    }

    fn capacity(&self) -> u32 {
        self.setup.options.most_stored()
    }

    fn photon_sizes(&self) -> PhotonSizes {
        let fitted = &self.setup.fitted;
        PhotonSizes::new(&fitted.sources, self.photons(), fitted.lights)
    }

    fn sort(&self) -> SortSizes {
        SortSizes::new(self.capacity().into(), self.key_bits())
    }

    /// Bits of the places of boundary cells.
    fn key_bits(&self) -> u32 {
        u64::BITS - self.boundary().leading_zeros()
    }

    /// Whether rays go through the grids.
    fn has_voxels(&self) -> bool {
        self.setup.options.traverse == Traverse::Voxels
    }
}

buffers! {
    /// Buffers beside those of the photons, of sorting and of rays.
    pub struct OwnBuffers for Sizes {
        /// For every cell of the cubes of all levels its place among those of its level, or [`NONE`](crate::NONE).
        cell_index: [u32] = Sizes::index;
        /// Numbers of the active cells.
        active_cells: [u32] = Sizes::cells;
        /// Fine cells of the boundary cells.
        voxels: [Voxel] = |s| if s.has_voxels() { s.boundary() } else { 0 };
        /// Their normals.
        voxel_normals: [u32] = |s| if s.has_voxels() { with_room(s.setup.fitted.voxels.normals.len()) } else { 0 };
        /// Area of the surfaces in each boundary cell, by face.
        areas: [f32] = |s| 6 * s.boundary();
        /// What the cells of levels 1, 2, … are made of.
        children: [u32] = |s| 8 * with_room(s.setup.fitted.pyramid.children.len());
        /// Normals of the triangles.
        triangle_normals: [u32] = |s| s.setup.fitted.normals.len() as u64;
        /// 1 for each photon that is stored.
        flags: [u32] = |s| s.photons().into();
        /// The cell of each.
        photon_cells: [u32] = |s| s.photons().into();
        /// The stored photons.
        stored: [StoredPhoton] = |s| s.capacity().into();
        /// How many there are, and how many found no room.
        count: [u32] = |_| 2;
        /// Their cells, sorted.
        keys: [u32] = |s| s.capacity().into();
        /// Their order by cells.
        payloads: [u32] = |s| s.capacity().into();
        /// Where runs begin, then runs before each photon.
        marks: [u32] = |s| s.capacity().into();
        /// Where each run begins, and where the last ends.
        begins: [u32] = |s| u64::from(s.capacity()) / u64::from(RUN) + s.boundary() + 2;
        /// The runs of each boundary cell.
        cell_runs: [UVec2] = Sizes::boundary;
        /// Sums of the runs.
        run_sums: [Faces] = |s| u64::from(s.capacity()) / u64::from(RUN) + s.boundary() + 1;
        /// The R-grid, level by level.
        faces: [Faces] = Sizes::faces;
        /// Coefficients of the active cells.
        field_cells: [Vec4] = |s| if s.setup.options.has_field() { s.cells() * u64::from(s.setup.options.coefficients()) } else { 0 };
        /// Of each active cell a number that differs where its rays end elsewhere.
        seen: [u32] = |s| if s.setup.options.has_field() { s.cells() } else { 0 };
        /// Irradiance per pixel, W/m², and a number that differs where it comes from elsewhere.
        irradiance: [Vec4] = |s| s.pixels;
        /// Indirect radiance that leaves each pixel, W/(sr·m²).
        image: [Vec3Pad] = |s| s.pixels;
        /// Directions in which cells look.
        directions: DirectionSet;
        /// Directions in which pixels look.
        pixel_directions: DirectionSet;
        /// The frame's settings.
        settings: FrameSettings;
    }
}

/// All buffers.
#[derive(Debug, Clone)]
pub struct Buffers {
    /// The photons.
    pub photons: Photons,
    /// What the technique adds.
    pub own: OwnBuffers,
    /// The scene for rays.
    pub accel: AccelBuffers,
    compact: Compact,
    sort: RadixSort,
    scan: Scan,
    levels: Vec<Buffer>,
    ranges: Vec<Buffer>,
    setup: Setup,
    pixels: u64,
}

impl Buffers {
    /// The order of the stored photons by their cells.
    pub(crate) const fn order(&self) -> &Buffer {
        &self.own.payloads
    }

    fn write_frame(&self, queue: &Queue) {
        let Setup { options, params, fitted } = &self.setup;
        let grid = &fitted.voxels.grid;
        let mut grid_levels = [GridLevel::default(); crate::layout::MOST_LEVELS];
        let first = fitted.voxels.index.len() as u32;
        for (i, (slot, l)) in grid_levels.iter_mut().zip(&fitted.pyramid.levels).enumerate() {
            let cube = if i == 0 { 0 } else { first + l.cube };
            *slot = GridLevel {
                size: l.grid.size,
                cube,
                first: l.first,
                count: l.count,
                cell: l.grid.cell,
                pad0: 0,
            };
        }
        let settings = FrameSettings {
            origin: grid.origin,
            cell: grid.cell,
            size: grid.size,
            boundary: fitted.voxels.boundary,
            cells: fitted.voxels.cells.len() as u32,
            photons: options.photons,
            capacity: options.most_stored(),
            levels: fitted.pyramid.levels.len() as u32,
            store_reach: self.setup.store_reach(),
            unit: fitted.unit,
            least_area: params.least_area,
            far: grid.diagonal(),
            directions: options.directions,
            coefficients: options.coefficients(),
            seed: params.seed,
            printed: options.is_printed().into(),
            turned: options.turned.is_on().into(),
            footprint: options.footprint.is_on().into(),
            weights: options.weights as u32,
            pixels: self.pixels as u32,
            samples: options.samples,
            reach: params.reach,
            obscurance_range: if options.obscurance.is_on() { self.setup.obscurance_range() } else { 0.0 },
            pad0: 0,
            grid_levels,
        };
        queue.write_buffer(&self.own.settings, 0, bytemuck::bytes_of(&settings));
    }

    /// Writes what depends on the geometry alone.
    fn write_geometry(&self, queue: &Queue) -> Result<(), Error> {
        let (fitted, own) = (&self.setup.fitted, &self.own);
        let (voxels, pyramid) = (&fitted.voxels, &fitted.pyramid);
        self.photons.write_emitters(queue, &fitted.sources)?;
        write(queue, &own.cell_index, 0, &voxels.index, "cells")?;
        write(queue, &own.cell_index, voxels.index.len(), &pyramid.index, "cells")?;
        write(queue, &own.active_cells, 0, &voxels.cells, "active cells")?;
        if self.setup.options.traverse == Traverse::Voxels {
            write(queue, &own.voxels, 0, &voxels.voxels, "boundary cells")?;
            write(queue, &own.voxel_normals, 0, &voxels.normals, "fine boundary cells")?;
        }
        write(queue, &own.areas, 0, &voxels.areas, "boundary cells")?;
        write(queue, &own.children, 0, &pyramid.children, "cells of the R-grid")?;
        write(queue, &own.triangle_normals, 0, &fitted.normals, "triangles")?;
        for (buffer, l) in self.levels.iter().zip(pyramid.levels.iter().skip(1)) {
            let range = LevelRange { first: l.first, count: l.count, pad0: 0, pad1: 0 };
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(&range));
        }
        Ok(())
    }

    fn write_directions(&self, queue: &Queue) {
        let fitted = &self.setup.fitted;
        for (buffer, list) in [
            (&self.own.directions, &fitted.directions),
            (&self.own.pixel_directions, &fitted.pixel_directions),
        ] {
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(&direction_set(&fitted.turns, list)));
        }
    }
}

/// Writes a list from element `first` on.
fn write<T: bytemuck::Pod>(
    queue: &Queue,
    buffer: &Buffer,
    first: usize,
    list: &[T],
    what: &'static str,
) -> Result<(), Error> {
    let available = buffer.size() as usize / size_of::<T>();
    let needed = first + list.len();
    if needed > available {
        return Err(Error::Capacity { what, available, needed });
    }
    queue.write_buffer(buffer, (first * size_of::<T>()) as u64, bytemuck::cast_slice(list));
    Ok(())
}

fn direction_set(turns: &[Mat3], directions: &[Vec3]) -> DirectionSet {
    let mut set = bytemuck::Zeroable::zeroed();
    let DirectionSet { turns: columns, directions: list } = &mut set;
    let of = |m: &Mat3| [m.x_axis, m.y_axis, m.z_axis];
    columns.iter_mut().zip(turns.iter().flat_map(of)).for_each(|(c, v)| *c = v.extend(0.0));
    list.iter_mut().zip(directions).for_each(|(c, v)| *c = v.extend(0.0));
    set
}

/// The ranges of directions, or of rays, of the frame's dispatches.
fn ranges(setup: &Setup) -> impl Iterator<Item = DirectionRange> + use<> {
    let options = &setup.options;
    let all = if options.has_field() { options.directions } else { options.samples };
    (0..all.div_ceil(BATCH)).map(move |k| DirectionRange {
        first: k * BATCH,
        end: ((k + 1) * BATCH).min(all),
        pad0: 0,
        pad1: 0,
    })
}

impl GpuTechnique for ShGridRaytracer {
    type Maps = ();

    fn sizes(setup: &Setup, size: [u32; 2], _maps: usize) -> Sizes {
        Sizes { pixels: u64::from(size[0]) * u64::from(size[1]), setup: setup.clone() }
    }

    fn plan(s: &Sizes) -> Plan {
        let mut plan = Photons::plan(&s.photon_sizes())
            .and(OwnBuffers::plan(s))
            .and(AccelBuffers::plan(&TreeSizes::of(&s.setup.fitted.tree)))
            .and(Compact::plan(s.photons().into(), s.capacity().into()))
            .and(RadixSort::plan(&s.sort()))
            .and(Scan::plan(s.capacity().into()));
        (1..s.setup.fitted.pyramid.levels.len()).for_each(|_| plan.uniform::<LevelRange>("level"));
        ranges(&s.setup).for_each(|_| plan.uniform::<DirectionRange>("range"));
        plan
    }

    fn allocate(device: &Device, queue: &Queue, s: &Sizes, setup: &Setup) -> Result<Buffers, GpuError> {
        let level = |_| uniform_buffer(device, "level", &LevelRange::default());
        let buffers = Buffers {
            photons: Photons::new(device, s.photon_sizes())?,
            own: OwnBuffers::new(device, s)?,
            accel: AccelBuffers::upload(device, queue, &setup.fitted.tree)?,
            compact: Compact::new(device, s.photons(), s.capacity())?,
            sort: RadixSort::new(device, s.capacity(), s.key_bits())?,
            scan: Scan::new(device, s.capacity())?,
            levels: (1..setup.fitted.pyramid.levels.len()).map(level).collect(),
            ranges: ranges(setup).map(|r| uniform_buffer(device, "range", &r)).collect(),
            setup: setup.clone(),
            pixels: s.pixels,
        };
        buffers.write_directions(queue);
        // The lists are those that the buffers were made for.
        let _ = buffers.write_geometry(queue);
        Ok(buffers)
    }

    fn resize(
        old: &Buffers,
        device: &Device,
        _: &Queue,
        [sizes, probe]: [&Sizes; 2],
        _: &Setup,
    ) -> Result<Buffers, GpuError> {
        let own = old.own.resized(device, sizes, probe)?;
        Ok(Buffers { own, pixels: sizes.pixels, ..old.clone() })
    }

    fn maps(_: &Buffers) -> &() {
        &()
    }

    fn named(b: &Buffers) -> Vec<Named<'_>> {
        let mut all = b.own.named();
        all.extend(b.photons.buffers.named());
        all.extend(b.accel.named());
        all.extend(b.compact.buffers.named());
        all
    }

    fn prepare(b: &mut Buffers, queue: &Queue, inputs: &Inputs<'_>, setup: &Setup) -> Result<(), Error> {
        setup.params.validate()?;
        let moved = !std::sync::Arc::ptr_eq(&b.setup.fitted.voxels, &setup.fitted.voxels);
        let before = core::mem::replace(&mut b.setup, setup.clone());
        if moved {
            let written = b.write_geometry(queue);
            if let Err(e) = written.and_then(|()| Ok(b.accel.write(queue, &setup.fitted.tree)?)) {
                // Refused again the next time: what did not fit is not there.
                b.setup = before;
                return Err(e);
            }
        }
        b.setup.fitted.sources.set_lights(inputs.lights);
        b.photons.write_lights(queue, &b.setup.fitted.sources, setup.params.seed)?;
        b.write_frame(queue);
        Ok(())
    }

    fn image_buffer(b: &Buffers) -> &Buffer {
        &b.own.image
    }
}

pub(crate) fn emit(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.buffers.photons.emit(b.pipelines, pass)
}

pub(crate) fn trace(b: &Build<'_>, pass: &mut Pass, number: u32) -> Result<(), GpuError> {
    let photons = b.sizes.photons().into();
    b.buffers.photons.trace(b.pipelines, pass, b.named())?;
    b.compute(pass, (&SH_GRID_STORE, "store_cells"), photons, &[])?;
    if number == 0 {
        b.compute(pass, (&SH_GRID_SORT, "no_photons"), 1, &[])?;
    }
    b.buffers.compact.encode(b.pipelines, pass, b.named())?;
    b.compute(pass, (&SH_GRID_STORE, "store_append"), photons, &[])
}

pub(crate) fn sort(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&SH_GRID_SORT, "sort_keys"), b.sizes.capacity().into(), &[])?;
    b.buffers.sort.encode(b.pipelines, pass, b.named())
}

pub(crate) fn radiance(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (capacity, boundary) = (u64::from(b.sizes.capacity()), b.sizes.boundary());
    let own = [named("total", &b.buffers.scan.buffers.total)];
    b.compute(pass, (&SH_GRID_SORT, "run_marks"), capacity.max(boundary), &own)?;
    b.buffers.scan.encode(b.pipelines, pass, &[named("values", &b.buffers.own.marks)])?;
    b.compute(pass, (&SH_GRID_SORT, "run_begins"), capacity, &own)?;
    b.compute(pass, (&SH_GRID_RADIANCE, "sum_runs"), capacity / u64::from(RUN) + boundary + 1, &own)?;
    b.compute(pass, (&SH_GRID_RADIANCE, "sum_cells"), boundary, &own)
}

pub(crate) fn levels(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    for (buffer, level) in b.buffers.levels.iter().zip(b.setup.fitted.pyramid.levels.iter().skip(1)) {
        let own = [named("level", buffer)];
        // As many as there can be: a level may grow more than the lists of all.
        b.compute(pass, (&SH_GRID_RADIANCE, "sum_level"), level.grid.len() as u64, &own)?;
    }
    Ok(())
}

fn each_range(
    b: &Build<'_>,
    pass: &mut Pass,
    entry: (&Module, &'static str),
    invocations: u64,
) -> Result<(), GpuError> {
    b.buffers.ranges.iter().try_for_each(|r| b.compute(pass, entry, invocations, &[named("range", r)]))
}

pub(crate) fn field(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let module = if b.sizes.has_voxels() { &SH_GRID_FIELD_VOXELS } else { &SH_GRID_FIELD };
    each_range(b, pass, (module, "field"), b.sizes.cells())
}

pub(crate) fn gather(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let options = &b.setup.options;
    let pixels = b.sizes.pixels;
    if options.gather == Gather::Final {
        return each_range(b, pass, (&SH_GRID_FINAL, "gather_final"), pixels);
    }
    let module = if options.weights == Weights::Visible { &SH_GRID_GATHER } else { &SH_GRID_GATHER_OPEN };
    let entry = if options.gather == Gather::Samples { "gather_samples" } else { "gather" };
    b.compute(pass, (module, entry), pixels, &[])
}

/// Compares the photons where both backends made the same choices, and those that they stored of them, photon by photon: one choice more
/// or less moves all that follow in the list.
pub(crate) fn exchange_photons(b: &Buffers, o: &mut Output, x: &mut Exchange<'_>) {
    let found: Vec<photon_tracing::Photon> = x.read(&b.photons.buffers.photons, 0, o.photons.len());
    // Where a ray meets an edge, the two sides may take either surface; directions about a normal turn where its z changes sign.
    let same = o.photons.iter().zip(&found).map(|(c, g)| {
        (c.state, c.reflections) == (g.state, g.reflections)
            && c.normal.distance_squared(g.normal) < 1e-6
            && (c.normal.z >= 0.0) == (g.normal.z >= 0.0)
    });
    x.same(Some(same.collect()));
    x.elements("", &b.photons.buffers.photons, 0, &mut o.photons);
    let newest = |list: &[StoredPhoton]| {
        let mut slots = vec![StoredPhoton { cell: u32::MAX, ..StoredPhoton::default() }; o.photons.len()];
        for s in list {
            if let Some(slot) = slots.get_mut(s.photon as usize) {
                *slot = *s;
            }
        }
        slots
    };
    let held = x.read::<u32>(&b.own.count, 0, 1).first().copied().unwrap_or(0);
    let list: Vec<StoredPhoton> = x.read(&b.own.stored, 0, held as usize);
    let (cpu, gpu) = (newest(&o.stored), newest(&list));
    let same =
        |(c, g): (&StoredPhoton, &StoredPhoton)| c.cell == g.cell && c.axis.distance_squared(g.axis) < 1e-6;
    x.same(Some(cpu.iter().zip(&gpu).map(same).collect()));
    x.compare_elements("stored", &cpu, &gpu);
    x.same(None);
    x.take_list(&b.own.count, &b.own.stored, &mut o.stored);
}

/// Compares cells whose rays end in the same cells on both backends; the others are counted.
pub(crate) fn exchange_field(b: &Buffers, o: &mut Output, x: &mut Exchange<'_>) {
    let each = b.setup.options.coefficients() as usize;
    let found: Vec<u32> = x.read(&b.own.seen, 0, o.field.seen.len());
    let same = o.field.seen.iter().zip(&found).flat_map(|(c, g)| core::iter::repeat_n(c == g, each));
    x.same(Some(same.collect()));
    x.floats("", &b.own.field_cells, &mut o.field.coefficients, 4);
    x.same(None);
    x.choices("seen", &b.own.seen, &mut o.field.seen);
}
