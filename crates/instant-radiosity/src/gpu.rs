//! Frames on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. Rays treat surfaces with an alpha mask as solid: the scene's textures do not fit beside the rest into the
//! eight storage buffers that every device binds.

use glam::{Vec2, Vec4};
use imperfect_shadow_maps::gpu::Atlas;
use indirect_accel::gpu::{AccelBuffers, TreeSizes};
use indirect_core::settings::{BadOption, Settings};
use indirect_gpu::shaders::{
    INSTANT_RADIOSITY_BOUNCE, INSTANT_RADIOSITY_COMPENSATE, INSTANT_RADIOSITY_COMPENSATE_MAPS,
    INSTANT_RADIOSITY_COMPENSATE_OPEN, INSTANT_RADIOSITY_CUTS, INSTANT_RADIOSITY_CUTS_MAPS,
    INSTANT_RADIOSITY_CUTS_OPEN, INSTANT_RADIOSITY_EMIT, INSTANT_RADIOSITY_GATHER,
    INSTANT_RADIOSITY_GATHER_MAPS, INSTANT_RADIOSITY_GATHER_OPEN, INSTANT_RADIOSITY_MERGE,
    INSTANT_RADIOSITY_MOVEMENT, INSTANT_RADIOSITY_POINTS, INSTANT_RADIOSITY_SUMMARY,
    INSTANT_RADIOSITY_TAILED,
};
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Plan, Vec3Pad, ViewUniform, buffers, named, uniform_buffer};
use photon_tracing::{Emitter, PunctualLight};
use rsm::gpu::{LightTree, Maps, TreeParams, VplSlots};
use rsm::{Error, Selection, TILE, Vpl};

pub use indirect_technique::gpu::{GpuTechnique, Inputs};

use crate::cpu::{Parts, TILE_SIZE};
use crate::layout::{BounceRange, FrameSettings, LightRange, PointChoice, Summary, TriangleSurface};
use crate::output::{InstantRadiosity, Output};
use crate::sequence::{Use, points};
use crate::settings::{Bounce, Options, Visibility};
use crate::setup::Setup;

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<InstantRadiosity>;

type Build<'a> = indirect_technique::gpu::Build<'a, InstantRadiosity>;

/// Punctual lights that light the ends of paths, as `compensate.wgsl` declares them: what a uniform buffer of any device holds. More
/// are left out there.
const LIGHTS: usize = 1024;

/// Shadow rays of a pixel that gathers a cut: software renderers end a shader's loops after 65 535 rounds, those within rays included.
const MOST_RAYS: u32 = 64;

/// What the lengths of buffers follow from.
#[derive(Debug, Clone)]
pub struct Sizes {
    pub(crate) size: [u32; 2],
    pub(crate) pixels: u64,
    maps: usize,
    setup: Setup,
}

impl Sizes {
    fn selection(&self) -> Selection {
        Selection::Importance { count: self.setup.map_lights() }
    }

    /// Points of all runs of `bounce`.
    fn bounce_points(&self) -> u64 {
        (0..self.setup.runs()).map(|k| u64::from(self.setup.run(k).count)).sum()
    }

    /// Points and shadow maps, where there are points; one map where nothing asks them.
    fn atlas(&self) -> Option<[u32; 2]> {
        let options = &self.setup.options;
        let tiles = if options.visibility == Visibility::Maps { options.slots() } else { 1 };
        options.has_points().then(|| [self.setup.fitted.points.len() as u32, tiles])
    }

    fn cuts(&self, device: &Device) -> Result<Option<Cuts>, GpuError> {
        let options = &self.setup.options;
        if !options.has_cuts() {
            return Ok(None);
        }
        let tree = LightTree::new(device, options.slots().into(), self.pixels)?;
        Ok(Some(Cuts { lights: CutBuffers::new(device, self)?, tree }))
    }

