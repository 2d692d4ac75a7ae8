// mips: mean and bounds of blocks of the camera's pixels, level by level from level 1; one dispatch per level.
// Twin: crates/image-space-radiosity/src/cpu/mips.rs. Source: Nichols, Shopf & Wyman 2009, §3.2.1.

@group(0) @binding(0) var<uniform> pair: LevelPair;
/// Levels 1 and coarser.
@group(0) @binding(1) var<storage, read_write> blocks: array<Block>;

@compute @workgroup_size(64)
fn mips_parent(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height {
        blocks[pair.coarse_offset - pair.first + i] = parent(i % pair.coarse_width, i / pair.coarse_width);
    }
}

/// The block of the up to four children at (2x, 2y)…(2x+1, 2y+1).
fn parent(x: u32, y: u32) -> Block {
    let a = child(2u * x, 2u * y);
    let b = child(2u * x + 1u, 2u * y);
    let c = child(2u * x, 2u * y + 1u);
    let d = child(2u * x + 1u, 2u * y + 1u);
    var block = BLOCK_EMPTY;
    block.pixels = a.pixels + b.pixels + c.pixels + d.pixels;
    if block.pixels == 0u {
        return block;
    }
    block.depth_min = min(min(a.depth_min, b.depth_min), min(c.depth_min, d.depth_min));
    block.depth_max = max(max(a.depth_max, b.depth_max), max(c.depth_max, d.depth_max));
    let covered = side(x, pair.level, pair.image_width) * side(y, pair.level, pair.image_height);
    block.mixed = u32(block.pixels < covered);
    let axis = a.normal + b.normal + c.normal + d.normal;
    let length = sqrt(dot(axis, axis));
    let cancelled = length < 1e-3;
    // Normals that cancel: no axis is better than another, the cone is everything.
    block.normal = select(axis * (1.0 / length), vec3(0.0, 0.0, 1.0), cancelled);
    let pixels = f32(block.pixels);
    block.position = a.position * (f32(a.pixels) / pixels) + b.position * (f32(b.pixels) / pixels)
        + c.position * (f32(c.pixels) / pixels) + d.position * (f32(d.pixels) / pixels);
    widen(&block, a);
    widen(&block, b);
    widen(&block, c);
    widen(&block, d);
    if cancelled {
        block.versine = 2.0;
    }
    return block;
}

/// A block of the finer level; empty outside the image.
fn child(x: u32, y: u32) -> Block {
    if x < pair.fine_width && y < pair.fine_height {
        let node = pair.fine_offset + y * pair.fine_width + x;
        if pair.level == 1u {
            return pixel(node);
        }
        return blocks[node - pair.first];
    }
    return BLOCK_EMPTY;
}

/// Makes sphere and cone contain those of a child.
fn widen(block: ptr<function, Block>, child: Block) {
    if child.pixels > 0u {
        let v = child.position - (*block).position;
        (*block).radius = max((*block).radius, sqrt(dot(v, v)) + child.radius);
        let offset = child.normal - (*block).normal;
        let versine = versine_of_sum(0.5 * dot(offset, offset), child.versine);
        (*block).versine = max((*block).versine, versine);
    }
}

/// Pixels along one side of a block that lie inside the image.
fn side(i: u32, level: u32, size: u32) -> u32 {
    return min((i + 1u) << level, size) - (i << level);
}
