//! Primitives into one world-space mesh.

use std::rc::Rc;

use glam::{DMat3, DVec3, Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mesh as JsonMesh, Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use indirect_core::{Mesh, math};

use super::accessor::Accessor;
use super::file::{File, label};
use super::loaded::LoadStats;
use super::node::{Instance, unit};
use super::options::LoadOptions;
use super::warnings::Warnings;
use crate::SceneLoadError;

/// The most primitives that the instances may add up to. Each is a draw call to other renderers and seldom has fewer than a
/// hundred triangles, so that no real scene comes near; a small file could ask for billions.
const MAX_PLACED: u64 = 1 << 22;

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
    lightmap_uvs: Option<Accessor<'a>>,
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

/// What [`survey`] found.
pub(super) struct Survey {
    /// Per material, and one more for primitives without one, whether any triangle has it.
    pub(super) used: Vec<bool>,
    /// Per mesh of the file, the numbers of its primitives that have triangles; empty where no instance shows it.
    solid: Vec<Vec<usize>>,
}

/// Grows the scene's mesh, one primitive of one instance at a time.
pub(super) struct MeshBuilder<'f> {
    file: &'f File<'f>,
    uv_set: &'f [Option<u32>],
    survey: &'f Survey,
    /// Per mesh, its primitives that have triangles, opened when the first instance asks for them.
    sources: Vec<Option<Rc<[Source<'f>]>>>,
    mesh: Mesh,
    stats: LoadStats,
    /// Whether the second texture coordinates are wanted, and what there is of them.
    lightmap: bool,
    lightmap_uvs: Vec<Vec2>,
    /// Per vertex of the primitive at hand: the round in which it was last copied, and where to.
    copied: Vec<(u32, u32)>,
    round: u32,
    /// Whether a vertex colour of the primitive at hand had to be clamped.
    clamped_color: bool,
}

/// Primitive `i` of a mesh, as messages name it, and the number of its material, which is one past the last for primitives
/// without one.
fn describe(file: &File<'_>, index: usize, mesh: &JsonMesh, i: usize) -> (String, usize) {
    let name = label("mesh", index, mesh.name.as_deref());
    let material = mesh.primitives[i].material.map_or(file.root.materials.len(), |m| m.value());
    (format!("{name}, primitive {i}"), material)
}

/// Checks what can be checked before anything is copied: the number of primitives and of triangles that the instances add
/// up to, and which materials they use. Every mesh is looked at once, however many instances show it.
pub(super) fn survey(
    file: &File<'_>,
    instances: &[Instance],
    options: &LoadOptions,
    warnings: &mut Warnings,
    stats: &mut LoadStats,
) -> Result<Survey, SceneLoadError> {
    let meshes = &file.root.meshes;
    let mut survey =
        Survey { used: vec![false; file.root.materials.len() + 1], solid: vec![Vec::new(); meshes.len()] };
    // Per mesh, its number of triangles once it is known.
    let mut known: Vec<Option<u64>> = vec![None; meshes.len()];
    let (mut triangles, mut placed) = (0_u64, 0_u64);
    for instance in instances {
        let mesh = file.get(meshes, instance.mesh, "mesh", &instance.node)?;
        let index = instance.mesh.value();
        let own = match known[index] {
            Some(n) => n,
            None => survey.look_at(file, index, mesh, warnings, stats)?,
        };
        known[index] = Some(own);
        triangles = triangles.saturating_add(own);
        placed += survey.solid[index].len() as u64;
        if placed > MAX_PLACED {
            let name = label("mesh", index, mesh.name.as_deref());
            let problem = format!(
                "with it the scene's instances add up to {placed} primitives, more than the limit of {MAX_PLACED}: join its primitives"
            );
            return Err(file.fault(format!("{}, {name}", instance.node), problem));
        }
    }
    // Vertices are numbered with u32, and a mesh without normals has three per triangle.
    let limit = (options.max_triangles as u64).min(u64::from(u32::MAX / 3));
    if triangles > limit {
        return Err(SceneLoadError::TooLarge { path: file.path.display().to_string(), triangles, limit });
    }
    Ok(survey)
}

impl Survey {
    /// Looks at a mesh that has not been looked at before; returns its number of triangles.
    fn look_at(
        &mut self,
        file: &File<'_>,
        index: usize,
        mesh: &JsonMesh,
        warnings: &mut Warnings,
        stats: &mut LoadStats,
    ) -> Result<u64, SceneLoadError> {
        let mut triangles = 0_u64;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let (name, material) = describe(file, index, mesh, i);
            let source = open(file, primitive, &name, material, None, false)?;
            if primitive.targets.is_some() {
                warnings.add("morph targets are not modelled: the base mesh is used", &name);
            }
            match source.map_or(0, |s| s.triangles()) {
                0 => {
                    stats.skipped_primitives += 1;
                    warnings.add("points, lines or no vertices: skipped", &name);
                }
                n => {
                    triangles = triangles.saturating_add(n as u64);
                    if let Some(index) = primitive.material {
                        file.get(&file.root.materials, index, "material", &name)?;
                    }
                    self.used[material] = true;
                    self.solid[index].push(i);
                }
            }
        }
        Ok(triangles)
    }
}

