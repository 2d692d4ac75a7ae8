use indirect_shaders::{BindingKind, Module};
use wgpu::{BindGroup, BindingResource, Buffer, CommandEncoder, RenderPipeline, TextureView};

use crate::bindings::find;
use crate::{
    GBufferTarget, GpuError, Kernel, Named, PassTimer, Pipelines, Raster, SceneBuffers, workgroups_1d,
};

/// A pass of a technique: steps that are timed and compared together. It is made once and encoded each frame, for which it
/// allocates nothing.
#[derive(Debug)]
pub struct Pass {
    name: &'static str,
    steps: Vec<Step>,
    uses: Vec<Use>,
}

/// A buffer that a pass uses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Use {
    /// The name that WGSL gives it.
    pub name: &'static str,
    /// Whether the pass may write there.
    pub writes: bool,
    /// The buffer.
    pub buffer: Buffer,
}

#[derive(Debug)]
enum Step {
    /// `scene`: the group is 1, and group 0 the scene's.
    Compute {
        kernel: Kernel,
        group: BindGroup,
        scene: bool,
        workgroups: Workgroups,
    },
    Surface(Box<(Raster, GBufferTarget)>),
    Draw {
        pipeline: RenderPipeline,
        group: BindGroup,
        target: TextureView,
        arguments: Buffer,
        offset: u64,
    },
    Copy {
        from: Buffer,
        from_offset: u64,
        to: Buffer,
        to_offset: u64,
        bytes: u64,
    },
}

#[derive(Debug)]
enum Workgroups {
    Count([u32; 3]),
    Indirect(Buffer, u64),
}

impl Pass {
    /// A pass without steps.
    #[must_use]
    pub const fn new(name: &'static str) -> Self {
        Self { name, steps: Vec::new(), uses: Vec::new() }
    }

    /// Its name.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// The buffers that it uses, in the order of its steps, uniforms left out.
    #[must_use]
    pub fn uses(&self) -> &[Use] {
        &self.uses
    }

    /// Notes a use that does not follow from a kernel's bindings: that of a draw.
    pub fn note(&mut self, name: &'static str, buffer: &Buffer, writes: bool) {
        let new = Use { name, writes, buffer: buffer.clone() };
        if !self.uses.contains(&new) {
            self.uses.push(new);
        }
    }

