use bytemuck::Pod;
use glam::{Vec3, Vec4};
use indirect_core::layout::{Field, Layout, Number};
use indirect_core::{GBuffer, Image};
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GBufferTarget, GpuError, Vec3Pad, read_range};

/// Contents of a buffer, or of one field of its elements.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Numbers that agree up to rounding.
    F32 {
        /// All components of all elements.
        values: Vec<f32>,
        /// Components per element.
        components: usize,
    },
    /// Numbers that agree exactly.
    U32 {
        /// All components of all elements.
        values: Vec<u32>,
        /// Components per element.
        components: usize,
    },
}

impl Data {
    /// Floats, `components` to an element.
    #[must_use]
    pub fn floats<T: Pod>(elements: &[T], components: usize) -> Self {
        Self::F32 { values: bytemuck::cast_slice(elements).to_vec(), components }
    }

    /// Whole numbers, `components` to an element.
    #[must_use]
    pub fn words<T: Pod>(elements: &[T], components: usize) -> Self {
        Self::U32 { values: bytemuck::cast_slice(elements).to_vec(), components }
    }

    /// Whether there is no element.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        match self {
            Self::F32 { values, .. } => values.is_empty(),
            Self::U32 { values, .. } => values.is_empty(),
        }
    }

    /// One field of every element; `None` for a field that is no plain number.
    fn field<T: Pod>(elements: &[T], field: &Field) -> Option<Self> {
        let components = field.size / 4;
        let bytes: Vec<u8> = elements
            .iter()
            .flat_map(|e| bytemuck::bytes_of(e)[field.offset..field.offset + field.size].iter().copied())
            .collect();
        match field.number {
            Number::F32 => Some(Self::F32 { values: bytemuck::pod_collect_to_vec(&bytes), components }),
            Number::U32 => Some(Self::U32 { values: bytemuck::pod_collect_to_vec(&bytes), components }),
            Number::Other => None,
        }
    }
}

/// One buffer, or one field of its elements, as the CPU's and as the GPU's pass left it.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// Name of the pass.
    pub pass: &'static str,
    /// What it holds.
    pub buffer: String,
    /// What the CPU computed.
    pub cpu: Data,
    /// What the GPU computed.
    pub gpu: Data,
    /// Per element, whether both sides made the same choice there: saw the same triangle, fell to the same side of a texel's
    /// border. `None` where there is no choice.
    pub same: Option<Vec<bool>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// Reads the GPU's results beside the CPU's.
    Compare,
    /// Overwrites the GPU's with the CPU's.
    Upload,
    /// Overwrites the CPU's with the GPU's.
    Download,
}

/// Carries the results of a pass between both backends: a row names each buffer and its place in the output once, and the same
/// list compares, uploads and downloads.
///
/// Slices are as long as the CPU's pass made them. What cannot be read ends the run with an error.
pub struct Exchange<'a> {
    device: &'a Device,
    queue: &'a Queue,
    pub(super) mode: Mode,
    pub(super) twins: Vec<Twin>,
    pub(super) failed: Option<GpuError>,
    pass: &'static str,
    prefix: String,
    same: Option<Vec<bool>>,
}

impl<'a> Exchange<'a> {
    pub(super) fn new(device: &'a Device, queue: &'a Queue) -> Self {
        let (mode, twins, prefix) = (Mode::Compare, Vec::new(), String::new());
        Self { device, queue, mode, twins, failed: None, pass: "", prefix, same: None }
    }

    pub(crate) fn begin(&mut self, pass: &'static str) {
        self.pass = pass;
        self.within("");
    }

    /// Puts `prefix` before the names of the buffers that follow, as of one map among several, and forgets [`Self::same`].
    pub fn within(&mut self, prefix: &str) {
        prefix.clone_into(&mut self.prefix);
        self.same = None;
    }

    /// Elements of the buffers that follow count as compared only where `same`.
    pub fn same(&mut self, same: Option<Vec<bool>>) {
        self.same = same;
    }

