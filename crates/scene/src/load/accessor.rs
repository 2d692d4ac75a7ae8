//! Bounds-checked accessors: typed, possibly quantized, possibly sparse arrays inside buffers.

use std::fmt::Display;

use gltf::json::accessor::{Accessor as Json, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, accessor::sparse};

use super::file::File;
use crate::SceneLoadError;

/// Fixed-size elements of one component type at a fixed stride, all of which lie inside `bytes`.
#[derive(Clone, Copy)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
}

/// Values that replace some elements.
#[derive(Clone, Copy)]
struct Sparse<'a> {
    count: usize,
    indices: Strided<'a>,
    values: Strided<'a>,
}

/// An accessor whose every element can be read without a further check. Nothing is decoded before it is asked for: an
/// accessor costs no memory, however large its count.
pub(super) struct Accessor<'a> {
    pub(super) count: usize,
    components: usize,
    normalized: bool,
    component: ComponentType,
    base: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

impl<'a> Strided<'a> {
    /// `count` elements of `size` bytes from `offset` on, `stride` bytes apart.
    fn new(
        (view, stride): (&'a [u8], Option<usize>),
        offset: u64,
        count: u64,
        components: usize,
        component: ComponentType,
    ) -> Result<Self, String> {
        let size = component.size() * components;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!("elements of {size} bytes overlap at a stride of {stride}"));
        }
        let end = match count.checked_sub(1) {
            None => Some(0),
            Some(last) => last
                .checked_mul(stride as u64)
                .and_then(|n| n.checked_add(size as u64))
                .and_then(|n| n.checked_add(offset)),
        };
        match end {
            Some(end) if end <= view.len() as u64 => {
                let bytes = if count == 0 { &[] } else { &view[offset as usize..] };
                Ok(Self { bytes, stride, component })
            }
            _ => Err(format!(
                "{count} elements of {size} bytes at a stride of {stride} do not fit into a buffer view of {} bytes",
                view.len()
            )),
        }
    }

    /// Component `c` of element `i` as its bits' plain value.
    fn number(&self, i: usize, c: usize) -> f64 {
        let b = &self.bytes[i * self.stride + c * self.component.size()..];
        match self.component {
            ComponentType::I8 => f64::from(b[0].cast_signed()),
            ComponentType::U8 => f64::from(b[0]),
            ComponentType::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            ComponentType::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            ComponentType::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            ComponentType::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        }
    }

    fn index(&self, i: usize) -> u32 {
        // Index component types are unsigned integers: exact in f64.
        self.number(i, 0) as u32
    }
}

impl<'a> Accessor<'a> {
    /// Opens accessor `index`, which must have one of `types`; `user` names who asks.
    pub(super) fn open(
        file: &'a File<'_>,
        index: Index<Json>,
        types: &[Type],
        user: &dyn Display,
    ) -> Result<Self, SceneLoadError> {
        let json = file.get(&file.root.accessors, index, "accessor", user)?;
        let element = format!("{user} (accessor {})", index.value());
        let (Checked::Valid(type_), Checked::Valid(component)) = (json.type_, json.component_type) else {
            return Err(file.fault(element, "unknown type or component type"));
        };
        if !types.contains(&type_) {
            return Err(file.fault(element, format!("has type {type_:?}, expected one of {types:?}")));
        }
        let components = type_.multiplicity();
        let count = json.count.0;
        let base = match json.buffer_view {
            Some(view) => {
                let view = file.view(view, &element)?;
                let offset = json.byte_offset.map_or(0, |o| o.0);
                Some(
                    Strided::new(view, offset, count, components, component.0)
                        .map_err(|problem| file.fault(&element, problem))?,
                )
            }
            // Without a view all elements are zero. Their number must still be one that the file could have meant.
            None if count <= file.buffer_bytes() as u64 => None,
            None => {
                return Err(
                    file.fault(element, format!("{count} elements without a buffer view that holds them"))
                );
            }
        };
        let sparse = match &json.sparse {
            Some(sparse) => {
                let sparse = Sparse::open(file, sparse, count, components, component.0, &element)?;
                // Once per accessor: many primitives may share a long one.
                file.once(index, || sparse.check(count)).map_err(|problem| file.fault(&element, problem))?;
                Some(sparse)
            }
            None => None,
        };
        Ok(Self {
            count: count as usize,
            components,
            normalized: json.normalized,
            component: component.0,
            base,
            sparse,
        })
    }