    /// Pixels, or none where movement is not followed.
    fn followed(&self) -> u64 {
        if self.setup.follows_motion() { self.pixels } else { 0 }
    }

    fn followed_vertices(&self) -> u64 {
        if self.setup.follows_motion() { self.setup.fitted.now.len() as u64 } else { 0 }
    }
}

buffers! {
    /// Buffers beside those of the maps.
    pub struct OwnBuffers for Sizes {
        /// Emissive triangles.
        emitters: [Emitter] = |s| s.setup.fitted.emitters.len() as u64;
        /// Points that choose places on them.
        emitter_points: [Vec2] = |s| s.setup.fitted.from_emitters.into();
        /// Points that choose the directions of all runs of `bounce`.
        bounce_points: [Vec2] = Sizes::bounce_points;
        /// All virtual lights, bounce by bounce, those on emitters behind them.
        vpls: [Vpl] = |s| s.setup.slots().into();
        /// What they have in common.
        summary: [Summary] + UNIFORM = |_| 1;
        /// Triangles as light leaves them.
        surfaces: [TriangleSurface] = |s| s.setup.fitted.surfaces.len() as u64;
        /// How many virtual lights have shadow maps.
        count: [u32] = |_| 1;
        /// Punctual lights, for the ends of paths.
        punctual_lights: [PunctualLight] + UNIFORM = |_| LIGHTS as u64;
        /// Vertices of the triangles, where movement is followed.
        mesh_triangles: [[u32; 4]] = |s| if s.setup.follows_motion() { s.setup.fitted.triangles.len() as u64 } else { 0 };
        /// Their positions, metres.
        vertices_now: [Vec3Pad] = Sizes::followed_vertices;
        /// The same in the frame before.
        vertices_before: [Vec3Pad] = Sizes::followed_vertices;
        /// Where the pixels' surfaces were in the frame before.
        before: [Vec4] = Sizes::followed;
        /// Irradiance of each pixel's part of the lights until it is merged; then indirect radiance that leaves each, W/(sr·m²).
        image: [Vec3Pad] = |s| s.pixels;
        /// Irradiance per pixel, W/m², and view depth.
        irradiance: [Vec4] = |s| s.pixels;
        /// Normals, and the frames that the irradiance is the mean of.
        merged_normals: [Vec4] = |s| s.pixels;
        /// `irradiance` of the frame before.
        past_irradiance: [Vec4] = |s| if s.setup.options.has_history() { s.pixels } else { 0 };
        /// `merged_normals` of the frame before.
        past_normals: [Vec4] = |s| if s.setup.options.has_history() { s.pixels } else { 0 };
        /// The camera of the present frame.
        present_view: [ViewUniform] = |_| 1;
        /// The camera of the frame before.
        previous_view: ViewUniform;
        /// The frame's settings.
        settings: FrameSettings;
    }
}

buffers! {
    /// What the tree is made over.
    pub struct CutBuffers for Sizes {
        /// Virtual lights of all bounces with the flux that receivers see.
        tailed: [Vpl] = |s| s.setup.options.slots().into();
    }
}

/// The tree over all virtual lights of all bounces.
#[derive(Debug, Clone)]
pub struct Cuts {
    /// The lights.
    pub lights: CutBuffers,
    /// The tree.
    pub tree: LightTree,
}

/// All buffers.
#[derive(Debug, Clone)]
pub struct Buffers {
    /// The maps.
    pub rsm: Maps,
    /// What the technique adds.
    pub own: OwnBuffers,
    /// Virtual lights as they are drawn from the maps.
    pub slots: VplSlots,
    /// The scene for rays.
    pub accel: AccelBuffers,
    /// The tree over all virtual lights, where pixels gather cuts.
    pub cuts: Option<Cuts>,
    /// The points of the scene and the shadow maps, where there are any.
    pub atlas: Option<Atlas>,
    /// One per run of `bounce`: its range, and how it chooses.
    runs: Vec<[Buffer; 2]>,
    /// One per range of lights.
    ranges: Vec<Buffer>,
    pub(crate) setup: Setup,
    size: [u32; 2],
    lights: u32,
    /// Number of the next frame.
    frame: u32,
}