    /// What the GPU has in a buffer, `count` elements from element `first`. Empty where it cannot be read.
    pub fn read<T: Pod>(&mut self, buffer: &Buffer, first: usize, count: usize) -> Vec<T> {
        match read_range::<T>(self.device, self.queue, buffer, first as u64, count as u64) {
            Ok(found) => found,
            Err(e) => {
                self.failed.get_or_insert(e);
                Vec::new()
            }
        }
    }

    fn carry<T: Pod>(
        &mut self,
        buffer: &Buffer,
        first: usize,
        cpu: &mut [T],
        compare: impl FnOnce(&mut Self, &[T], &[T]),
    ) {
        let at = (first * size_of::<T>()) as u64;
        match self.mode {
            Mode::Upload => self.queue.write_buffer(buffer, at, bytemuck::cast_slice(cpu)),
            Mode::Download => {
                let found = self.read(buffer, first, cpu.len());
                if found.len() == cpu.len() {
                    cpu.copy_from_slice(&found);
                }
            }
            Mode::Compare => {
                let found = self.read(buffer, first, cpu.len());
                compare(self, cpu, &found);
            }
        }
    }

    /// Adds a comparison of contents that the caller arranged; nothing unless buffers are being compared.
    pub fn compare(&mut self, name: &str, cpu: Data, gpu: Data) {
        if self.mode == Mode::Compare {
            let buffer = format!("{}{name}", self.prefix);
            self.twins.push(Twin { pass: self.pass, buffer, cpu, gpu, same: self.same.clone() });
        }
    }

    /// Structs from element `first` on, compared field by field.
    pub fn elements<T: Layout + Pod>(&mut self, name: &str, buffer: &Buffer, first: usize, cpu: &mut [T]) {
        self.carry(buffer, first, cpu, |x, cpu, gpu| x.compare_elements(name, cpu, gpu));
    }

    /// [`Self::compare`] for structs that the caller arranged, field by field.
    pub fn compare_elements<T: Layout + Pod>(&mut self, name: &str, cpu: &[T], gpu: &[T]) {
        for field in T::FIELDS.iter().filter(|f| !f.is_padding()) {
            if let (Some(cpu), Some(gpu)) = (Data::field(cpu, field), Data::field(gpu, field)) {
                let space = if name.is_empty() { "" } else { " " };
                self.compare(&format!("{name}{space}{}", field.name.replace('_', " ")), cpu, gpu);
            }
        }
    }

    /// Takes over a list that was compared already, whose length is the first word of `count`.
    pub fn take_list<T: Pod + Default>(&mut self, count: &Buffer, buffer: &Buffer, cpu: &mut Vec<T>) {
        if self.mode != Mode::Compare {
            self.length(count, 0, cpu);
            self.carry(buffer, 0, cpu, |_, _, _| {});
        }
    }

    /// Floats, `components` to a compared element.
    pub fn floats<T: Pod>(&mut self, name: &str, buffer: &Buffer, cpu: &mut [T], components: usize) {
        self.carry(buffer, 0, cpu, |x, cpu, gpu| {
            x.compare(name, Data::floats(cpu, components), Data::floats(gpu, components));
        });
    }

    /// Whole numbers.
    pub fn words(&mut self, name: &str, buffer: &Buffer, cpu: &mut [u32]) {
        self.carry(buffer, 0, cpu, |x, cpu, gpu| x.compare(name, Data::words(cpu, 1), Data::words(gpu, 1)));
    }

    /// Whole numbers of which only those count that `used` names: the GPU leaves what was there in the others.
    pub fn words_where(
        &mut self,
        name: &str,
        buffer: &Buffer,
        cpu: &mut [u32],
        used: impl Fn(usize) -> bool,
    ) {
        self.carry(buffer, 0, cpu, |x, cpu, gpu| {
            let pick = |words: &[u32]| -> Vec<u32> {
                words.iter().enumerate().filter(|(i, _)| used(*i)).map(|(_, word)| *word).collect()
            };
            x.compare(name, Data::words(&pick(cpu), 1), Data::words(&pick(gpu), 1));
        });
    }

