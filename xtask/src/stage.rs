//! A scene, ready to be rendered: what every command starts from.

use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Camera, Scene, SceneProfile, View};
use indirect_scene::{LoadOptions, resolve};

use crate::failure::{Failure, Outcome};
use crate::gpu::Gpu;
use crate::setup;

/// Largest image side that the command line accepts.
const MAX_SIDE: u32 = 16_384;
/// Most pixels that the command line accepts: 2²⁶, 2.3 GB for a reference with its moments.
const MAX_PIXELS: u64 = 1 << 26;

/// A loaded scene and what the loader had to say.
#[derive(Debug)]
pub(crate) struct Source {
    /// The argument: a path or the name of a fixture.
    pub(crate) file: String,
    pub(crate) scene: Scene,
    pub(crate) warnings: Vec<String>,
    pub(crate) load_ms: f64,
}

impl Source {
    /// Loads a file or builds a fixture.
    pub(crate) fn load(argument: &str) -> Outcome<Self> {
        let start = std::time::Instant::now();
        let loaded = resolve(argument, &LoadOptions::default()).map_err(|e| Failure::Input(e.to_string()))?;
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(Self { file: argument.to_owned(), scene: loaded.scene, warnings: loaded.warnings, load_ms })
    }

    /// The camera of that name or number; the first without either.
    pub(crate) fn camera(&self, wanted: Option<&str>) -> Outcome<&Camera> {
        let cameras = &self.scene.cameras;
        let found = match wanted {
            None => cameras.first(),
            Some(w) => {
                let by_name = cameras.iter().find(|c| c.name == w);
                by_name.or_else(|| w.parse().ok().and_then(|i: usize| cameras.get(i)))
            }
        };
        found.ok_or_else(|| {
            let names: Vec<_> = cameras.iter().map(|c| c.name.as_str()).collect();
            let wanted = wanted.unwrap_or("the first");
            Failure::Input(format!(
                "{}: camera {wanted}: there are {}: {}",
                self.file,
                names.len(),
                names.join(", ")
            ))
        })
    }

    /// Width and height for a camera: `width` wide, as high as the camera's aspect ratio asks for; square where it asks for
    /// none.
    pub(crate) fn size(camera: &Camera, width: u32) -> [u32; 2] {
        let aspect = camera.aspect.filter(|a| *a > 0.0).unwrap_or(1.0);
        let height = (width as f32 / aspect).round().clamp(1.0, MAX_SIDE as f32);
        [width, height as u32]
    }

    /// File name without folders and ending, for titles.
    pub(crate) fn title(&self) -> &str {
        std::path::Path::new(&self.file).file_stem().and_then(|s| s.to_str()).unwrap_or(&self.file)
    }
}

/// Reads `WxH`.
pub(crate) fn parse_size(text: &str) -> Outcome<[u32; 2]> {
    let bad = |why: &str| Failure::Input(format!("--size {text}: {why}"));
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(|| bad("must be WIDTHxHEIGHT"))?;
    let side = |s: &str| s.parse::<u32>().map_err(|_| bad("must be two whole numbers"));
    let size = [side(w)?, side(h)?];
    if size.contains(&0) {
        return Err(bad("must be at least 1x1"));
    }
    if size.iter().any(|s| *s > MAX_SIDE) || u64::from(size[0]) * u64::from(size[1]) > MAX_PIXELS {
        return Err(bad("must be at most 16384 a side and 2^26 pixels"));
    }
    Ok(size)
}

/// A scene with its ray structure, a camera's view and, where there is one, a GPU that holds the scene.
#[derive(Debug)]
pub(crate) struct Stage<'a> {
    pub(crate) file: String,
    pub(crate) scene: &'a Scene,
    pub(crate) profile: SceneProfile,
    pub(crate) accel: Accel<'a>,
    /// Time to build `accel`.
    pub(crate) accel_ms: f64,
    pub(crate) view: View,
    pub(crate) size: [u32; 2],
    pub(crate) gpu: Option<Gpu>,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(source: &'a Source, camera: &Camera, size: [u32; 2], gpu: Option<Gpu>) -> Self {
        let start = std::time::Instant::now();
        let accel = Accel::build(&source.scene, BuildPreset::Best);
        Self {
            file: source.file.clone(),
            scene: &source.scene,
            profile: SceneProfile::of(&source.scene),
            accel,
            accel_ms: start.elapsed().as_secs_f64() * 1e3,
            view: camera.view(size),
            size,
            gpu,
        }
    }

    /// The GPU.
    ///
    /// # Errors
    /// Where there is none.
    pub(crate) fn gpu(&self) -> Outcome<&Gpu> {
        self.gpu.as_ref().ok_or_else(|| Failure::Check(setup::NO_ADAPTER.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(parse_size("640x480").unwrap(), [640, 480]);
        for bad in ["0x0", "4x0", "4", "axb", "-1x4", "99999x4", "16384x16384", "4x4x4"] {
            let line = parse_size(bad).unwrap_err().line();
            assert!(line.starts_with(&format!("--size {bad}: must be")), "{line}");
        }
    }
}
