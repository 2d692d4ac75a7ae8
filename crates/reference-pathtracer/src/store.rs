//! Estimates as bytes, files and a cache. The format is little-endian: magic, header, batches, the moments of each pixel as
//! f64, and a hash of all that.

use core::hash::Hasher;
use std::{fs, path::Path};

use glam::DVec3;
use indirect_accel::Accel;
use indirect_core::View;
use siphasher::sip::SipHasher13;

use crate::{
    Error, Estimate, Settings,
    estimate::{Batch, Moments, Pixel},
    key, render_with,
};

const MAGIC: &[u8; 8] = b"INDIREF1";

/// Bytes of one stored pixel: two components of seven sums, and a flag.
const PIXEL: usize = 2 * 7 * 8 + 1;

const HEADER: usize = 8 + 16 + 2 * 4 + 4 + 8 + 4;

const BATCH: usize = 4 + 2 * 8;

fn checksum(bytes: &[u8]) -> u64 {
    let mut h = SipHasher13::new();
    h.write(bytes);
    h.finish()
}

impl Estimate {
    /// The estimate as bytes, complete: [`Estimate::from_bytes`] restores it bit for bit, ready to be merged.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER + self.batches.len() * BATCH + self.pixels.len() * PIXEL + 8);
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&self.key.to_le_bytes());
        for v in [self.direct.size[0], self.direct.size[1], self.batch] {
            out.extend_from_slice(&v.to_le_bytes());
        }
        out.extend_from_slice(&self.rays.to_le_bytes());
        out.extend_from_slice(&(self.batches.len() as u32).to_le_bytes());
        for b in &self.batches {
            out.extend_from_slice(&b.index.to_le_bytes());
            out.extend_from_slice(&b.direct.to_le_bytes());
            out.extend_from_slice(&b.indirect.to_le_bytes());
        }
        for p in &self.pixels {
            for m in [&p.direct, &p.indirect] {
                for v in [m.sum, m.squares].iter().flat_map(|v| v.to_array()).chain([m.luminance_squares]) {
                    out.extend_from_slice(&v.to_le_bytes());
                }
            }
            out.push(u8::from(p.surface));
        }
        let sum = checksum(&out);
        out.extend_from_slice(&sum.to_le_bytes());
        out
    }

    /// Restores what [`Estimate::to_bytes`] made.
    ///
    /// # Errors
    /// [`Error::Format`] for anything else: other bytes, a cut or changed file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let fail = |message| Err(Error::Format { message });
        let Some((content, sum)) = bytes.split_last_chunk::<8>() else { return fail("too short") };
        if !content.starts_with(MAGIC) {
            return fail("it starts differently");
        }
        if checksum(content) != u64::from_le_bytes(*sum) {
            return fail("its checksum does not match");
        }
        // The checksum holds, so what follows is as it was written; a length may still come from a forger.
        Reader(&content[MAGIC.len()..]).estimate().map_or_else(|| fail("its parts do not add up"), Ok)
    }

    /// Writes the estimate to a file. A reader never sees a part of it: it is written beside and renamed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        let io = |source| Error::Io { path: path.to_owned(), source };
        let mut beside = path.as_os_str().to_owned();
        beside.push(format!(".{}.part", std::process::id()));
        fs::write(&beside, self.to_bytes()).and_then(|()| fs::rename(&beside, path)).map_err(|source| {
            // Best effort: the error that matters is the first.
            let _ = fs::remove_file(&beside);
            io(source)
        })
    }

    /// Reads what [`Estimate::save`] wrote.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be read, [`Error::Format`] where it is not a whole estimate.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
        Self::from_bytes(&bytes)
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn moments(&mut self) -> Option<Moments> {
        let mut v = [0.0; 7];
        for v in &mut v {
            *v = self.f64()?;
        }
        let [a, b, c, d, e, f, luminance_squares] = v;
        Some(Moments { sum: DVec3::new(a, b, c), squares: DVec3::new(d, e, f), luminance_squares })
    }

    fn estimate(mut self) -> Option<Estimate> {
        let key = self.take().map(u128::from_le_bytes)?;
        let size = [self.u32()?, self.u32()?];
        let batch = self.u32()?;
        let rays = self.take().map(u64::from_le_bytes)?;
        let count = self.u32()? as usize;
        let mut batches: Vec<Batch> = Vec::new();
        for _ in 0..count {
            let b = Batch { index: self.u32()?, direct: self.f64()?, indirect: self.f64()? };
            if b.index == u32::MAX || batches.last().is_some_and(|last| b.index <= last.index) {
                return None;
            }
            batches.push(b);
        }
        let pixels = (size[0] as usize).checked_mul(size[1] as usize)?;
        if batch == 0 || batches.is_empty() || pixels.checked_mul(PIXEL)? != self.0.len() {
            return None;
        }
        let pixel = |_| {
            let (direct, indirect) = (self.moments()?, self.moments()?);
            Some(Pixel { direct, indirect, surface: self.take::<1>()? != [0] })
        };
        let pixels = (0..pixels).map(pixel).collect::<Option<Vec<_>>>()?;
        Some(Estimate::new(size, pixels, batch, batches, rays, key))
    }
}

/// Like [`render_with`], but takes the result from `directory` where it was made before, and leaves it there otherwise.
///
/// The file is named by a hash of the scene's content, the view, the size and all settings. A damaged file is made anew.
///
/// # Errors
/// Those of [`render_with`], and [`Error::Io`] where the directory cannot be made or the file not be written.
pub fn render_cached(
    directory: &Path,
    accel: &Accel<'_>,
    view: &View,
    size: [u32; 2],
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, Error> {
    let key = key::key(accel.scene(), view, size, settings);
    let samples = settings.samples;
    let target = settings.noise_target.map_or(String::new(), |t| format!("-{:016x}", t.to_bits()));
    let name = format!("{key:032x}-{}-{}{target}.ref", samples.first, samples.batches);
    let path = directory.join(name);
    // Whatever is wrong with the file, a new one puts it right or says why not.
    if let Ok(found) = Estimate::load(&path)
        && found.key == key
        && found.direct.size == size
    {
        progress(1.0);
        return Ok(found);
    }
    let made = render_with(accel, view, size, settings, progress)?;
    fs::create_dir_all(directory).map_err(|source| Error::Io { path: directory.to_owned(), source })?;
    made.save(&path)?;
    Ok(made)
}