fn ranges(options: &Options) -> impl Iterator<Item = LightRange> + use<> {
    let parts =
        Parts { interleave: options.interleave, per_bounce: options.per_bounce(), bounces: options.bounces };
    let range = |(number, r): (u32, core::ops::Range<u32>)| LightRange {
        first: r.start,
        end: r.end,
        number,
        pad0: 0,
    };
    (0..).zip(parts.ranges(options.tests())).map(range)
}

impl Buffers {
    /// Writes what a frame of this number is given.
    fn write_frame(&self, queue: &Queue, frame: u32) {
        let Setup { options, params, fitted } = &self.setup;
        let frame = if options.has_history() { frame } else { 0 };
        let settings = FrameSettings {
            width: self.size[0],
            height: self.size[1],
            interleave: options.interleave,
            per_bounce: options.per_bounce(),
            bounces: options.bounces,
            from_emitters: fitted.from_emitters,
            tests: options.tests(),
            compensated: options.compensate.is_on().into(),
            seed: self.setup.pixel_seed(frame),
            lights: self.lights,
            unit: fitted.unit,
            bound: params.bound,
            tail: self.setup.has_tail().into(),
            emitted: fitted.emitted,
            confidence: params.confidence,
            moved: params.moved,
            turned: params.turned,
            changed: params.changed,
            outliers: params.outliers,
            depth: params.depth,
            normal: params.normal,
            area: fitted.area,
            moving: fitted.moved().into(),
            path_tests: options.path_tests(),
            paths: params.paths,
            path_bounces: self.setup.path_bounces(),
            path_parts: options.path_parts(),
            inner: self.cuts.as_ref().map_or(0, |c| c.tree.layout().inner()),
            branches: self.cuts.as_ref().map_or(0, |c| c.tree.layout().len()),
            pad0: 0,
            pad1: 0,
            pad2: 0,
        };
        if let Some(cuts) = &self.cuts {
            let (receivers, seed) = (self.size[0] * self.size[1], self.setup.tree_seed(frame));
            cuts.tree
                .prepare(queue, &TreeParams { receivers, tau: params.tau, seed, ..TreeParams::default() });
        }
        queue.write_buffer(&self.own.settings, 0, bytemuck::bytes_of(&settings));
        if self.setup.map_lights() > 0 {
            self.slots.write_points(queue, &points(&self.setup, Use::Maps, frame, self.setup.map_lights()));
        }
        let of_emitters = points(&self.setup, Use::Emitters, frame, fitted.from_emitters);
        queue.write_buffer(&self.own.emitter_points, 0, bytemuck::cast_slice(&of_emitters));
        let mut of_bounces = Vec::new();
        for k in 0..self.setup.runs() {
            let run = self.setup.run(k);
            let choice = self.setup.choice(run, frame);
            queue.write_buffer(&self.runs[k as usize][1], 0, bytemuck::bytes_of(&choice));
            of_bounces.extend(points(&self.setup, Use::Bounce(run.bounce), frame, run.count));
        }
        queue.write_buffer(&self.own.bounce_points, 0, bytemuck::cast_slice(&of_bounces));
    }

    /// Writes what depends on the geometry alone.
    fn write_geometry(&self, queue: &Queue) {
        let fitted = &self.setup.fitted;
        queue.write_buffer(&self.own.emitters, 0, bytemuck::cast_slice(&fitted.emitters));
        queue.write_buffer(&self.own.surfaces, 0, bytemuck::cast_slice(&fitted.surfaces));
        if let Some(atlas) = &self.atlas {
            atlas.write(queue, &fitted.points);
            atlas.prepare(queue, &self.setup.options.shadow_maps());
        }
        if self.setup.follows_motion() {
            let triangles: Vec<[u32; 4]> = fitted.triangles.iter().map(|&[a, b, c]| [a, b, c, 0]).collect();
            queue.write_buffer(&self.own.mesh_triangles, 0, bytemuck::cast_slice(&triangles));
        }
    }

