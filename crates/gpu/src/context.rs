use core::fmt;

use bytemuck::Pod;
use indirect_shaders::Module;
use wgpu::{Adapter, Backends, Device, DeviceType, Features, Instance, Limits, Queue};

use crate::{GpuError, Kernel, PassTimer, read_buffer, storage_buffer, workgroups_1d};

/// Environment variable that [`AdapterChoice::from_env`] reads.
pub const ADAPTER_VARIABLE: &str = "INDIRECT_ADAPTER";

/// Which adapter a [`Context`] opens.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AdapterChoice {
    /// A software adapter where there is one, any other where not: the same results on most machines.
    #[default]
    SoftwareFirst,
    /// The fastest kind: discrete, then integrated, virtual, software.
    Any,
    /// The first adapter whose name contains this text, whatever the case.
    Named(String),
}

impl AdapterChoice {
    /// `software` and nothing mean [`Self::SoftwareFirst`], `any` means [`Self::Any`], all else is a part of a name.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        match text {
            "" | "software" => Self::SoftwareFirst,
            "any" => Self::Any,
            name => Self::Named(name.to_owned()),
        }
    }

    /// [`Self::parse`] of the environment variable `INDIRECT_ADAPTER`.
    #[must_use]
    pub fn from_env() -> Self {
        std::env::var(ADAPTER_VARIABLE).map_or(Self::SoftwareFirst, |text| Self::parse(&text))
    }

    /// Smaller is better; `None` where the adapter does not fit.
    fn rank(&self, name: &str, kind: DeviceType) -> Option<u32> {
        let speed = match kind {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        match self {
            Self::SoftwareFirst => Some(if kind == DeviceType::Cpu { 0 } else { 1 + speed }),
            Self::Any => Some(speed),
            Self::Named(wanted) => name.to_lowercase().contains(&wanted.to_lowercase()).then_some(speed),
        }
    }
}

impl fmt::Display for AdapterChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SoftwareFirst | Self::Any => f.write_str("of any kind"),
            Self::Named(name) => write!(f, "named `{name}`"),
        }
    }
}

/// A device without a window, for tests and tools. A renderer has its own device and needs none of this.
///
/// It asks for WebGPU's default limits and for no feature but timestamps, where the adapter has them: what runs here runs
/// on any WebGPU device.
#[derive(Debug, Clone)]
pub struct Context {
    /// The device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// Name, driver and kind of the adapter.
    pub info: wgpu::AdapterInfo,
}

impl Context {
    /// Opens a device with default limits. Blocks.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoDevice`].
    pub fn new(choice: &AdapterChoice) -> Result<Self, GpuError> {
        Self::with_limits(choice, &Limits::default())
    }

    /// [`Self::new`] for a device with these limits, see [`Plan::required_limits`](crate::Plan::required_limits); of storage
    /// bindings, buffers and textures as large as the default where they ask for less.
    ///
    /// # Errors
    /// As [`Self::new`], and [`GpuError::Limit`] where the adapter has less.
    pub fn with_limits(choice: &AdapterChoice, limits: &Limits) -> Result<Self, GpuError> {
        let instance = Instance::default();
        let adapters = pollster::block_on(instance.enumerate_adapters(Backends::all()));
        let names = || adapters.iter().map(|a| a.get_info().name).collect::<Vec<_>>();
        let adapter = adapters
            .iter()
            .filter_map(|a| {
                let info = a.get_info();
                Some((choice.rank(&info.name, info.device_type)?, a))
            })
            .min_by_key(|(rank, _)| *rank)
            .map(|(_, adapter)| adapter)
            .ok_or_else(|| GpuError::NoAdapter {
                wanted: choice.to_string(),
                found: if adapters.is_empty() { "none".to_owned() } else { names().join(", ") },
            })?;
        Self::open(adapter, limits)
    }

