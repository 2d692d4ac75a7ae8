//! The container: GLB chunks, JSON, buffers, and bounds-checked access to all of them.
//!
//! Only the JSON types of the `gltf` crate are used. Its wrappers index with `unwrap` after a validation pass that itself
//! indexes; here every index is looked up and every range checked where it is used, so that a damaged file ends in an
//! error that names the element.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Display;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::{Accessor, Index, Root};

use crate::SceneLoadError;

/// Extensions this crate implements; any other that a file requires is an error.
const SUPPORTED: [&str; 4] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// An opened glTF file.
pub(super) struct File<'a> {
    pub(super) path: &'a Path,
    pub(super) root: Root,
    /// One per buffer of the file: where its bytes are in `data`; `None` where it has none.
    buffers: Vec<Option<usize>>,
    data: Vec<Cow<'a, [u8]>>,
    /// Bytes of `data` together.
    bytes: usize,
    /// Per accessor, whether its check has passed; see [`File::once`].
    checked: Vec<AtomicBool>,
}

/// Text from a file, fit for a message of one line: control characters are escaped, and the end of a long one is left out.
fn quote(text: &str, limit: usize) -> String {
    let mut quoted: String = text.chars().take(limit).flat_map(char::escape_debug).collect();
    if text.chars().nth(limit).is_some() {
        quoted.push('…');
    }
    quoted
}

/// The name of something that many nodes may share: the start of a long one, so that they do not multiply it.
pub(super) fn short_name(name: &str) -> String {
    name.chars().take(100).collect()
}

/// Kind, number and name of an element, for messages: `mesh 3 `Chair``.
pub(super) fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{kind} {index} `{}`", quote(name, 60)),
        None => format!("{kind} {index}"),
    }
}

impl<'a> File<'a> {
    /// Parses the bytes of the file at `path` and reads the buffers it refers to.
    pub(super) fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self, SceneLoadError> {
        let malformed =
            |problem: String| SceneLoadError::Malformed { path: path.display().to_string(), problem };
        let (json, bin) = if bytes.starts_with(b"glTF") {
            split_glb(bytes).map_err(malformed)?
        } else {
            (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None)
        };
        let root: Root = gltf::json::deserialize::from_slice(json)
            .map_err(|e| malformed(format!("its glTF JSON is damaged: {e}")))?;
        let checked = root.accessors.iter().map(|_| AtomicBool::new(false)).collect();
        let mut file = Self { path, root, buffers: Vec::new(), data: Vec::new(), bytes: 0, checked };
        if let Some(name) = file.root.extensions_required.iter().find(|e| !SUPPORTED.contains(&e.as_str())) {
            return Err(file.unsupported(name));
        }
        let mut external = HashMap::new();
        for i in 0..file.root.buffers.len() {
            let buffer = file.read_buffer(i, bin, &mut external)?;
            file.buffers.push(buffer);
        }
        Ok(file)
    }

    /// An error about one element of this file.
    pub(super) fn fault(&self, element: impl Display, problem: impl Display) -> SceneLoadError {
        SceneLoadError::Element {
            path: self.path.display().to_string(),
            element: element.to_string(),
            problem: problem.to_string(),
        }
    }

    /// An error about an extension.
    pub(super) fn unsupported(&self, extension: &str) -> SceneLoadError {
        let remedy = if extension.contains("draco") || extension.contains("meshopt") {
            "decompress the file first, for example with `gltf-transform copy`"
        } else if extension.contains("texture") {
            "re-encode its textures as PNG or JPEG"
        } else {
            "export the file again without it"
        };
        SceneLoadError::Extension {
            path: self.path.display().to_string(),
            extension: extension.to_owned(),
            remedy,
        }
    }

