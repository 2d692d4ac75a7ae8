use crate::{Frame, Technique};

#[cfg(feature = "gpu")]
use crate::gpu::{Build, Exchange};
#[cfg(feature = "gpu")]
use indirect_gpu::{GpuError, Pass};

type CpuFn<T> = fn(&Frame<'_, <T as Technique>::Setup>, &mut <T as Technique>::Output, u32);
#[cfg(feature = "gpu")]
type GpuFn<T> = fn(&Build<'_, T>, &mut Pass, u32) -> Result<(), GpuError>;
#[cfg(feature = "gpu")]
type DataFn<T> = fn(&<T as Technique>::Buffers, &mut <T as Technique>::Output, &mut Exchange<'_>, u32);

/// A pass, registered once; [`passes!`](crate::passes) makes the rows of a technique.
pub struct Row<T: Technique> {
    name: &'static str,
    times: fn(&T::Setup) -> u32,
    cpu: Option<CpuFn<T>>,
    #[cfg(feature = "gpu")]
    gpu: Option<GpuFn<T>>,
    #[cfg(feature = "gpu")]
    data: Option<DataFn<T>>,
}

impl<T: Technique> Row<T> {
    /// A pass that does nothing yet. `times` says how often it runs in a frame, 0 where the setup does not ask for it; each run
    /// has a number, from 0.
    #[must_use]
    pub const fn new(name: &'static str, times: fn(&T::Setup) -> u32) -> Self {
        Self {
            name,
            times,
            cpu: None,
            #[cfg(feature = "gpu")]
            gpu: None,
            #[cfg(feature = "gpu")]
            data: None,
        }
    }

    /// Its CPU function: computes results from those of the passes before.
    #[must_use]
    pub const fn cpu(mut self, cpu: CpuFn<T>) -> Self {
        self.cpu = Some(cpu);
        self
    }

    /// What adds its steps on the GPU.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub const fn gpu(mut self, gpu: GpuFn<T>) -> Self {
        self.gpu = Some(gpu);
        self
    }

    /// What names the buffers that hold its results beside their places in the output.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub const fn data(mut self, data: DataFn<T>) -> Self {
        self.data = Some(data);
        self
    }

    /// Its name, the same on both backends.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// How often it runs in a frame of this setup.
    #[must_use]
    pub fn times(&self, setup: &T::Setup) -> u32 {
        (self.times)(setup)
    }

    /// Runs it on the CPU.
    pub fn run_cpu(&self, frame: &Frame<'_, T::Setup>, output: &mut T::Output, number: u32) {
        if let Some(cpu) = self.cpu {
            cpu(frame, output, number);
        }
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn build(&self, build: &Build<'_, T>, number: u32) -> Result<Pass, GpuError> {
        let mut pass = Pass::new(self.name);
        if let Some(gpu) = self.gpu {
            gpu(build, &mut pass, number)?;
        }
        Ok(pass)
    }

    #[cfg(feature = "gpu")]
    pub(crate) fn exchange(
        &self,
        buffers: &T::Buffers,
        output: &mut T::Output,
        exchange: &mut Exchange<'_>,
        number: u32,
    ) {
        if let Some(data) = self.data {
            exchange.begin(self.name);
            data(buffers, output, exchange, number);
        }
    }
}

/// The rows of a technique: `passes!(Technique, [Row { name: …, times: …, cpu: …, gpu: …, data: … }, …])`, see [`Row`]. Where the
/// caller's own features `cpu` or `gpu` are off, their parts are left out.
#[macro_export]
macro_rules! passes {
    ($technique:ty, [$(Row {
        name: $name:expr, times: $times:expr, cpu: $cpu:expr, gpu: $gpu:expr, data: $data:expr $(,)?
    }),* $(,)?]) => {
        vec![$({
            let row = $crate::Row::<$technique>::new($name, $times);
            #[cfg(feature = "cpu")]
            let row = row.cpu($cpu);
            #[cfg(feature = "gpu")]
            let row = row.gpu($gpu);
            #[cfg(all(feature = "cpu", feature = "gpu"))]
            let row = row.data($data);
            row
        }),*]
    };
}