    fn open(adapter: &Adapter, wanted: &Limits) -> Result<Self, GpuError> {
        let (has, mut limits) = (adapter.limits(), Limits::default());
        let raise = |limit, default: u64, wanted: u64, available: u64| {
            let needed = default.max(wanted);
            let what = "the largest buffer or texture";
            if needed > default && needed > available {
                return Err(GpuError::Limit { what, limit, needed, available });
            }
            Ok(needed)
        };
        limits.max_storage_buffer_binding_size = raise(
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
            wanted.max_storage_buffer_binding_size,
            has.max_storage_buffer_binding_size,
        )?;
        limits.max_buffer_size =
            raise("max_buffer_size", limits.max_buffer_size, wanted.max_buffer_size, has.max_buffer_size)?;
        limits.max_texture_dimension_2d = raise(
            "max_texture_dimension_2d",
            limits.max_texture_dimension_2d.into(),
            wanted.max_texture_dimension_2d.into(),
            has.max_texture_dimension_2d.into(),
        )? as u32;
        let info = adapter.get_info();
        let request = wgpu::DeviceDescriptor {
            label: Some("indirect"),
            required_features: adapter.features() & (Features::TIMESTAMP_QUERY | Features::FLOAT32_BLENDABLE),
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&request))
            .map_err(|e| GpuError::NoDevice { adapter: info.name.clone(), reason: e.to_string() })?;
        Ok(Self { device, queue, info })
    }

    /// Names of all adapters, best first by [`AdapterChoice::Any`]. Blocks.
    #[must_use]
    pub fn adapters() -> Vec<wgpu::AdapterInfo> {
        let adapters = pollster::block_on(Instance::default().enumerate_adapters(Backends::all()));
        let mut infos: Vec<_> = adapters.iter().map(Adapter::get_info).collect();
        infos.sort_by_key(|i| AdapterChoice::Any.rank(&i.name, i.device_type));
        infos
    }

    /// One line: name, kind, backend and driver of the adapter.
    #[must_use]
    pub fn describe(&self) -> String {
        let i = &self.info;
        format!("{} ({:?}, {:?}, {} {})", i.name, i.device_type, i.backend, i.driver, i.driver_info)
    }

    /// [`read_buffer`] with this device. Blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        read_buffer(&self.device, &self.queue, buffer)
    }

    /// Runs one compute entry point once per input and reads what it wrote: the quickest way to compare a WGSL function
    /// with its twin. Blocks.
    ///
    /// The entry point has a workgroup of 64×1×1 and binds, in group 0, the inputs as `array<I>` at binding 0 (read) and
    /// `outputs` elements of `O`, initially zero, at binding 1 (read, write). It must check its index against the
    /// length of its data.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where the buffers are too large, [`GpuError::ReadBack`].
    pub fn run<I: Pod, O: Pod>(
        &self,
        module: &Module,
        entry_point: &str,
        inputs: &[I],
        outputs: usize,
    ) -> Result<Vec<O>, GpuError> {
        let input = storage_buffer(&self.device, "inputs", inputs)?;
        let output = storage_buffer(&self.device, "outputs", &vec![O::zeroed(); outputs])?;
        let kernel = Kernel::new(&self.device, module, entry_point, &[]);
        let group =
            kernel.bind(&self.device, 0, &[(0, input.as_entire_binding()), (1, output.as_entire_binding())]);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let workgroups = workgroups_1d(inputs.len() as u64, 64)?;
        kernel.dispatch(&mut encoder, &mut PassTimer::off(), "run", &[&group], workgroups);
        self.queue.submit([encoder.finish()]);
        self.read(&output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_parse_and_rank() {
        use DeviceType::{Cpu, DiscreteGpu, IntegratedGpu};
        assert_eq!(AdapterChoice::parse(""), AdapterChoice::SoftwareFirst);
        assert_eq!(AdapterChoice::parse("software"), AdapterChoice::SoftwareFirst);
        assert_eq!(AdapterChoice::parse("any"), AdapterChoice::Any);
        let named = AdapterChoice::parse("RTX");
        assert_eq!(named.rank("NVIDIA GeForce rtx 4070", DiscreteGpu), Some(0));
        assert_eq!(named.rank("llvmpipe", Cpu), None);
        let rank = |choice: &AdapterChoice, kind| choice.rank("x", kind).unwrap();
        assert!(rank(&AdapterChoice::SoftwareFirst, Cpu) < rank(&AdapterChoice::SoftwareFirst, DiscreteGpu));
        assert!(rank(&AdapterChoice::Any, DiscreteGpu) < rank(&AdapterChoice::Any, IntegratedGpu));
        assert!(rank(&AdapterChoice::Any, IntegratedGpu) < rank(&AdapterChoice::Any, Cpu));
    }

    #[test]
    fn no_adapter_says_what_to_install() {
        let name = "an adapter that nobody has";
        let e = Context::new(&AdapterChoice::Named(name.into())).unwrap_err();
        let text = e.to_string();
        assert!(text.contains(name) && text.contains("apt-get install mesa-vulkan-drivers"), "{text}");
        assert_eq!(text.lines().count(), 1);
    }
}
