//! KTX2: volumes of half floats (Khronos, "KTX File Format Specification" 2.0, and "Khronos Data Format Specification" 1.3).

use glam::Vec3;
use half::f16;

use crate::ImageFileError;

const IDENTIFIER: [u8; 12] = [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// `VK_FORMAT_R16G16B16A16_SFLOAT`.
const FORMAT: u32 = 97;

const HEADER: u32 = 80;
const LEVEL_INDEX: u32 = 24;
/// Total size, block header, four samples.
const DESCRIPTOR: u32 = 4 + 24 + 4 * 16;

/// A volume of `size` texels, x fastest, then y, then z, as one level of `R16G16B16A16_SFLOAT`, linear, alpha 1. What is beyond the largest half
/// float becomes that; what is not a number becomes 0.
///
/// # Errors
/// [`ImageFileError::Size`] where there are not as many texels, or none.
pub fn encode_volume(size: [u32; 3], texels: &[Vec3]) -> Result<Vec<u8>, ImageFileError> {
    let count = size.iter().try_fold(1_usize, |n, s| n.checked_mul(*s as usize));
    if texels.is_empty() || count != Some(texels.len()) {
        return Err(ImageFileError::Size { size: [size[0], size[1].saturating_mul(size[2])] });
    }
    let writer: &[u8] = b"KTXwriter\0indirect\0";
    let pair = writer.len() as u32;
    let (descriptor, pairs) = (HEADER + LEVEL_INDEX, HEADER + LEVEL_INDEX + DESCRIPTOR);
    let pairs_length = 4 + pair.next_multiple_of(4);
    // Texels begin at a multiple of their own size.
    let data = (pairs + pairs_length).next_multiple_of(8);
    let bytes = texels.len() as u64 * 8;

    let mut out = Vec::with_capacity(data as usize + bytes as usize);
    out.extend(IDENTIFIER);
    let [width, height, depth] = size;
    // Format, size of a component, extents, layers, faces, levels, no supercompression.
    let header = [FORMAT, 2, width, height, depth, 0, 1, 1, 0, descriptor, DESCRIPTOR, pairs, pairs_length];
    out.extend(header.iter().flat_map(|v| v.to_le_bytes()));
    // No global data; the one level, which is not compressed.
    out.extend([0, 0, u64::from(data), bytes, bytes].iter().flat_map(|v| v.to_le_bytes()));
    // Version 2, block of 88 bytes; RGB of BT.709, linear; one texel to a block; 8 bytes in plane 0.
    let block = [DESCRIPTOR, 0, 2 | (88 << 16), 1 | (1 << 8) | (1 << 16), 0, 8, 0];
    out.extend(block.iter().flat_map(|v| v.to_le_bytes()));
    for (i, channel) in [0_u32, 1, 2, 15].into_iter().enumerate() {
        // Bit offset, 16 bits, signed float of that channel; position; what −1 and 1 are.
        let sample = [(16 * i as u32) | (15 << 16) | ((0xc0 | channel) << 24), 0];
        out.extend(sample.iter().flat_map(|v| v.to_le_bytes()));
        out.extend([-1.0_f32, 1.0].iter().flat_map(|v| v.to_le_bytes()));
    }
    out.extend(pair.to_le_bytes());
    out.extend(writer);
    out.resize(data as usize, 0);
    let half = |v: f32| f16::from_f32(if v.is_nan() { 0.0 } else { v.clamp(-65504.0, 65504.0) });
    for texel in texels {
        let channels = [texel.x, texel.y, texel.z, 1.0];
        out.extend(channels.into_iter().flat_map(|v| half(v).to_le_bytes()));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_are_read_by_another_reader() {
        let size = [3, 4, 5];
        let mut texels: Vec<Vec3> = (0..60).map(|i| Vec3::new(i as f32, 0.25 * i as f32, -1.0)).collect();
        texels[7] = Vec3::new(f32::NAN, 1e9, f32::NEG_INFINITY);
        let bytes = encode_volume(size, &texels).unwrap();
        let file = ::ktx2::Reader::new(bytes.as_slice()).unwrap();
        let header = file.header();
        assert_eq!(header.format, Some(::ktx2::Format::R16G16B16A16_SFLOAT));
        assert_eq!([header.pixel_width, header.pixel_height, header.pixel_depth], size);
        assert_eq!((header.level_count, header.face_count, header.layer_count), (1, 1, 0));
        let writer = file.key_value_data().find(|(key, _)| *key == "KTXwriter");
        assert!(writer.is_some());
        let level = file.levels().next().unwrap();
        let read: Vec<[f32; 4]> = level
            .data
            .chunks_exact(8)
            .map(|t| core::array::from_fn(|c| f16::from_le_bytes([t[2 * c], t[2 * c + 1]]).to_f32()))
            .collect();
        assert_eq!(read.len(), 60);
        for (i, (t, found)) in texels.iter().zip(&read).enumerate() {
            let wanted = if i == 7 { [0.0, 65504.0, -65504.0, 1.0] } else { [t.x, t.y, t.z, 1.0] };
            // These quarters below 64 are half floats.
            assert_eq!(*found, wanted, "{i}");
        }
        assert!(encode_volume([2, 2, 2], &texels).is_err() && encode_volume([0, 1, 1], &[]).is_err());
    }
}