    /// Whole numbers that are choices where something grazes a border: those that differ are counted, few are allowed.
    pub fn choices(&mut self, name: &str, buffer: &Buffer, cpu: &mut [u32]) {
        self.carry(buffer, 0, cpu, |x, cpu, gpu| {
            let before = x.same.replace(cpu.iter().zip(gpu).map(|(a, b)| a == b).collect());
            x.compare(name, Data::words(cpu, 1), Data::words(gpu, 1));
            x.same = before;
        });
    }

    /// Vectors, which take four floats each on the GPU, from element `first` on.
    pub fn vectors(&mut self, name: &str, buffer: &Buffer, first: usize, cpu: &mut [Vec3]) {
        let mut padded: Vec<_> = cpu.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
        self.carry(buffer, first, &mut padded, |x, cpu, gpu| {
            x.compare(name, Data::floats(cpu, 4), Data::floats(gpu, 4));
        });
        if self.mode == Mode::Download {
            cpu.iter_mut().zip(&padded).for_each(|(v, p)| *v = p.vec3());
        }
    }

    /// Vectors with a fourth number that differs where the two sides made other choices: the vectors are compared where it agrees, and
    /// those where it does not are counted.
    pub fn vectors_by_choice(&mut self, name: &str, buffer: &Buffer, cpu: &mut [Vec4]) {
        let found: Vec<Vec4> = self.read(buffer, 0, cpu.len());
        let before = self.same.replace(cpu.iter().zip(&found).map(|(c, g)| c.w == g.w).collect());
        let vectors = |v: &[Vec4]| v.iter().map(|e| e.truncate().to_array()).collect::<Vec<_>>();
        self.compare(name, Data::floats(&vectors(cpu), 3), Data::floats(&vectors(&found), 3));
        self.floats("choices", buffer, cpu, 4);
        self.same = before;
    }

    /// An image that the GPU holds row by row.
    pub fn image(&mut self, name: &str, buffer: &Buffer, cpu: &mut Image) {
        self.vectors(name, buffer, 0, &mut cpu.pixels);
    }

    /// What a view sees. Texels in which both sides see other triangles are silhouettes.
    pub fn surface(&mut self, target: &GBufferTarget, cpu: &mut GBuffer) {
        if self.mode == Mode::Upload {
            return target.write(self.queue, cpu);
        }
        let gpu = match target.read(self.device, self.queue) {
            Ok(gpu) => gpu,
            Err(e) => {
                self.failed.get_or_insert(e);
                return;
            }
        };
        if self.mode == Mode::Download {
            *cpu = gpu;
            return;
        }
        let same = cpu.triangle.iter().zip(&gpu.triangle).map(|(c, g)| c == g).collect();
        let before = self.same.replace(same);
        self.compare("depth", Data::floats(&cpu.depth, 1), Data::floats(&gpu.depth, 1));
        self.compare("position", Data::floats(&cpu.position, 3), Data::floats(&gpu.position, 3));
        self.compare("normal", Data::floats(&cpu.normal, 3), Data::floats(&gpu.normal, 3));
        self.compare("albedo", Data::floats(&cpu.albedo, 3), Data::floats(&gpu.albedo, 3));
        self.same = before;
    }

    /// A list whose length the GPU counts itself: word `index` of `count`. Compares the lengths; makes the CPU's list as long as
    /// the GPU's where the GPU's is taken over, so that the list's own buffer can follow.
    pub fn length<T: Clone + Default>(&mut self, count: &Buffer, index: usize, cpu: &mut Vec<T>) {
        let at = 4 * index as u64;
        let own = cpu.len() as u32;
        match self.mode {
            Mode::Upload => self.queue.write_buffer(count, at, bytemuck::bytes_of(&own)),
            Mode::Download => {
                if let [found] = self.read::<u32>(count, index, 1)[..] {
                    cpu.resize(found as usize, T::default());
                }
            }
            Mode::Compare => {
                let found = self.read::<u32>(count, index, 1);
                self.compare("count", Data::words(&[own], 1), Data::words(&found, 1));
            }
        }
    }
}
