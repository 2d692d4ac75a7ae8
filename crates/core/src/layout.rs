//! How structs lie in memory on the GPU: [`wgsl_struct!`](crate::wgsl_struct) declares one once, and its list of fields serves the
//! comparison with the shader's reflection and the comparison of twins, field by field.

use glam::{UVec2, UVec3, Vec2, Vec3, Vec4};

/// What the numbers of a field are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 32-bit floats, which agree up to rounding.
    F32,
    /// 32-bit whole numbers, which agree exactly.
    U32,
    /// A struct, or an array of structs: compared as a whole nowhere.
    Other,
}

/// A field of a struct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Its name, the same in Rust and WGSL; those that begin with `pad` carry nothing.
    pub name: &'static str,
    /// Byte at which it begins.
    pub offset: usize,
    /// Bytes.
    pub size: usize,
    /// What its numbers are.
    pub number: Number,
}

impl Field {
    /// Whether it only fills a row.
    #[must_use]
    pub fn is_padding(&self) -> bool {
        self.name.starts_with("pad")
    }
}

/// A `#[repr(C)]` struct that a shader declares too.
pub trait Layout {
    /// Name of the struct in WGSL.
    const WGSL: &'static str;
    /// Its fields in order.
    const FIELDS: &'static [Field];
}

/// A type that a field of a [`Layout`] can have.
pub trait FieldType {
    /// What its numbers are.
    const NUMBER: Number;
}

macro_rules! field_types {
    ($($ty:ty => $number:ident),* $(,)?) => {$(
        impl FieldType for $ty {
            const NUMBER: Number = Number::$number;
        }
    )*};
}
field_types!(f32 => F32, Vec2 => F32, Vec3 => F32, Vec4 => F32, u32 => U32, UVec2 => U32, UVec3 => U32);

impl<T: FieldType, const N: usize> FieldType for [T; N] {
    const NUMBER: Number = T::NUMBER;
}

/// Declares a `#[repr(C)]` struct whose fields are listed as a [`Layout`]: `"Name"` is that of the WGSL struct. The caller derives
/// what it needs besides (`Debug`, `Clone`, `Copy`, `Pod`, `Zeroable`, …).
///
/// ```
/// indirect_core::wgsl_struct! {
///     /// A sample.
///     #[derive(Debug, Clone, Copy, PartialEq)]
///     pub struct Sample = "Sample" {
///         /// World position, metres.
///         pub position: glam::Vec3,
///         /// Area, m².
///         pub area: f32,
///     }
/// }
/// use indirect_core::layout::{Layout, Number};
/// assert_eq!((Sample::FIELDS[1].offset, Sample::FIELDS[1].number), (12, Number::F32));
/// ```
#[macro_export]
macro_rules! wgsl_struct {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident = $wgsl:literal {
            $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $ty:ty,)+
        }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        $vis struct $name { $($(#[$field_meta])* $field_vis $field: $ty,)+ }

        impl $crate::layout::Layout for $name {
            const WGSL: &'static str = $wgsl;
            const FIELDS: &'static [$crate::layout::Field] = &[$($crate::layout::Field {
                name: stringify!($field),
                offset: ::core::mem::offset_of!($name, $field),
                size: ::core::mem::size_of::<$ty>(),
                number: <$ty as $crate::layout::FieldType>::NUMBER,
            },)+];
        }

        impl $crate::layout::FieldType for $name {
            const NUMBER: $crate::layout::Number = $crate::layout::Number::Other;
        }
    };
}
