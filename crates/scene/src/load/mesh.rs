//! Primitives into one world-space mesh.

use glam::{DMat3, DVec3, Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use indirect_core::{Mesh, math};

use super::accessor::Accessor;
use super::file::{File, label};
use super::node::{Instance, unit};
use super::warnings::Warnings;
use super::{LoadOptions, LoadStats};
use crate::SceneLoadError;

/// Coordinates beyond this, metres, would overflow the squares and cross products of f32.
const MAX_COORDINATE: f32 = 1e9;

/// The attributes of one primitive, opened and checked.
struct Source<'a> {
    /// File's words for this primitive.
    name: String,
    mode: Mode,
    indices: Option<Accessor<'a>>,
    positions: Accessor<'a>,
    normals: Option<Accessor<'a>>,
    uvs: Option<Accessor<'a>>,
    colors: Option<Accessor<'a>>,
    material: u32,
}

impl Source<'_> {
    fn corners(&self) -> usize {
        self.indices.as_ref().map_or(self.positions.count, |i| i.count)
    }

    fn triangles(&self) -> usize {
        match self.mode {
            Mode::Triangles => self.corners() / 3,
            Mode::TriangleStrip | Mode::TriangleFan => self.corners().saturating_sub(2),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
        }
    }

    /// Vertices of triangle `k`, in the order of glTF 2.0, section 3.7.2.1.
    fn triangle(&self, k: usize) -> [u32; 3] {
        let corners = match self.mode {
            Mode::TriangleStrip => [k, k + 1 + k % 2, k + 2 - k % 2],
            Mode::TriangleFan => [k + 1, k + 2, 0],
            _ => [3 * k, 3 * k + 1, 3 * k + 2],
        };
        corners.map(|c| self.indices.as_ref().map_or(c as u32, |i| i.index(c)))
    }
}

/// Grows the scene's mesh, one primitive of one instance at a time.
pub(super) struct MeshBuilder<'f> {
    file: &'f File<'f>,
    uv_set: &'f [Option<u32>],
    mesh: Mesh,
    stats: LoadStats,
    /// Per vertex of the primitive at hand: the round in which it was last copied, and where to.
    copied: Vec<(u32, u32)>,
    round: u32,
    /// Whether a vertex colour of the primitive at hand had to be clamped.
    clamped_color: bool,
}

/// The primitives of an instance: a name for messages, the primitive, and the number of its material, which is one past
/// the last for primitives without one.
fn primitives<'f>(
    file: &'f File<'_>,
    instance: &Instance,
) -> Result<impl Iterator<Item = (String, &'f Primitive, usize)>, SceneLoadError> {
    let mesh = file.get(&file.root.meshes, instance.mesh, "mesh", &instance.node)?;
    let name = label("mesh", instance.mesh.value(), mesh.name.as_deref());
    let no_material = file.root.materials.len();
    Ok(mesh.primitives.iter().enumerate().map(move |(i, p)| {
        (format!("{name}, primitive {i}"), p, p.material.map_or(no_material, |m| m.value()))
    }))
}

/// Checks what can be checked before anything is copied: the number of triangles that the instances add up to, and which
/// materials they use (one more entry than the file has materials, for primitives without one).
pub(super) fn survey(
    file: &File<'_>,
    instances: &[Instance],
    options: &LoadOptions,
    warnings: &mut Warnings,
    stats: &mut LoadStats,
) -> Result<Vec<bool>, SceneLoadError> {
    let mut used = vec![false; file.root.materials.len() + 1];
    let mut triangles = 0_u64;
    for instance in instances {
        for (name, primitive, material) in primitives(file, instance)? {
            let source = open(file, primitive, &name, material, None)?;
            if primitive.targets.is_some() {
                warnings.add("morph targets are not modelled: the base mesh is used", &name);
            }
            match source.map_or(0, |s| s.triangles()) {
                0 => {
                    stats.skipped_primitives += 1;
                    warnings.add("points, lines or no vertices: skipped", &name);
                }
                n => {
                    triangles += n as u64;
                    if let Some(index) = primitive.material {
                        file.get(&file.root.materials, index, "material", &name)?;
                    }
                    used[material] = true;
                }
            }
        }
    }
    // Vertices are numbered with u32, and a mesh without normals has three per triangle.
    let limit = (options.max_triangles as u64).min(u64::from(u32::MAX / 3));
    if triangles > limit {
        return Err(SceneLoadError::TooLarge { path: file.path.display().to_string(), triangles, limit });
    }
    Ok(used)
}