    /// Whether elements are unsigned integers, as indices must be.
    pub(super) fn is_index(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// The first `N` components of element `i < count`. Integers are scaled to `[0, 1]` or `[-1, 1]` where the accessor is
    /// normalized (glTF 2.0, section 3.11), and kept as they are otherwise.
    pub(super) fn get<const N: usize>(&self, i: usize) -> [f32; N] {
        let (source, at) = self.locate(i);
        core::array::from_fn(|c| match source {
            Some(source) if c < self.components => self.decode(source.number(at, c)),
            _ => 0.0,
        })
    }

    /// Element `i < count` as an index.
    pub(super) fn index(&self, i: usize) -> u32 {
        let (source, at) = self.locate(i);
        source.map_or(0, |source| source.index(at))
    }

    fn locate(&self, i: usize) -> (Option<&Strided<'a>>, usize) {
        if let Some(sparse) = &self.sparse {
            let found = binary_search(sparse.count, |k| sparse.indices.index(k).cmp(&(i as u32)));
            if let Some(k) = found {
                return (Some(&sparse.values), k);
            }
        }
        (self.base.as_ref(), i)
    }

    fn decode(&self, value: f64) -> f32 {
        let value = if self.normalized {
            match self.component {
                ComponentType::I8 => (value / 127.0).max(-1.0),
                ComponentType::U8 => value / 255.0,
                ComponentType::I16 => (value / 32767.0).max(-1.0),
                ComponentType::U16 => value / 65535.0,
                ComponentType::U32 => value / f64::from(u32::MAX),
                ComponentType::F32 => value,
            }
        } else {
            value
        };
        value as f32
    }
}

impl<'a> Sparse<'a> {
    fn open(
        file: &'a File<'_>,
        json: &sparse::Sparse,
        count: u64,
        components: usize,
        component: ComponentType,
        element: &str,
    ) -> Result<Self, SceneLoadError> {
        let fault = |problem: String| file.fault(element, format!("sparse: {problem}"));
        let Checked::Valid(index_component) = json.indices.component_type else {
            return Err(fault("unknown component type of its indices".into()));
        };
        let n = json.count.0;
        if n > count {
            return Err(fault(format!("{n} values replace only {count} elements")));
        }
        let view = file.view(json.indices.buffer_view, &element)?;
        let indices =
            Strided::new(view, json.indices.byte_offset.0, n, 1, index_component.0).map_err(fault)?;
        let view = file.view(json.values.buffer_view, &element)?;
        let values =
            Strided::new(view, json.values.byte_offset.0, n, components, component).map_err(fault)?;
        Ok(Self { count: n as usize, indices, values })
    }

    /// Whether the indices increase and stay below `count`.
    fn check(&self, count: u64) -> Result<(), String> {
        let index = |k| self.indices.index(k);
        if (1..self.count).any(|k| index(k) <= index(k - 1)) {
            return Err("sparse: its indices do not increase".into());
        }
        match self.count.checked_sub(1).map(index) {
            Some(last) if u64::from(last) >= count => {
                Err(format!("sparse: index {last} is outside its {count} elements"))
            }
            _ => Ok(()),
        }
    }
}

/// The position in `0..n` at which the increasing sequence behind `order` compares equal.
fn binary_search(n: usize, order: impl Fn(usize) -> core::cmp::Ordering) -> Option<usize> {
    let (mut low, mut high) = (0, n);
    while low < high {
        let mid = low + (high - low) / 2;
        match order(mid) {
            core::cmp::Ordering::Less => low = mid + 1,
            core::cmp::Ordering::Greater => high = mid,
            core::cmp::Ordering::Equal => return Some(mid),
        }
    }
    None
}
