//! Passes and buffers as a picture.

use std::fmt::Write;

use indirect_gpu::wgpu::Buffer;
use indirect_gpu::{GBufferTarget, Pass};

/// One buffer and the names under which passes bind it.
struct Node {
    buffer: Buffer,
    names: Vec<&'static str>,
    camera: bool,
}

/// A mermaid graph: an arrow from a buffer to a pass that reads it, and from a pass to a buffer that it writes. Uniforms are left
/// out, and so are passes that do nothing.
pub(super) fn of<'a>(passes: impl Iterator<Item = &'a Pass>, camera: &GBufferTarget) -> String {
    let of_camera = [&camera.position, &camera.normal, &camera.albedo, &camera.triangle];
    let mut nodes: Vec<Node> = Vec::new();
    let mut edges: Vec<String> = Vec::new();
    let mut boxes = String::new();
    // Passes of one name are one box.
    let mut names: Vec<&str> = Vec::new();
    for pass in passes.filter(|p| !p.is_empty()) {
        let p = names.iter().position(|n| *n == pass.name()).unwrap_or_else(|| {
            names.push(pass.name());
            // Writing to a String cannot fail.
            let _ = writeln!(boxes, "    p{}[{}]", names.len() - 1, pass.name());
            names.len() - 1
        });
        for used in pass.uses() {
            let b = nodes.iter().position(|n| n.buffer == used.buffer).unwrap_or_else(|| {
                let camera = of_camera.contains(&&used.buffer);
                nodes.push(Node { buffer: used.buffer.clone(), names: Vec::new(), camera });
                nodes.len() - 1
            });
            if !nodes[b].names.contains(&used.name) {
                nodes[b].names.push(used.name);
            }
            let edge = if used.writes { format!("    p{p} --> b{b}") } else { format!("    b{b} --> p{p}") };
            if !edges.contains(&edge) {
                edges.push(edge);
            }
        }
    }
    let mut out = format!("graph TD\n{boxes}");
    for (i, n) in nodes.iter().enumerate() {
        let whose = if n.camera { "camera: " } else { "" };
        let _ = writeln!(out, "    b{i}[({whose}{})]", n.names.join(", "));
    }
    out + &edges.join("\n") + "\n"
}