    fn write_movement(&self, queue: &Queue) {
        let fitted = &self.setup.fitted;
        if self.setup.follows_motion() && fitted.moved() {
            let padded = |v: &[glam::Vec3]| v.iter().map(|p| Vec3Pad::new(*p, 0.0)).collect::<Vec<_>>();
            queue.write_buffer(&self.own.vertices_now, 0, bytemuck::cast_slice(&padded(&fitted.now)));
            queue.write_buffer(&self.own.vertices_before, 0, bytemuck::cast_slice(&padded(&fitted.before)));
        }
    }
}

impl GpuTechnique for InstantRadiosity {
    type Maps = Maps;

    fn sizes(setup: &Setup, size: [u32; 2], maps: usize) -> Sizes {
        Sizes { size, pixels: u64::from(size[0]) * u64::from(size[1]), maps, setup: setup.clone() }
    }

    fn plan(s: &Sizes) -> Plan {
        let resolution = s.setup.options.resolution;
        let mut plan = Maps::plan(resolution, s.maps)
            .and(VplSlots::plan(s.selection(), resolution, s.maps))
            .and(AccelBuffers::plan(&TreeSizes::of(&s.setup.fitted.tree)))
            .and(OwnBuffers::plan(s));
        if let Some([points, tiles]) = s.atlas() {
            plan = plan.and(Atlas::plan(&s.setup.options.shadow_maps(), points, tiles));
        }
        if s.setup.options.has_cuts() {
            let lights = s.setup.options.slots().into();
            plan = plan.and(CutBuffers::plan(s)).and(LightTree::plan(lights, s.pixels));
        }
        (0..s.setup.runs()).for_each(|_| {
            plan.uniform::<BounceRange>("range");
            plan.uniform::<PointChoice>("choice");
        });
        ranges(&s.setup.options).for_each(|_| plan.uniform::<LightRange>("lights_range"));
        plan
    }

    fn allocate(device: &Device, queue: &Queue, s: &Sizes, setup: &Setup) -> Result<Buffers, GpuError> {
        let resolution = setup.options.resolution;
        let mut first = 0;
        let run = |k| {
            let run = setup.run(k);
            let range = BounceRange {
                source_first: run.source,
                target_first: run.target,
                count: run.count,
                point_first: first,
            };
            first += run.count;
            [
                uniform_buffer(device, "range", &range),
                uniform_buffer(device, "choice", &PointChoice::default()),
            ]
        };
        let atlas =
            |[points, tiles]: [u32; 2]| Atlas::new(device, &setup.options.shadow_maps(), points, tiles);
        let buffers = Buffers {
            rsm: Maps::new(device, resolution, s.maps)?,
            own: OwnBuffers::new(device, s)?,
            slots: VplSlots::new(device, s.selection(), resolution, s.maps)?,
            accel: AccelBuffers::upload(device, queue, &setup.fitted.tree)?,
            cuts: s.cuts(device)?,
            atlas: s.atlas().map(atlas).transpose()?,
            runs: (0..setup.runs()).map(run).collect(),
            ranges: ranges(&setup.options).map(|r| uniform_buffer(device, "lights_range", &r)).collect(),
            setup: setup.clone(),
            size: s.size,
            lights: 0,
            frame: 0,
        };
        buffers.write_geometry(queue);
        queue.write_buffer(&buffers.own.count, 0, bytemuck::bytes_of(&setup.options.slots()));
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
        Ok(Buffers { own, cuts: sizes.cuts(device)?, size: sizes.size, ..old.clone() })
    }

    fn maps(buffers: &Buffers) -> &Maps {
        &buffers.rsm
    }

