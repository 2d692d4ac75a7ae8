use indirect_shaders::{Binding, EntryPoint, Module};
use wgpu::{
    BindGroup, BindGroupEntry, BindGroupLayout, BindingResource, ComputePipeline, Device, PipelineLayout,
    ShaderStages,
};

use crate::bindings::{Named, bind_group, bind_group_layout};
use crate::{GpuError, PassTimer};

/// Compiles a module of `indirect_shaders`.
#[must_use]
pub fn shader_module(device: &Device, module: &Module) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(module.name),
        source: wgpu::ShaderSource::Wgsl(module.source().into()),
    })
}

/// One compute entry point, ready to run.
///
/// For a module of the table of `indirect_shaders` the layouts are explicit, so that instances share bind groups; for any other
/// they are what wgpu derives.
#[derive(Debug, Clone)]
pub struct Kernel {
    name: String,
    pipeline: ComputePipeline,
    entry_point: Option<&'static EntryPoint>,
}

impl Kernel {
    /// Builds the pipeline of an entry point, with values for its `override` constants.
    #[must_use]
    pub fn new(device: &Device, module: &Module, entry_point: &str, constants: &[(&str, f64)]) -> Self {
        let known = module.entry_point(entry_point);
        let layout = known.map(|e| compute_layout(device, e, None));
        Self::with_layout(device, module, entry_point, constants, layout)
    }

    /// [`Self::new`] whose bind group 0 is shared with other stages: `shared` is its layout.
    pub(crate) fn with_shared(
        device: &Device,
        module: &Module,
        entry_point: &str,
        shared: &BindGroupLayout,
    ) -> Self {
        let known = module.entry_point(entry_point);
        let layout = known.map(|e| compute_layout(device, e, Some(shared)));
        Self::with_layout(device, module, entry_point, &[], layout)
    }

    fn with_layout(
        device: &Device,
        module: &Module,
        entry_point: &str,
        constants: &[(&str, f64)],
        layout: Option<PipelineLayout>,
    ) -> Self {
        let shader = shader_module(device, module);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: layout.as_ref(),
            module: &shader,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        });
        Self { name: entry_point.to_owned(), pipeline, entry_point: module.entry_point(entry_point) }
    }

    /// Invocations of a workgroup; 64×1×1 for a module outside of the table.
    #[must_use]
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.entry_point.map_or([64, 1, 1], |e| e.workgroup_size)
    }

    /// All that it binds; nothing for a module outside of the table.
    #[must_use]
    pub fn bindings(&self) -> &'static [Binding] {
        self.entry_point.map_or(&[], |e| e.bindings)
    }

    /// Bind group `group` of this kernel from resources by name, see [`bind_group`].
    ///
    /// # Errors
    /// As there.
    pub fn group(&self, device: &Device, group: u32, lists: &[&[Named<'_>]]) -> Result<BindGroup, GpuError> {
        let bindings = self.bindings().iter().filter(|b| b.group == group);
        bind_group(device, &self.pipeline.get_bind_group_layout(group), &self.name, bindings, lists)
    }

    /// Bind group `group` of this kernel from `(binding, resource)` pairs: for modules outside of the table.
    #[must_use]
    pub fn bind(&self, device: &Device, group: u32, resources: &[(u32, BindingResource<'_>)]) -> BindGroup {
        let layout = &self.pipeline.get_bind_group_layout(group);
        let pairs = resources.iter().cloned();
        let entries: Vec<_> = pairs.map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.name),
            layout,
            entries: &entries,
        })
    }

    /// Encodes one compute pass that runs `workgroups`; the bind groups are 0, 1, … in order.
    pub fn dispatch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut PassTimer,
        name: &'static str,
        groups: &[&BindGroup],
        workgroups: [u32; 3],
    ) {
        timer.compute(encoder, name, |pass| {
            self.set(pass, groups.iter().copied());
            let [x, y, z] = workgroups;
            pass.dispatch_workgroups(x, y, z);
        });
    }

    /// The pipeline.
    #[must_use]
    pub const fn pipeline(&self) -> &ComputePipeline {
        &self.pipeline
    }

    /// Sets pipeline and bind groups 0, 1, … of a compute pass that the caller began.
    pub fn set<'a>(&self, pass: &mut wgpu::ComputePass<'_>, groups: impl Iterator<Item = &'a BindGroup>) {
        pass.set_pipeline(&self.pipeline);
        for (i, group) in (0..).zip(groups) {
            pass.set_bind_group(i, group, &[]);
        }
    }
}

fn compute_layout(device: &Device, entry: &EntryPoint, shared: Option<&BindGroupLayout>) -> PipelineLayout {
    let groups = entry.bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
    let own: Vec<_> =
        (0..groups).map(|g| bind_group_layout(device, g, &[entry], ShaderStages::COMPUTE)).collect();
    let layouts: Vec<_> =
        own.iter().enumerate().map(|(g, own)| Some(shared.filter(|_| g == 0).unwrap_or(own))).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry.name),
        bind_group_layouts: &layouts,
        ..Default::default()
    })
}

/// Most workgroups along one dimension on any WebGPU device.
const MAX_WORKGROUPS: u64 = 65_535;

/// Workgroups for `invocations` along one dimension, folded into rows where one dimension is not enough: `core/grid.wgsl`
/// gives the index back.
///
/// # Errors
/// [`GpuError::Limit`] beyond 65 535² workgroups, or 2³² invocations, which a 32-bit index cannot tell apart.
pub fn workgroups_1d(invocations: u64, workgroup_size: u32) -> Result<[u32; 3], GpuError> {
    let groups = invocations.div_ceil(u64::from(workgroup_size.max(1)));
    let y = groups.div_ceil(MAX_WORKGROUPS).max(1);
    let x = groups.div_ceil(y);
    // The last row may be padded: its invocations count too.
    let last = x * y * u64::from(workgroup_size);
    if y > MAX_WORKGROUPS || last > 1 << 32 {
        let (limit, available) = ("32-bit invocation index", 1 << 32);
        return Err(GpuError::Limit { what: "a compute grid", limit, needed: invocations, available });
    }
    Ok([x as u32, y as u32, 1])
}

/// Workgroups that cover an image of `size` texels.
#[must_use]
pub const fn workgroups_2d(size: [u32; 2], workgroup_size: [u32; 2]) -> [u32; 3] {
    [size[0].div_ceil(workgroup_size[0]), size[1].div_ceil(workgroup_size[1]), 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_cover_everything_within_the_limits() {
        for n in [0, 1, 63, 64, 65, 65_535 * 64, 65_535 * 64 + 1, 100_000_007, (1 << 32) - (1 << 24)] {
            let [x, y, z] = workgroups_1d(n, 64).unwrap();
            assert!(x <= 65_535 && y <= 65_535 && z == 1);
            let covered = u64::from(x) * u64::from(y) * 64;
            // At most one row of padding groups and one partial group.
            assert!(covered >= n && covered - n < 64 * (u64::from(y) + 1), "{n}: {x}×{y}");
        }
        assert!(workgroups_1d(1 << 33, 64).is_err());
        assert_eq!(workgroups_2d([1, 1], [8, 8]), [1, 1, 1]);
        assert_eq!(workgroups_2d([127, 64], [8, 8]), [16, 8, 1]);
    }
}
