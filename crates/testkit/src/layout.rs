//! Memory layout of `#[repr(C)]` structs, constants and workgroup sizes against naga's reflection of the shader.

use core::fmt::Debug;

use indirect_core::layout::{Field, Layout};
use indirect_gpu::shaders::Module;
use naga::{Expression, Literal, TypeInner};

/// Compares a Rust struct with its WGSL twin: the same fields in the same order at the same offsets with the same sizes, and the
/// same size in all. Rust fields that only pad may be missing in WGSL.
///
/// # Errors
/// What differs first.
pub fn check<T: Layout>(module: &Module) -> Result<(), String> {
    check_fields(module, T::WGSL, size_of::<T>(), T::FIELDS)
}

/// [`check`] of a struct given by its parts.
///
/// # Errors
/// As there.
pub fn check_fields(module: &Module, name: &str, size: usize, fields: &[Field]) -> Result<(), String> {
    let ir = parse(module)?;
    let (_, ty) = ir
        .types
        .iter()
        .find(|(_, ty)| ty.name.as_deref() == Some(name))
        .ok_or_else(|| format!("{} has no struct `{name}`", module.name))?;
    let TypeInner::Struct { members, span } = &ty.inner else {
        return Err(format!("`{name}` is no struct"));
    };
    let names: Vec<_> = members.iter().map(|m| m.name.as_deref().unwrap_or("")).collect();
    let fields: Vec<_> = fields.iter().filter(|f| !f.is_padding() || names.contains(&f.name)).collect();
    let rust: Vec<_> = fields.iter().map(|f| f.name).collect();
    if names != rust {
        return Err(format!("`{name}` has the fields {names:?} in WGSL, {rust:?} in Rust"));
    }
    for (member, Field { name: field, offset, size, .. }) in members.iter().zip(fields) {
        let found = (member.offset as usize, ir.types[member.ty].inner.size(ir.to_ctx()) as usize);
        if found != (*offset, *size) {
            return Err(format!(
                "`{name}.{field}` is at {} with {} bytes in WGSL, at {offset} with {size} in Rust",
                found.0, found.1
            ));
        }
    }
    if *span as usize != size {
        return Err(format!("`{name}` has {span} bytes in WGSL, {size} in Rust"));
    }
    Ok(())
}

/// A number that WGSL knows as a constant.
pub trait Constant: PartialEq + Debug + Copy {
    /// The number in a literal, where it is of this type.
    fn of(literal: &Literal) -> Option<Self>;
}

macro_rules! constant {
    ($($number:ty => $literal:ident),*) => {$(
        impl Constant for $number {
            fn of(literal: &Literal) -> Option<Self> {
                match literal {
                    Literal::$literal(v) => Some(*v),
                    _ => None,
                }
            }
        }
    )*};
}
constant!(u32 => U32, i32 => I32, f32 => F32, bool => Bool);

/// Compares a Rust constant with the WGSL constant `name`.
///
/// # Errors
/// What differs.
pub fn check_constant<T: Constant>(module: &Module, name: &str, value: T) -> Result<(), String> {
    let ir = parse(module)?;
    let (_, constant) = ir
        .constants
        .iter()
        .find(|(_, c)| c.name.as_deref() == Some(name))
        .ok_or_else(|| format!("{} has no constant `{name}`", module.name))?;
    let found = match &ir.global_expressions[constant.init] {
        Expression::Literal(literal) => T::of(literal),
        _ => None,
    };
    match found {
        Some(found) if found == value => Ok(()),
        Some(found) => Err(format!("`{name}` is {found:?} in WGSL, {value:?} in Rust")),
        None => Err(format!("`{name}` is no constant of type {}", core::any::type_name::<T>())),
    }
}

/// Compares a workgroup size with that of the entry point `name`.
///
/// # Errors
/// What differs.
pub fn check_workgroup_size(module: &Module, name: &str, size: [u32; 3]) -> Result<(), String> {
    let ir = parse(module)?;
    let entry = ir
        .entry_points
        .iter()
        .find(|e| e.name == name)
        .ok_or_else(|| format!("{} has no entry point `{name}`", module.name))?;
    if entry.workgroup_size == size {
        Ok(())
    } else {
        Err(format!("`{name}` has workgroups of {:?} in WGSL, {size:?} in Rust", entry.workgroup_size))
    }
}

fn parse(module: &Module) -> Result<naga::Module, String> {
    let source = module.source();
    naga::front::wgsl::parse_str(&source).map_err(|e| {
        let place = e.location(&source).and_then(|l| module.locate(l.line_number as usize));
        format!("{} at {place:?}: {e}", module.name)
    })
}