    fn named(b: &Buffers) -> Vec<Named<'_>> {
        let mut all = b.own.named();
        all.extend(b.accel.named());
        all.extend(b.atlas.iter().flat_map(|a| a.buffers.named()));
        all
    }

    fn prepare(b: &mut Buffers, queue: &Queue, inputs: &Inputs<'_>, setup: &Setup) -> Result<(), Error> {
        setup.params.validate()?;
        if setup.options.has_cuts() && setup.options.visibility == Visibility::Rays {
            let rays = setup.options.shadow_rays;
            if !(1..=MOST_RAYS).contains(&rays) {
                let needed = "1 to 64 with gather=cuts and visibility=rays on the GPU";
                return Err(BadOption::new("shadow-rays", rays, needed).into());
            }
        }
        b.rsm.prepare(queue, inputs.lights, inputs.views)?;
        let moved = !std::sync::Arc::ptr_eq(&b.setup.fitted.now, &setup.fitted.now);
        b.setup = setup.clone();
        if moved {
            b.write_geometry(queue);
            b.accel.write(queue, &setup.fitted.tree)?;
        }
        b.write_movement(queue);
        let lights: Vec<_> =
            inputs.lights.iter().filter(|l| l.power.max_element() > 0.0).map(PunctualLight::new).collect();
        let lights = &lights[..lights.len().min(LIGHTS)];
        queue.write_buffer(&b.own.punctual_lights, 0, bytemuck::cast_slice(lights));
        b.lights = lights.len() as u32;
        let view = ViewUniform::new(inputs.camera, b.size, 0);
        queue.write_buffer(&b.own.present_view, 0, bytemuck::bytes_of(&view));
        b.write_frame(queue, b.frame);
        b.frame = b.frame.wrapping_add(1);
        Ok(())
    }

    fn restore(b: &Buffers, queue: &Queue, past: &Output) {
        b.write_frame(queue, past.frame);
        match past.history.as_ref().filter(|_| b.setup.options.has_history()) {
            Some(h) => {
                let view = ViewUniform::new(&h.view, h.size, 0);
                queue.write_buffer(&b.own.previous_view, 0, bytemuck::bytes_of(&view));
                queue.write_buffer(&b.own.past_irradiance, 0, bytemuck::cast_slice(&h.irradiance));
                queue.write_buffer(&b.own.past_normals, 0, bytemuck::cast_slice(&h.normals));
            }
            None => queue.write_buffer(&b.own.past_normals, 0, &vec![0; b.own.past_normals.size() as usize]),
        }
    }

    fn image_buffer(b: &Buffers) -> &Buffer {
        &b.own.image
    }
}

pub(crate) fn vpls(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let count = b.setup.map_lights();
    if count > 0 && !b.buffers.rsm.maps.is_empty() {
        b.buffers.slots.draw(b.pipelines, pass, &b.buffers.rsm)?;
        let bytes = u64::from(count) * size_of::<Vpl>() as u64;
        pass.copy("vpls", (&b.buffers.slots.buffers.slots, 0), (&b.buffers.own.vpls, 0), bytes);
    }
    Ok(())
}

pub(crate) fn emit(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&INSTANT_RADIOSITY_EMIT, "emit"), b.setup.fitted.from_emitters.into(), &[])
}

pub(crate) fn bounce(b: &Build<'_>, pass: &mut Pass, number: u32) -> Result<(), GpuError> {
    let [range, choice] = &b.buffers.runs[number as usize];
    let own = [named("range", range), named("choice", choice)];
    let entry = if b.setup.options.bounce == Bounce::Rays {
        (&INSTANT_RADIOSITY_BOUNCE, "bounce_rays")
    } else {
        (&INSTANT_RADIOSITY_POINTS, "bounce_points")
    };
    b.compute(pass, entry, b.setup.run(number).count.into(), &own)
}