    /// Whether there is nothing to do.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Adds a dispatch of so many invocations in one dimension, which binds in group 0 what the entry point uses by the names
    /// that WGSL gives it; see [`bind_group`](crate::bind_group). Where the entry point has bindings in group 1, these are meant,
    /// and group 0 is that of the scene given to [`Self::encode`]; there is nothing to do where none is given.
    ///
    /// # Errors
    /// As there, and [`GpuError::Limit`] for more invocations than a dispatch can have.
    pub fn compute(
        &mut self,
        pipelines: &Pipelines,
        (module, entry_point): (&Module, &'static str),
        invocations: u64,
        lists: &[&[Named<'_>]],
    ) -> Result<(), GpuError> {
        let kernel = pipelines.kernel(module, entry_point);
        let [x, y, z] = kernel.workgroup_size();
        let workgroups = Workgroups::Count(workgroups_1d(invocations, x * y * z)?);
        self.push(pipelines, kernel, workgroups, lists)
    }

    /// [`Self::compute`] with workgroups that the GPU counted: three `u32` at byte `offset` of `arguments`.
    ///
    /// # Errors
    /// As [`bind_group`](crate::bind_group).
    pub fn compute_indirect(
        &mut self,
        pipelines: &Pipelines,
        (module, entry_point): (&Module, &'static str),
        (arguments, offset): (&Buffer, u64),
        lists: &[&[Named<'_>]],
    ) -> Result<(), GpuError> {
        let kernel = pipelines.kernel(module, entry_point);
        self.push(pipelines, kernel, Workgroups::Indirect(arguments.clone(), offset), lists)
    }

    fn push(
        &mut self,
        pipelines: &Pipelines,
        kernel: Kernel,
        workgroups: Workgroups,
        lists: &[&[Named<'_>]],
    ) -> Result<(), GpuError> {
        let scene = kernel.bindings().iter().any(|b| b.group == 1);
        let own = u32::from(scene);
        let group = kernel.group(pipelines.device(), own, lists)?;
        let bindings = kernel.bindings().iter().filter(|b| b.group == own);
        for b in bindings.filter(|b| b.kind != BindingKind::Uniform) {
            if let Some(BindingResource::Buffer(found)) = find(lists, b.name) {
                self.note(b.name, found.buffer, b.kind == BindingKind::ReadWrite);
            }
        }
        self.steps.push(Step::Compute { kernel, group, scene, workgroups });
        Ok(())
    }

    /// Adds the drawing of a G-buffer; nothing to do where [`Self::encode`] is given no scene.
    pub fn surface(&mut self, pipelines: &Pipelines, target: &GBufferTarget) {
        for (name, resource) in target.named() {
            if let BindingResource::Buffer(found) = resource {
                self.note(name, found.buffer, true);
            }
        }
        self.steps.push(Step::Surface(Box::new((pipelines.raster().clone(), target.clone()))));
    }

    /// Adds an indirect draw with the arguments at byte `offset` of `arguments`, into a target that is cleared to 0 before.
    pub fn draw(
        &mut self,
        pipeline: &RenderPipeline,
        group: BindGroup,
        target: &TextureView,
        (arguments, offset): (&Buffer, u64),
    ) {
        let (pipeline, target, arguments) = (pipeline.clone(), target.clone(), arguments.clone());
        self.steps.push(Step::Draw { pipeline, group, target, arguments, offset });
    }

    /// Adds a copy of `bytes` bytes to a buffer of that name, each with the byte at which to begin.
    pub fn copy(
        &mut self,
        name: &'static str,
        (from, from_offset): (&Buffer, u64),
        (to, to_offset): (&Buffer, u64),
        bytes: u64,
    ) {
        self.note(name, to, true);
        let (from, to) = (from.clone(), to.clone());
        self.steps.push(Step::Copy { from, from_offset, to, to_offset, bytes });
    }

    /// Encodes all steps in order.
    pub fn encode(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, scene: Option<&SceneBuffers>) {
        let mut rest = &self.steps[..];
        while let Some(first) = rest.first() {
            // Steps of one kind share what they can: dispatches one compute pass, G-buffers one pass that resolves them.
            let same = |s: &&Step| core::mem::discriminant(*s) == core::mem::discriminant(first);
            let (run, others) = rest.split_at(rest.iter().take_while(same).count());
            rest = others;
            match first {
                Step::Compute { .. } => timer.compute(encoder, self.name, |pass| {
                    let mut last = None;
                    for step in run {
                        let Step::Compute { kernel, group, scene: beside, workgroups } = step else {
                            continue;
                        };
                        let shared = scene.filter(|_| *beside);
                        if *beside && shared.is_none() {
                            continue;
                        }
                        // Encoding is paid by the command: a pipeline is set where it changes.
                        if last.replace(kernel.pipeline()) != Some(kernel.pipeline()) {
                            pass.set_pipeline(kernel.pipeline());
                        }
                        if let Some(scene) = shared {
                            pass.set_bind_group(0, scene.group(), &[]);
                        }
                        pass.set_bind_group(u32::from(*beside), group, &[]);
                        match workgroups {
                            Workgroups::Count([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                            Workgroups::Indirect(buffer, offset) => {
                                pass.dispatch_workgroups_indirect(buffer, *offset);
                            }
                        }
                    }
                }),
                Step::Surface(first) => {
                    let targets = run.iter().filter_map(|s| match s {
                        Step::Surface(surface) => Some(&surface.1),
                        _ => None,
                    });
                    if let Some(scene) = scene {
                        first.0.encode(encoder, timer, self.name, scene, targets);
                    }
                }
                Step::Draw { .. } => {
                    for step in run {
                        step.encode_draw(encoder, timer, self.name);
                    }
                }
                Step::Copy { .. } => {
                    for step in run {
                        let Step::Copy { from, from_offset, to, to_offset, bytes } = step else { continue };
                        encoder.copy_buffer_to_buffer(from, *from_offset, to, *to_offset, *bytes);
                    }
                }
            }
        }
    }
}

impl Step {
    fn encode_draw(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, name: &'static str) {
        let Self::Draw { pipeline, group, target, arguments, offset } = self else { return };
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        };
        let attachment =
            wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
        let descriptor = wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..wgpu::RenderPassDescriptor::default()
        };
        timer.render(encoder, name, &descriptor, |pass| {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw_indirect(arguments, *offset);
        });
    }
}