/// Opens the accessors of a primitive; `None` where it has no positions.
fn open<'f>(
    file: &'f File<'_>,
    primitive: &Primitive,
    name: &str,
    material: usize,
    uv_set: Option<u32>,
) -> Result<Option<Source<'f>>, SceneLoadError> {
    const DRACO: &str = "KHR_draco_mesh_compression";
    let Checked::Valid(mode) = primitive.mode else {
        return Err(file.fault(name, "unknown mode"));
    };
    let attribute = |semantic: Semantic, types: &[Type]| {
        let words = Checked::Valid(semantic);
        let index = primitive.attributes.get(&words);
        let user = || format!("{name}, {}", words.to_string());
        index.map(|&index| Accessor::open(file, index, types, &user())).transpose()
    };
    let compressed = primitive.extensions.as_ref().is_some_and(|e| e.others.contains_key(DRACO));
    let key = Checked::Valid(Semantic::Positions);
    let hollow = |&index: &gltf::json::Index<gltf::json::Accessor>| {
        file.root.accessors.get(index.value()).is_some_and(|a| a.buffer_view.is_none())
    };
    if compressed && primitive.attributes.get(&key).is_none_or(hollow) {
        return Err(file.unsupported(DRACO));
    }
    let Some(positions) = attribute(Semantic::Positions, &[Type::Vec3])? else {
        return Ok(None);
    };
    let indices = match primitive.indices {
        None => None,
        Some(index) => {
            let user = format!("{name}, indices");
            let accessor = Accessor::open(file, index, &[Type::Scalar], &user)?;
            if !accessor.is_index() {
                return Err(file.fault(user, "must be u8, u16 or u32"));
            }
            Some(accessor)
        }
    };
    let source = Source {
        name: name.to_owned(),
        mode,
        indices,
        normals: attribute(Semantic::Normals, &[Type::Vec3])?,
        uvs: match uv_set {
            Some(set) => attribute(Semantic::TexCoords(set), &[Type::Vec2])?,
            None => None,
        },
        colors: attribute(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])?,
        material: material as u32,
        positions,
    };
    let vertices = source.positions.count;
    for (what, other) in [("NORMAL", &source.normals), ("TEXCOORD", &source.uvs), ("COLOR_0", &source.colors)]
    {
        if let Some(other) = other
            && other.count < vertices
        {
            let problem = format!("{what} has {} elements for {vertices} vertices", other.count);
            return Err(file.fault(name, problem));
        }
    }
    Ok(Some(source))
}

impl<'f> MeshBuilder<'f> {
    pub(super) fn new(file: &'f File<'f>, uv_set: &'f [Option<u32>], stats: LoadStats) -> Self {
        Self {
            file,
            uv_set,
            mesh: Mesh::default(),
            stats,
            copied: Vec::new(),
            round: 0,
            clamped_color: false,
        }
    }

    /// The finished mesh: attributes that some primitives lack are filled up.
    pub(super) fn finish(mut self) -> (Mesh, LoadStats) {
        let vertices = self.mesh.positions.len();
        if !self.mesh.uvs.is_empty() {
            self.mesh.uvs.resize(vertices, Vec2::ZERO);
        }
        if !self.mesh.colors.is_empty() {
            self.mesh.colors.resize(vertices, Vec3::ONE);
        }
        (self.mesh, self.stats)
    }

