//! What a technique will allocate, said before anything is made.

use bytemuck::Pod;
use wgpu::{Buffer, BufferUsages, Device, Limits};

use crate::GpuError;

/// What will be allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Buffer(BufferUsages),
    /// A render target of this longer side.
    Texture {
        side: u32,
    },
    /// Nothing: a number of elements that a shader counts in 32 bits.
    Index,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Item {
    name: &'static str,
    /// Bytes, or elements of an index.
    size: u64,
    kind: Kind,
}

/// A list of buffers and textures to be made: their memory, and the limits that a device must have.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Plan {
    items: Vec<Item>,
}

impl Plan {
    /// Nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A storage buffer of `count` elements, at least one: WebGPU has no empty bindings. It can be read back and copied into.
    pub fn storage<T: Pod>(&mut self, name: &'static str, count: u64, more: BufferUsages) {
        let size = count.max(1).saturating_mul(size_of::<T>() as u64).checked_next_multiple_of(4);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST | more;
        self.items.push(Item { name, size: size.unwrap_or(u64::MAX), kind: Kind::Buffer(usage) });
    }

    /// A uniform buffer that holds a `T`.
    pub fn uniform<T: Pod>(&mut self, name: &'static str) {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        self.items.push(Item { name, size: size_of::<T>() as u64, kind: Kind::Buffer(usage) });
    }

    /// [`Uniforms`](crate::Uniforms) of `count` values.
    pub fn uniforms<T: Pod>(&mut self, name: &'static str, count: usize) {
        let kind = Kind::Buffer(BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        self.items.push(Item { name, size: crate::Uniforms::<T>::bytes_of(count), kind });
    }

    /// A render target.
    pub fn texture(&mut self, name: &'static str, size: [u32; 2], bytes_per_texel: u32) {
        let bytes = u64::from(size[0]) * u64::from(size[1]) * u64::from(bytes_per_texel);
        let kind = Kind::Texture { side: size[0].max(size[1]) };
        self.items.push(Item { name, size: bytes, kind });
    }

    /// A number of elements that shaders count in 32 bits.
    pub fn index(&mut self, name: &'static str, count: u64) {
        self.items.push(Item { name, size: count, kind: Kind::Index });
    }

    /// This plan and `other`.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.items.extend(other.items);
        self
    }

    /// Name and bytes of every buffer and texture, in order.
    pub fn items(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.items.iter().filter(|i| i.kind != Kind::Index).map(|i| (i.name, i.size))
    }

    /// Bytes of all of them.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.items().map(|(_, bytes)| bytes).fold(0, u64::saturating_add)
    }

    /// The limits that a device must have: WebGPU's defaults, raised where something is larger.
    #[must_use]
    pub fn required_limits(&self) -> Limits {
        let mut limits = Limits::default();
        for item in &self.items {
            match item.kind {
                Kind::Buffer(usage) => {
                    limits.max_buffer_size = limits.max_buffer_size.max(item.size);
                    if usage.contains(BufferUsages::STORAGE) {
                        let limit = &mut limits.max_storage_buffer_binding_size;
                        *limit = (*limit).max(item.size);
                    }
                }
                Kind::Texture { side } => {
                    limits.max_texture_dimension_2d = limits.max_texture_dimension_2d.max(side);
                }
                Kind::Index => {}
            }
        }
        limits
    }

    /// Whether a device with these limits can hold all of it.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for the first thing that is too large.
    pub fn check(&self, limits: &Limits) -> Result<(), GpuError> {
        for &Item { name: what, size, kind } in &self.items {
            let mut checks = Vec::new();
            match kind {
                Kind::Buffer(usage) => {
                    if usage.contains(BufferUsages::STORAGE) {
                        let available = limits.max_storage_buffer_binding_size;
                        checks.push(("max_storage_buffer_binding_size", size, available));
                    }
                    checks.push(("max_buffer_size", size, limits.max_buffer_size));
                }
                Kind::Texture { side } => {
                    let available = limits.max_texture_dimension_2d.into();
                    checks.push(("max_texture_dimension_2d", side.into(), available));
                }
                Kind::Index => checks.push(("32-bit index", size, u32::MAX.into())),
            }
            for (limit, needed, available) in checks {
                if needed > available {
                    return Err(GpuError::Limit { what, limit, needed, available });
                }
            }
        }
        Ok(())
    }

    /// `old`, where it is as large as the buffer of that name, here and in `probe`; else a new one, zeroed.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub fn recreate(
        &self,
        device: &Device,
        name: &'static str,
        old: &Buffer,
        probe: &Self,
    ) -> Result<Buffer, GpuError> {
        let size = |plan: &Self| plan.items().find(|i| i.0 == name).map(|i| i.1);
        let wanted = size(self);
        if wanted == Some(old.size()) && wanted == size(probe) {
            return Ok(old.clone());
        }
        self.create(device, name)
    }

    /// Makes the buffer of that name, zeroed.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where the device cannot hold it.
    pub fn create(&self, device: &Device, name: &'static str) -> Result<Buffer, GpuError> {
        for item in self.items.iter().filter(|i| i.name == name) {
            if let Kind::Buffer(usage) = item.kind {
                Self { items: vec![item.clone()] }.check(&device.limits())?;
                let (label, size, mapped_at_creation) = (Some(name), item.size, false);
                return Ok(device.create_buffer(&wgpu::BufferDescriptor {
                    label,
                    size,
                    usage,
                    mapped_at_creation,
                }));
            }
        }
        Err(GpuError::Unbound { kernel: "the plan".to_owned(), name })
    }
}

