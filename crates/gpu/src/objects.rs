//! Objects of a scene that move as a whole.

use core::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec4};
use indirect_core::Mesh;
use indirect_shaders::POSE;
use wgpu::{Buffer, Queue};

use crate::{
    GpuError, Pass, PassTimer, Pipelines, SceneBuffers, Vec3Pad, named, storage_buffer, uniform_buffer,
};

indirect_core::wgsl_struct! {
    /// WGSL's `Pose` (`raster/pose.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[doc(hidden)]
    pub struct PoseUniform = "Pose" {
        /// Row of the matrix from rest to the world.
        pub position_x: Vec4,
        /// Row of the matrix from rest to the world.
        pub position_y: Vec4,
        /// Row of the matrix from rest to the world.
        pub position_z: Vec4,
        /// Row of the matrix for normals.
        pub normal_x: Vec4,
        /// Row of the matrix for normals.
        pub normal_y: Vec4,
        /// Row of the matrix for normals.
        pub normal_z: Vec4,
        /// The object's first vertex in the scene.
        pub first: u32,
        /// Its number of vertices.
        pub count: u32,
        /// Groups of four floats per vertex of the scene.
        pub stride: u32,
        /// Its first vertex at rest.
        pub rest: u32,
    }
}

/// One object that moves.
#[derive(Debug)]
struct Object {
    vertices: Range<u32>,
    rest: u32,
    uniform: Buffer,
    pass: Pass,
}

/// Objects of a scene that move as a whole: a frame uploads one matrix for each that moved, and the GPU places its vertices.
///
/// For vertices that move among themselves there is [`SceneBuffers::update`]. What was built from the mesh, such as an acceleration
/// structure, must follow on its own.
#[derive(Debug)]
pub struct MovingObjects {
    objects: Vec<Object>,
    stride: u32,
}

impl MovingObjects {
    /// Each object is a range of the vertices of `mesh`, which is at rest and was uploaded to `scene`.
    ///
    /// # Errors
    /// [`GpuError::Vertices`] for a range that the mesh does not have, [`GpuError::Limit`].
    pub fn new(
        pipelines: &Pipelines,
        scene: &SceneBuffers,
        mesh: &Mesh,
        objects: &[Range<u32>],
    ) -> Result<Self, GpuError> {
        let device = pipelines.device();
        let mut rest = Vec::new();
        for vertices in objects {
            let range = vertices.start as usize..vertices.end as usize;
            let positions = mesh.positions.get(range.clone());
            let (Some(positions), Some(normals), true) =
                (positions, mesh.normals.get(range), vertices.end <= scene.vertices())
            else {
                return Err(GpuError::Vertices { range: vertices.clone(), count: scene.vertices() });
            };
            for (p, n) in positions.iter().zip(normals) {
                rest.extend([Vec3Pad::new(*p, 0.0), Vec3Pad::new(*n, 0.0)]);
            }
        }
        let rest_vertices = storage_buffer(device, "rest_vertices", &rest)?;
        let mut first = 0;
        let mut made = Vec::with_capacity(objects.len());
        for vertices in objects {
            let uniform = uniform_buffer(device, "pose", &PoseUniform::zeroed());
            let names = [
                named("pose", &uniform),
                named("rest_vertices", &rest_vertices),
                named("posed_vertices", scene.vertex_buffer()),
            ];
            let mut pass = Pass::new("pose");
            let count = vertices.end - vertices.start;
            pass.compute(pipelines, (&POSE, "pose_vertices"), count.into(), &[&names])?;
            made.push(Object { vertices: vertices.clone(), rest: first, uniform, pass });
            first += count;
        }
        let found = Self { objects: made, stride: scene.vertex_stride() };
        Ok(found)
    }

    /// Places an object by a matrix from rest to the world, from the next submission on. Before its first call the object stays
    /// where the scene has it.
    ///
    /// # Errors
    /// [`GpuError::NoObject`].
    pub fn prepare(&self, queue: &Queue, object: usize, world_from_rest: &Affine3A) -> Result<(), GpuError> {
        let o = self.objects.get(object).ok_or(GpuError::NoObject { object, count: self.objects.len() })?;
        let m = world_from_rest.matrix3.transpose();
        let n = Mesh::normal_matrix(world_from_rest).transpose();
        let t = world_from_rest.translation;
        let uniform = PoseUniform {
            position_x: m.x_axis.extend(t.x),
            position_y: m.y_axis.extend(t.y),
            position_z: m.z_axis.extend(t.z),
            normal_x: n.x_axis.extend(0.0),
            normal_y: n.y_axis.extend(0.0),
            normal_z: n.z_axis.extend(0.0),
            first: o.vertices.start,
            count: o.vertices.end - o.vertices.start,
            stride: self.stride,
            rest: o.rest,
        };
        queue.write_buffer(&o.uniform, 0, bytemuck::bytes_of(&uniform));
        Ok(())
    }

    /// Encodes the placing of all objects, before whatever draws the scene.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, timer: &mut PassTimer) {
        self.objects.iter().for_each(|o| o.pass.encode(encoder, timer, None));
    }
}
