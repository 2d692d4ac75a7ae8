//! A tree that follows moved vertices.

use glam::Vec3;
use indirect_core::Scene;

use crate::builder::{corners, grown};
use crate::layout::{LEAF, Node, Packet, Tree, WIDTH};

/// Lower and upper corner of nothing.
const NOWHERE: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];

fn union(a: [Vec3; 2], b: [Vec3; 2]) -> [Vec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Vertices and boxes anew. Boxes of triangles that the build had split are those of the whole triangle.
pub(crate) fn refit(tree: &mut Tree, scene: &Scene) {
    let packets: Vec<[Vec3; 2]> = tree.packets.iter_mut().map(|p| refit_packet(p, scene)).collect();
    // Children lie behind their parents.
    let mut boxes = vec![NOWHERE; tree.nodes.len()];
    for i in (0..tree.nodes.len()).rev() {
        let node = &mut tree.nodes[i];
        for slot in 0..WIDTH {
            if is_used(node, slot) {
                let link = node.children[slot];
                let child =
                    if link & LEAF == 0 { boxes[link as usize] } else { packets[(link & !LEAF) as usize] };
                write(node, slot, child);
                boxes[i] = union(boxes[i], child);
            }
        }
    }
    if let Some([lo, hi]) = boxes.first() {
        tree.bounds = if lo.x <= hi.x { [lo.to_array(), hi.to_array()] } else { [[0.0; 3]; 2] };
    }
}

/// Node 0 is nobody's child, so that no used slot has the link 0.
fn is_used(node: &Node, slot: usize) -> bool {
    node.children[slot] != 0
}

/// The box of a child in its slot; that of nothing is entered by no ray.
fn write(node: &mut Node, slot: usize, [lo, hi]: [Vec3; 2]) {
    for axis in 0..3 {
        let [lo, hi] = if lo[axis] <= hi[axis] { grown(lo[axis], hi[axis]) } else { [lo[axis], hi[axis]] };
        node.planes[axis].0[slot] = lo;
        node.planes[axis + 3].0[slot] = hi;
    }
}

/// Where the triangles of a packet are now, and their box. Those that no ray can hit become NaN.
fn refit_packet(packet: &mut Packet, scene: &Scene) -> [Vec3; 2] {
    let mut bounds = NOWHERE;
    for lane in 0..WIDTH {
        let triangle = packet.triangles[lane] as usize;
        let found = if triangle < scene.mesh.triangles.len() { corners(scene, triangle) } else { None };
        for axis in 0..3 {
            for vertex in 0..3 {
                packet.vertices[axis][vertex].0[lane] = found.map_or(f32::NAN, |c| c[vertex][axis]);
            }
        }
        for corner in found.iter().flatten() {
            bounds = union(bounds, [*corner; 2]);
        }
    }
    bounds
}
