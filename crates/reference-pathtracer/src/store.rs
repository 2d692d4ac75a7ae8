//! Estimates as bytes, files and a cache. The format is little-endian: magic, header, batches, the moments of each pixel as
//! f64, and a hash of all that.

use core::hash::Hasher;
use std::{
    fs,
    io::{self, BufWriter, Write},
    path::Path,
};

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

/// Hashes what it passes on.
struct Hashed<W> {
    out: W,
    hasher: SipHasher13,
}

impl<W: Write> Hashed<W> {
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.write(bytes);
        self.out.write_all(bytes)
    }
}

impl Estimate {
    /// The estimate as bytes, complete: [`Estimate::from_bytes`] restores it bit for bit, ready to be merged.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER + self.batches.len() * BATCH + self.pixels.len() * PIXEL + 8);
        // A vector takes everything.
        let _ = self.write(&mut out);
        out
    }

    fn write(&self, out: impl Write) -> io::Result<()> {
        let mut out = Hashed { out, hasher: SipHasher13::new() };
        out.put(MAGIC)?;
        out.put(&self.key.to_le_bytes())?;
        for v in [self.direct.size[0], self.direct.size[1], self.batch] {
            out.put(&v.to_le_bytes())?;
        }
        out.put(&self.rays.to_le_bytes())?;
        out.put(&(self.batches.len() as u32).to_le_bytes())?;
        for b in &self.batches {
            out.put(&b.index.to_le_bytes())?;
            out.put(&b.direct.to_le_bytes())?;
            out.put(&b.indirect.to_le_bytes())?;
        }
        for p in &self.pixels {
            for m in [&p.direct, &p.indirect] {
                for v in [m.sum, m.squares].iter().flat_map(|v| v.to_array()).chain([m.luminance_squares]) {
                    out.put(&v.to_le_bytes())?;
                }
            }
            out.put(&[u8::from(p.surface)])?;
        }
        let Hashed { mut out, hasher } = out;
        out.write_all(&hasher.finish().to_le_bytes())?;
        out.flush()
    }

    /// Restores what [`Estimate::to_bytes`] made.
    ///
    /// # Errors
    /// [`Error::Format`] for anything else: other bytes, a cut or changed file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        Parts::read(bytes).map(Parts::estimate)
    }

    /// Writes the estimate to a file. A reader never sees a part of it: it is written beside and renamed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        let io = |source| Error::Io { path: path.to_owned(), source };
        let mut beside = path.as_os_str().to_owned();
        beside.push(format!(".{}.part", std::process::id()));
        let written = fs::File::create(&beside).and_then(|file| self.write(BufWriter::new(file)));
        written.and_then(|()| fs::rename(&beside, path)).map_err(|source| {
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
        let parts = Parts::read(&bytes)?;
        // The images need its memory.
        drop(bytes);
        Ok(parts.estimate())
    }
}

/// What is stored of an estimate; the rest follows.
struct Parts {
    size: [u32; 2],
    pixels: Vec<Pixel>,
    batch: u32,
    batches: Vec<Batch>,
    rays: u64,
    key: u128,
}

impl Parts {
    fn read(bytes: &[u8]) -> Result<Self, Error> {
        let fail = |message| Err(Error::Format { message });
        let Some((content, sum)) = bytes.split_last_chunk::<8>() else { return fail("too short") };
        if !content.starts_with(MAGIC) {
            return fail("it starts differently");
        }
        if checksum(content) != u64::from_le_bytes(*sum) {
            return fail("its checksum does not match");
        }
        // The checksum holds, so what follows is as it was written; a length may still come from a forger.
        Reader(&content[MAGIC.len()..]).parts().map_or_else(|| fail("its parts do not add up"), Ok)
    }

    fn estimate(self) -> Estimate {
        Estimate::new(self.size, self.pixels, self.batch, self.batches, self.rays, self.key)
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

    fn parts(mut self) -> Option<Parts> {
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
        let mut read = Vec::with_capacity(pixels);
        for _ in 0..pixels {
            let (direct, indirect) = (self.moments()?, self.moments()?);
            read.push(Pixel { direct, indirect, surface: self.take::<1>()? != [0] });
        }
        Some(Parts { size, pixels: read, batch, batches, rays, key })
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