pub(crate) fn shadows(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let Some(atlas) = &b.buffers.atlas else { return Ok(()) };
    atlas.splat(b.pipelines, pass, b.named())?;
    atlas.pull(b.pipelines, pass, b.named())?;
    atlas.push(b.pipelines, pass, b.named())
}

pub(crate) fn summary(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&INSTANT_RADIOSITY_SUMMARY, "summarise"), 1, &[])
}

pub(crate) fn tree(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let Some(Cuts { lights, tree }) = &b.buffers.cuts else { return Ok(()) };
    let slots = b.setup.options.slots().into();
    b.compute(pass, (&INSTANT_RADIOSITY_TAILED, "tailed_lights"), slots, &lights.named())?;
    let list = [named("vpls", &lights.tailed), named("count", &b.buffers.own.count)];
    tree.build(b.pipelines, pass, &list)?;
    let mut receivers = list.to_vec();
    receivers.extend_from_slice(b.named());
    tree.reference(b.pipelines, pass, &receivers)?;
    tree.solve_reach(b.pipelines, pass)
}

fn gather_cuts(b: &Build<'_>, pass: &mut Pass, tree: &LightTree) -> Result<(), GpuError> {
    let [across, down] = [0, 1].map(|axis| u64::from(b.sizes.size[axis].div_ceil(TILE_SIZE[axis])));
    let module = match b.setup.options.visibility {
        Visibility::Rays => &INSTANT_RADIOSITY_CUTS,
        Visibility::Maps => &INSTANT_RADIOSITY_CUTS_MAPS,
        Visibility::Off => &INSTANT_RADIOSITY_CUTS_OPEN,
    };
    let own = [named("branches", &tree.buffers.branches), named("gathered", &b.buffers.own.image)];
    b.compute(pass, (module, "gather_cuts"), across * down * TILE as u64, &own)
}

pub(crate) fn gather(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    if let Some(cuts) = &b.buffers.cuts {
        return gather_cuts(b, pass, &cuts.tree);
    }
    let n = b.setup.options.interleave;
    let [across, down] = b.sizes.size.map(|side| u64::from(side.div_ceil(n)));
    let invocations = across * down * u64::from(n * n);
    let module = match b.setup.options.visibility {
        Visibility::Rays => &INSTANT_RADIOSITY_GATHER,
        Visibility::Maps => &INSTANT_RADIOSITY_GATHER_MAPS,
        Visibility::Off => &INSTANT_RADIOSITY_GATHER_OPEN,
    };
    b.buffers.ranges.iter().try_for_each(|range| {
        let own = [named("lights_range", range), named("gathered", &b.buffers.own.image)];
        b.compute(pass, (module, "gather"), invocations, &own)
    })
}

pub(crate) fn compensate(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let module = match b.setup.options.visibility {
        Visibility::Rays => &INSTANT_RADIOSITY_COMPENSATE,
        Visibility::Maps => &INSTANT_RADIOSITY_COMPENSATE_MAPS,
        Visibility::Off => &INSTANT_RADIOSITY_COMPENSATE_OPEN,
    };
    b.compute(pass, (module, "compensate"), b.sizes.pixels, &[named("gathered", &b.buffers.own.image)])
}

pub(crate) fn movement(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&INSTANT_RADIOSITY_MOVEMENT, "movement"), b.sizes.pixels, &[])
}

pub(crate) fn merge(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let own = &b.buffers.own;
    b.compute(pass, (&INSTANT_RADIOSITY_MERGE, "merge"), b.sizes.pixels, &[named("gathered", &own.image)])?;
    if b.setup.options.has_history() {
        pass.copy(
            "past_irradiance",
            (&own.irradiance, 0),
            (&own.past_irradiance, 0),
            own.past_irradiance.size(),
        );
        pass.copy("past_normals", (&own.merged_normals, 0), (&own.past_normals, 0), own.past_normals.size());
        let bytes = own.previous_view.size();
        pass.copy("previous_view", (&own.present_view, 0), (&own.previous_view, 0), bytes);
    }
    Ok(())
}