/// Opens the accessors of a primitive; `None` where it has no positions.
fn open<'f>(
    file: &'f File<'_>,
    primitive: &Primitive,
    name: &str,
    material: usize,
    uv_set: Option<u32>,
    lightmap: bool,
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
        lightmap_uvs: if lightmap { attribute(Semantic::TexCoords(1), &[Type::Vec2])? } else { None },
        colors: attribute(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])?,
        material: material as u32,
        positions,
    };
    let vertices = source.positions.count;
    for (what, other) in [
        ("NORMAL", &source.normals),
        ("TEXCOORD", &source.uvs),
        ("TEXCOORD_1", &source.lightmap_uvs),
        ("COLOR_0", &source.colors),
    ] {
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
    pub(super) fn new(
        file: &'f File<'f>,
        uv_set: &'f [Option<u32>],
        survey: &'f Survey,
        stats: LoadStats,
        options: &LoadOptions,
    ) -> Self {
        Self {
            file,
            uv_set,
            survey,
            sources: vec![None; file.root.meshes.len()],
            mesh: Mesh::default(),
            stats,
            lightmap: options.lightmap_uvs,
            lightmap_uvs: Vec::new(),
            copied: Vec::new(),
            round: 0,
            clamped_color: false,
        }
    }

    /// The finished mesh: attributes that some primitives lack are filled up.
    pub(super) fn finish(mut self) -> (Mesh, LoadStats, Vec<Vec2>) {
        let vertices = self.mesh.positions.len();
        if !self.mesh.uvs.is_empty() {
            self.mesh.uvs.resize(vertices, Vec2::ZERO);
        }
        if !self.mesh.colors.is_empty() {
            self.mesh.colors.resize(vertices, Vec3::ONE);
        }
        if !self.lightmap_uvs.is_empty() {
            self.lightmap_uvs.resize(vertices, Vec2::NAN);
        }
        (self.mesh, self.stats, self.lightmap_uvs)
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
        for source in self.sources(instance, warnings)?.iter() {
            self.add_primitive(source, &placement, warnings)?;
        }
        Ok(())
    }

    /// The primitives with triangles of an instance's mesh.
    fn sources(
        &mut self,
        instance: &Instance,
        warnings: &mut Warnings,
    ) -> Result<Rc<[Source<'f>]>, SceneLoadError> {
        let index = instance.mesh.value();
        if let Some(Some(known)) = self.sources.get(index) {
            return Ok(Rc::clone(known));
        }
        let file = self.file;
        let mesh = file.get(&file.root.meshes, instance.mesh, "mesh", &instance.node)?;
        let mut sources = Vec::new();
        for &i in &self.survey.solid[index] {
            let (name, material) = describe(file, index, mesh, i);
            let uv_set = self.uv_set.get(material).copied().flatten();
            let Some(source) = open(file, &mesh.primitives[i], &name, material, uv_set, self.lightmap)?
            else {
                continue;
            };
            if uv_set.is_some() && source.uvs.is_none() {
                warnings.add(
                    "its material is textured, but it has no texture coordinates: (0, 0) is used",
                    &name,
                );
            }
            sources.push(source);
        }
        let sources: Rc<[_]> = sources.into();
        self.sources[index] = Some(Rc::clone(&sources));
        Ok(sources)
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
        if let Some(uvs) = &source.lightmap_uvs {
            self.lightmap_uvs.resize(new, Vec2::NAN);
            self.lightmap_uvs.push(Vec2::from(uvs.get(v as usize)));
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