/// Buffers, each declared once: the name that WGSL gives it, what it holds and how much. The struct can say what it will need
/// ([`Plan`]), be made, and list its buffers for binding by name.
///
/// `[T]` is a storage buffer, `T` alone a uniform one; `+ USAGE` adds a [`BufferUsages`](wgpu::BufferUsages).
///
/// ```
/// use indirect_gpu::Vec3Pad;
///
/// /// What the lengths follow from.
/// struct Sizes {
///     pixels: u64,
/// }
///
/// indirect_gpu::buffers! {
///     /// Buffers of a frame.
///     pub struct Buffers for Sizes {
///         /// Irradiance per pixel, W/m², and 0.
///         irradiance: [Vec3Pad] = |s| s.pixels;
///         /// Arguments of indirect calls.
///         arguments: [u32] + INDIRECT = |_| 4;
///         /// A factor.
///         factor: f32;
///     }
/// }
///
/// let plan = Buffers::plan(&Sizes { pixels: 3840 * 2160 });
/// assert_eq!(plan.bytes(), 3840 * 2160 * 16 + 16 + 4);
/// // WebGPU's default of 128 MiB is enough.
/// assert_eq!(plan.required_limits().max_storage_buffer_binding_size, 1 << 27);
/// ```
#[macro_export]
macro_rules! buffers {
    (
        $(#[$doc:meta])*
        $vis:vis struct $name:ident for $sizes:ty {
            $($(#[$field_doc:meta])* $field:ident: $kind:tt $(+ $usage:ident)? $(= $count:expr)?;)+
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone)]
        $vis struct $name { $($(#[$field_doc])* $vis $field: $crate::wgpu::Buffer,)+ }

        impl $name {
            /// What will be allocated.
            #[must_use]
            $vis fn plan(sizes: &$sizes) -> $crate::Plan {
                let mut plan = $crate::Plan::new();
                $($crate::buffer_item!(plan, sizes, $sizes, stringify!($field), $kind $(+ $usage)? $(= $count)?);)+
                let _ = sizes;
                plan
            }

            /// All buffers, zeroed.
            ///
            /// # Errors
            /// [`GpuError::Limit`]($crate::GpuError::Limit) where the device cannot hold them.
            $vis fn new(device: &$crate::wgpu::Device, sizes: &$sizes) -> Result<Self, $crate::GpuError> {
                let plan = Self::plan(sizes);
                Ok(Self { $($field: plan.create(device, stringify!($field))?,)+ })
            }

            /// Buffers for `sizes` that keep those of this set, with what they hold, whose length `probe`, the same for an image of
            /// another size, does not change; the others are new and zeroed.
            ///
            /// # Errors
            /// As [`Self::new`].
            #[allow(dead_code, reason = "a set of buffers may never be resized")]
            $vis fn resized(
                &self,
                device: &$crate::wgpu::Device,
                sizes: &$sizes,
                probe: &$sizes,
            ) -> Result<Self, $crate::GpuError> {
                let (plan, probe) = (Self::plan(sizes), Self::plan(probe));
                Ok(Self { $($field: plan.recreate(device, stringify!($field), &self.$field, &probe)?,)+ })
            }

            /// All of them by name.
            #[must_use]
            $vis fn named(&self) -> Vec<$crate::Named<'_>> {
                vec![$($crate::named(stringify!($field), &self.$field),)+]
            }
        }
    };
}

/// One buffer of [`buffers!`].
#[doc(hidden)]
#[macro_export]
macro_rules! buffer_item {
    ($plan:ident, $s:ident, $sizes:ty, $name:expr, [$element:ty] $(+ $usage:ident)? = $count:expr) => {
        let count: fn(&$sizes) -> u64 = $count;
        let usage = $crate::wgpu::BufferUsages::empty() $(| $crate::wgpu::BufferUsages::$usage)?;
        $plan.storage::<$element>($name, count($s), usage);
    };
    ($plan:ident, $s:ident, $sizes:ty, $name:expr, $uniform:ident) => {
        $plan.uniform::<$uniform>($name);
    };
}
