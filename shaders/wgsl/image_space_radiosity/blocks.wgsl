// Blocks of all levels.
// Twin: crates/image-space-radiosity/src/cpu/blocks.rs.

/// Levels 1 and coarser.
@group(0) @binding(12) var<storage, read> blocks: array<Block>;

/// The block of a node; `first` is the first node of level 1.
fn block(node: u32, first: u32) -> Block {
    if node < first {
        return pixel(node);
    }
    return blocks[node - first];
}
