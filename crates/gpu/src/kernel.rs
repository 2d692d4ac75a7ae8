use indirect_shaders::Module;
use wgpu::{BindGroup, BindGroupEntry, BindingResource, ComputePipeline, Device};

use crate::{GpuError, PassTimer};

/// Compiles a module of `indirect_shaders`.
#[must_use]
pub fn shader_module(device: &Device, module: &Module) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(module.name),
        source: wgpu::ShaderSource::Wgsl(module.source().into()),
    })
}

/// One compute entry point, ready to run. Its bind group layouts are the shader's own: what the WGSL does not use cannot
/// be bound, what it uses must be.
#[derive(Debug, Clone)]
pub struct Kernel {
    name: String,
    pipeline: ComputePipeline,
}

impl Kernel {
    /// Builds the pipeline of an entry point, with values for its `override` constants.
    #[must_use]
    pub fn new(device: &Device, module: &Module, entry_point: &str, constants: &[(&str, f64)]) -> Self {
        let shader = shader_module(device, module);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            module: &shader,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        });
        Self { name: entry_point.to_owned(), pipeline }
    }

    /// Bind group `group` of this kernel from `(binding, resource)` pairs.
    #[must_use]
    pub fn bind(&self, device: &Device, group: u32, resources: &[(u32, BindingResource<'_>)]) -> BindGroup {
        bind_group(device, &self.pipeline.get_bind_group_layout(group), &self.name, resources)
    }

    /// Encodes one compute pass that runs `workgroups`; the bind groups are 0, 1, … in order.
    pub fn dispatch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut PassTimer,
        groups: &[&BindGroup],
        workgroups: [u32; 3],
    ) {
        timer.compute(encoder, &self.name, |pass| self.record(pass, groups, workgroups));
    }

    /// Records one dispatch into a compute pass that the caller began, for passes of several dispatches. Each sees what
    /// the ones before it wrote.
    pub fn record(&self, pass: &mut wgpu::ComputePass<'_>, groups: &[&BindGroup], workgroups: [u32; 3]) {
        self.set(pass, groups);
        let [x, y, z] = workgroups;
        pass.dispatch_workgroups(x, y, z);
    }

    /// [`Self::record`] with workgroups that the GPU counted: three `u32` at byte `offset` of `workgroups`.
    pub fn record_indirect(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        groups: &[&BindGroup],
        workgroups: &wgpu::Buffer,
        offset: u64,
    ) {
        self.set(pass, groups);
        pass.dispatch_workgroups_indirect(workgroups, offset);
    }

    fn set(&self, pass: &mut wgpu::ComputePass<'_>, groups: &[&BindGroup]) {
        pass.set_pipeline(&self.pipeline);
        for (i, group) in (0..).zip(groups) {
            pass.set_bind_group(i, *group, &[]);
        }
    }
}

pub(crate) fn bind_group(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    label: &str,
    resources: &[(u32, BindingResource<'_>)],
) -> BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
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