    /// The element `index` of one of the root's arrays.
    pub(super) fn get<'s, T>(
        &'s self,
        array: &'s [T],
        index: Index<T>,
        kind: &str,
        user: &dyn Display,
    ) -> Result<&'s T, SceneLoadError> {
        array.get(index.value()).ok_or_else(|| {
            self.fault(user, format!("names {kind} {}, but the file has {}", index.value(), array.len()))
        })
    }

    /// Runs a check of an accessor that takes time in proportion to its length, unless it has passed before.
    pub(super) fn once<E>(
        &self,
        accessor: Index<Accessor>,
        check: impl FnOnce() -> Result<(), E>,
    ) -> Result<(), E> {
        let flag = self.checked.get(accessor.value());
        if !flag.is_some_and(|f| f.load(Ordering::Relaxed)) {
            check()?;
            flag.inspect(|f| f.store(true, Ordering::Relaxed));
        }
        Ok(())
    }

    /// Number of bytes that all buffers hold together.
    pub(super) fn buffer_bytes(&self) -> usize {
        self.bytes
    }

    /// Where the bytes of a buffer view lie: buffer, offset and length. `None` where it does not exist.
    pub(super) fn extent(&self, index: Index<gltf::json::buffer::View>) -> Option<(usize, u64, u64)> {
        let view = self.root.buffer_views.get(index.value())?;
        Some((view.buffer.value(), view.byte_offset.map_or(0, |o| o.0), view.byte_length.0))
    }

    /// The bytes of a buffer view and its stride.
    pub(super) fn view(
        &self,
        index: Index<gltf::json::buffer::View>,
        user: &dyn Display,
    ) -> Result<(&[u8], Option<usize>), SceneLoadError> {
        let view = self.get(&self.root.buffer_views, index, "buffer view", user)?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or_else(|| {
            self.fault(
                user,
                format!("its buffer view names buffer {}, which does not exist", view.buffer.value()),
            )
        })?;
        let Some(buffer) = buffer.map(|place| &self.data[place]) else {
            if let Some(name) = self.root.extensions_used.iter().find(|e| e.contains("meshopt")) {
                return Err(self.unsupported(name));
            }
            return Err(self.fault(user, format!("buffer {} has no data", view.buffer.value())));
        };
        let offset = view.byte_offset.map_or(0, |o| o.0);
        let end = offset.checked_add(view.byte_length.0).filter(|&end| end <= buffer.len() as u64);
        let Some(end) = end else {
            let problem = format!(
                "buffer view {} covers bytes {offset}+{} of a buffer of {} bytes",
                index.value(),
                view.byte_length.0,
                buffer.len()
            );
            return Err(self.fault(user, problem));
        };
        Ok((&buffer[offset as usize..end as usize], view.byte_stride.map(|s| s.0)))
    }

    /// Reads a buffer; the answer is its place in `data`. Buffers that name one `external` file share its bytes, so that a small
    /// file cannot have a large one read a thousand times.
    fn read_buffer(
        &mut self,
        index: usize,
        bin: Option<&'a [u8]>,
        external: &mut HashMap<PathBuf, usize>,
    ) -> Result<Option<usize>, SceneLoadError> {
        let json = &self.root.buffers[index];
        let element = label("buffer", index, json.name.as_deref());
        let length = json.byte_length.0;
        let file = json.uri.as_deref().and_then(|uri| self.external(uri));
        let known = file.as_ref().and_then(|file| external.get(file)).copied();
        let place = known.unwrap_or(self.data.len());
        if known.is_none() {
            let data = match (&json.uri, bin) {
                (Some(uri), _) => Cow::Owned(self.read_uri(uri, length, &element)?),
                (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
                (None, _) => return Ok(None),
            };
            self.bytes += data.len();
            self.data.push(data);
            external.extend(file.map(|file| (file, place)));
        }
        let found = self.data[place].len();
        if (found as u64) < length {
            let why = if known.is_some() {
                "an earlier buffer of the same file states less"
            } else {
                "the file is truncated"
            };
            let problem = format!("{length} bytes are declared, but only {found} are there: {why}");
            return Err(self.fault(element, problem));
        }
        Ok(Some(place))
    }

    /// The file that a URI names, in one spelling; `None` where there is none, which reading it explains.
    fn external(&self, uri: &str) -> Option<PathBuf> {
        if uri.starts_with("data:") {
            return None;
        }
        let name = percent_encoding::percent_decode_str(uri).decode_utf8().ok()?;
        self.path.parent().unwrap_or(Path::new("")).join(name.as_ref()).canonicalize().ok()
    }

    /// The bytes that a URI stands for, at most `limit` of them.
    pub(super) fn read_uri(&self, uri: &str, limit: u64, element: &str) -> Result<Vec<u8>, SceneLoadError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, text)) = data.split_once(";base64,") else {
                return Err(self.fault(element, "its data URI is not base64"));
            };
            let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
            let engine = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
            return engine
                .decode(text)
                .map_err(|e| self.fault(element, format!("its data URI is damaged: {e}")));
        }
        let shown = quote(uri, 80);
        let name = percent_encoding::percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| self.fault(element, format!("its URI `{shown}` is not UTF-8")))?;
        if uri.contains("://") || Path::new(name.as_ref()).is_absolute() {
            return Err(self.fault(element, format!("its URI `{shown}` is not relative to the file")));
        }
        let path = self.path.parent().unwrap_or(Path::new("")).join(name.as_ref());
        let io = |e: std::io::Error| self.fault(element, format!("its file `{shown}` cannot be read: {e}"));
        let file = std::fs::File::open(&path).map_err(io)?;
        if !file.metadata().map_err(io)?.is_file() {
            return Err(self.fault(element, format!("its file `{shown}` is not a regular file")));
        }
        let mut bytes = Vec::new();
        file.take(limit).read_to_end(&mut bytes).map_err(io)?;
        Ok(bytes)
    }
}

/// The JSON and BIN chunks of a GLB container (glTF 2.0, section 4.4).
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        word.ok_or_else(|| {
            format!("truncated: a GLB header needs {} bytes, the file has {}", at + 4, bytes.len())
        })
    };
    let version = word(4)?;
    if version != 2 {
        return Err(format!("GLB version {version} is not supported, only 2"));
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        return Err(format!("truncated: its header states {length} bytes, the file has {}", bytes.len()));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while at + 8 <= length {
        let (size, kind) = (word(at)? as usize, &bytes[at + 4..at + 8]);
        let chunk = bytes[..length].get(at + 8..(at + 8).saturating_add(size)).ok_or_else(|| {
            format!("truncated: a chunk of {size} bytes at {at} does not fit into {length} bytes")
        })?;
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            // The specification asks readers to skip chunks they do not know.
            _ => {}
        }
        at += 8 + size;
    }
    Ok((json.ok_or("its GLB container has no JSON chunk")?, bin))
}
