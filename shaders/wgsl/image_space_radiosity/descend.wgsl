// descend: which shadow map a node of a map's pyramid asks, and where in a patch its map stands. Needs levels.wgsl, and of the module
//     fn node_weight(map: u32, node: u32) -> f32      sum of a node's flux; map within the part
// Twin: Tiles in crates/image-space-radiosity/src/cpu/shadows.rs.

/// Column and row of a node of level `to` beneath another one (level, column and row), drawn in proportion to flux by `number`.
fn descend(map: u32, own: vec3<u32>, to: u32, number: u32) -> vec2<u32> {
    var at = own.yz;
    for (var level = own.x; level > to; level--) {
        let l = table.levels[level - 1u].xyz;
        at = 2u * at;
        let a = child_weight(map, l, at);
        let b = a + child_weight(map, l, at + vec2(1u, 0u));
        let c = b + child_weight(map, l, at + vec2(0u, 1u));
        let d = c + child_weight(map, l, at + 1u);
        let t = unit_f32(hash_combine(number, level - 1u)) * d;
        // Less than the sum, unless all are 0.
        let child = select(u32(t >= a) + u32(t >= b) + u32(t >= c), 0u, !(t < d));
        at += vec2(child & 1u, child >> 1u);
    }
    return at;
}

fn child_weight(map: u32, l: vec3<u32>, at: vec2<u32>) -> f32 {
    if all(at < l.yz) {
        return node_weight(map, l.x + at.y * l.y + at.x);
    }
    return 0.0;
}

/// What the draws beneath a node begin with; the map among all.
fn descend_number(seed: u32, map: u32, node: u32) -> u32 {
    return hash_combine(hash_combine(seed, map), node);
}
