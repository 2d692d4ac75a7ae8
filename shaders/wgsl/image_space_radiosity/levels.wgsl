// The levels of a pyramid, for passes that treat all of them in one dispatch.
// Twin: crates/image-space-radiosity/src/levels.rs.

/// All levels of a pyramid: offset, width and height of each.
struct LevelTable {
    levels: array<vec4<u32>, 16>,
    count: u32,
    coarsest: u32,
    finest: u32,
    /// Nodes that a pass treats.
    nodes: u32,
}

@group(0) @binding(0) var<uniform> table: LevelTable;

/// Level, column and row of a node.
fn place(node: u32) -> vec3<u32> {
    // From the finest, which has three quarters of all nodes.
    var level = 0u;
    while level + 1u < table.count && table.levels[level + 1u].x <= node {
        level += 1u;
    }
    let l = table.levels[level];
    let i = node - l.x;
    return vec3(level, i % l.y, i / l.y);
}