    /// Adds all triangles of an instance.
    pub(super) fn add(&mut self, instance: &Instance, warnings: &mut Warnings) -> Result<(), SceneLoadError> {
        let linear = DMat3::from_mat4(instance.world);
        let placement = Placement {
            world: instance.world,
            // The cofactor matrix is the inverse transpose times the determinant: it exists for flattening transforms
            // too, and its sign is taken back for mirroring ones.
            cofactor: DMat3::from_cols(
                linear.y_axis.cross(linear.z_axis),
                linear.z_axis.cross(linear.x_axis),
                linear.x_axis.cross(linear.y_axis),
            ),
            mirrored: linear.determinant() < 0.0,
        };
        for (name, primitive, material) in primitives(self.file, instance)? {
            let uv_set = self.uv_set.get(material).copied().flatten();
            let Some(source) = open(self.file, primitive, &name, material, uv_set)? else { continue };
            if source.triangles() == 0 {
                continue;
            }
            if uv_set.is_some() && source.uvs.is_none() {
                warnings.add(
                    "its material is textured, but it has no texture coordinates: (0, 0) is used",
                    &name,
                );
            }
            self.add_primitive(&source, &placement, warnings)?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        source: &Source<'_>,
        placement: &Placement,
        warnings: &mut Warnings,
    ) -> Result<(), SceneLoadError> {
        let vertices = source.positions.count;
        if self.copied.len() < vertices {
            self.copied.resize(vertices, (0, 0));
        }
        self.round += 1;
        for k in 0..source.triangles() {
            let mut corners = source.triangle(k);
            if let Some(&v) = corners.iter().find(|&&v| v as usize >= vertices) {
                let problem = format!("triangle {k} names vertex {v}, but there are {vertices}");
                return Err(self.file.fault(&source.name, problem));
            }
            if placement.mirrored {
                corners.swap(1, 2);
            }
            let [a, b, c] = corners;
            if a == b || b == c || c == a {
                self.stats.degenerate_triangles += 1;
                continue;
            }
            let mut points = [Vec3::ZERO; 3];
            for (point, v) in points.iter_mut().zip(corners) {
                *point = placement.point(source.positions.get(v as usize));
                if !point.is_finite() || point.abs().max_element() > MAX_COORDINATE {
                    return Err(self.bad_position(source, v, *point));
                }
            }
            let cross = (points[1] - points[0]).cross(points[2] - points[0]);
            // Its length is what every area and density divides by: it must not vanish in f32.
            if cross.length() == 0.0 {
                self.stats.degenerate_triangles += 1;
                continue;
            }
            let flat = math::normalize_or(cross, Vec3::Y);
            let triangle =
                core::array::from_fn(|i| self.vertex(source, placement, corners[i], points[i], flat));
            self.mesh.triangles.push(triangle);
            self.mesh.materials.push(source.material);
        }
        if core::mem::take(&mut self.clamped_color) {
            warnings.add("vertex colours outside [0, 1] were clamped", &source.name);
        }
        Ok(())
    }

    /// The scene's number of vertex `v`, which is copied when it is met first; without normals, for each triangle anew.
    fn vertex(&mut self, source: &Source<'_>, placement: &Placement, v: u32, point: Vec3, flat: Vec3) -> u32 {
        if source.normals.is_some() && self.copied[v as usize].0 == self.round {
            return self.copied[v as usize].1;
        }
        let new = self.mesh.positions.len();
        self.copied[v as usize] = (self.round, new as u32);
        self.mesh.positions.push(point);
        let normal = source.normals.as_ref().map_or(flat, |n| placement.normal(n.get(v as usize), flat));
        self.mesh.normals.push(normal);
        if let Some(uvs) = &source.uvs {
            self.mesh.uvs.resize(new, Vec2::ZERO);
            self.mesh.uvs.push(Vec2::from(uvs.get(v as usize)));
        }
        if let Some(colors) = &source.colors {
            let color = Vec3::from(colors.get::<3>(v as usize));
            let clamped = Vec3::select(color.is_nan_mask(), Vec3::ONE, color.clamp(Vec3::ZERO, Vec3::ONE));
            self.clamped_color |= clamped != color;
            self.mesh.colors.resize(new, Vec3::ONE);
            self.mesh.colors.push(clamped);
        }
        new as u32
    }

    fn bad_position(&self, source: &Source<'_>, vertex: u32, point: Vec3) -> SceneLoadError {
        let element = format!("{}, POSITION of vertex {vertex}", source.name);
        if point.is_finite() {
            let problem = format!("{point} lies beyond {MAX_COORDINATE:e} m: scale the scene down");
            return self.file.fault(element, problem);
        }
        self.file.fault(element, format!("{point} is not finite: the mesh is damaged, export it again"))
    }
}

/// How an instance lies in the world.
struct Placement {
    world: glam::DMat4,
    cofactor: DMat3,
    mirrored: bool,
}

impl Placement {
    fn point(&self, p: [f32; 3]) -> Vec3 {
        self.world.transform_point3(DVec3::from(p.map(f64::from))).as_vec3()
    }

    fn normal(&self, n: [f32; 3], fallback: Vec3) -> Vec3 {
        let n = self.cofactor * DVec3::from(n.map(f64::from));
        unit(if self.mirrored { -n } else { n }, fallback)
    }
}
