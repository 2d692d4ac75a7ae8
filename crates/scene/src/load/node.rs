//! The node tree: world transforms, cameras, lights, mesh instances.

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh};
use indirect_core::{Camera, CameraProjection, Light, LightKind};

use super::file::{File, label, short_name};
use super::warnings::Warnings;
use crate::SceneLoadError;

/// A mesh at a place.
pub(super) struct Instance {
    pub(super) mesh: Index<Mesh>,
    pub(super) world: DMat4,
    /// The node, for messages.
    pub(super) node: String,
}

/// What the nodes of the scene hold, in depth-first order.
#[derive(Default)]
pub(super) struct Nodes {
    pub(super) instances: Vec<Instance>,
    pub(super) cameras: Vec<Camera>,
    pub(super) lights: Vec<Light>,
}

/// Walks the default scene; a file without one has its first scene read, and without any scene all its root nodes.
pub(super) fn read(file: &File<'_>, warnings: &mut Warnings) -> Result<Nodes, SceneLoadError> {
    let root = &file.root;
    let mut stack: Vec<(Index<Node>, DMat4)> = Vec::new();
    let scene = match (root.scene, root.scenes.as_slice()) {
        (Some(scene), _) => Some(file.get(&root.scenes, scene, "scene", &"`scene`")?),
        (None, [scene]) => Some(scene),
        (None, [scene, ..]) => {
            warnings.add("several scenes and no default: the first is used", "");
            Some(scene)
        }
        (None, []) => None,
    };
    match scene {
        Some(scene) => stack.extend(scene.nodes.iter().rev().map(|&n| (n, DMat4::IDENTITY))),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().filter_map(|n| n.children.as_ref()).flatten() {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            let roots = (0..root.nodes.len() as u32).rev().filter(|&i| !is_child[i as usize]);
            stack.extend(roots.map(|i| (Index::new(i), DMat4::IDENTITY)));
        }
    }
    let mut seen = vec![false; root.nodes.len()];
    let mut out = Nodes::default();
    while let Some((index, parent)) = stack.pop() {
        let node = file.get(&root.nodes, index, "node", &"the node tree")?;
        let name = label("node", index.value(), node.name.as_deref());
        // A tree reaches each node once, which also bounds this loop.
        if core::mem::replace(&mut seen[index.value()], true) {
            return Err(file.fault(name, "is reached twice: its parents form a cycle or share it"));
        }
        let world = parent * local(node);
        if !world.is_finite() {
            return Err(file.fault(name, "its transform is not finite"));
        }
        if let Some(mesh) = node.mesh {
            if node.skin.is_some() {
                warnings.add("skinned: its mesh is used as it is stored, placed by its node", &name);
            }
            out.instances.push(Instance { mesh, world, node: name.clone() });
        }
        if let Some(camera) = node.camera {
            let json = file.get(&root.cameras, camera, "camera", &name)?;
            let own = node.name.as_deref().or(json.name.as_deref()).map(short_name);
            out.cameras.push(read_camera(file, json, own.unwrap_or_default(), world, &name)?);
        }
        if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
            out.lights.push(read_light(file, light.light.value(), node, world, &name)?);
        }
        stack.extend(node.children.iter().flatten().rev().map(|&child| (child, world)));
    }
    Ok(out)
}

fn local(node: &Node) -> DMat4 {
    if let Some(m) = node.matrix {
        return DMat4::from_cols_array(&m.map(f64::from));
    }
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    let q = DQuat::from_array(rotation);
    let q = if q.length_squared() > 0.0 && q.is_finite() { q.normalize() } else { DQuat::IDENTITY };
    let vector = |v: Option<[f32; 3]>, default: DVec3| v.map_or(default, |v| Vec3::from(v).as_dvec3());
    DMat4::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        q,
        vector(node.translation, DVec3::ZERO),
    )
}

/// A unit vector along `v`. What is already one up to the rounding of f32 is kept, so that written and read back it has
/// the same bits.
pub(super) fn unit(v: DVec3, fallback: Vec3) -> Vec3 {
    let length = v.length();
    if (length - 1.0).abs() < 1e-6 {
        v.as_vec3()
    } else if length > 0.0 && length.is_finite() {
        (v / length).as_vec3()
    } else {
        fallback
    }
}

/// glTF cameras and lights look along their local −Z with +Y up; scales do not matter to them.
fn axes(world: DMat4) -> (Vec3, Vec3, Vec3) {
    let m = DMat3::from_mat4(world);
    let position = world.w_axis.truncate().as_vec3();
    (position, unit(-m.z_axis, Vec3::NEG_Z), unit(m.y_axis, Vec3::Y))
}

fn read_camera(
    file: &File<'_>,
    json: &gltf::json::Camera,
    name: String,
    world: DMat4,
    node: &str,
) -> Result<Camera, SceneLoadError> {
    let (position, forward, up) = axes(world);
    let positive = |v: f32| v > 0.0 && v.is_finite();
    let (projection, aspect, near, far) = match (json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), _) => {
            if !(positive(p.yfov) && p.yfov < core::f32::consts::PI && p.znear > 0.0) {
                let problem = format!("camera: yfov {} must be in (0, π), znear {} above 0", p.yfov, p.znear);
                return Err(file.fault(node, problem));
            }
            let far = p.zfar.unwrap_or(f32::INFINITY);
            (CameraProjection::Perspective { yfov: p.yfov }, p.aspect_ratio, p.znear, far)
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
            let (half_width, half_height) = (o.xmag.abs(), o.ymag.abs());
            if !(positive(half_width) && positive(half_height) && o.zfar.is_finite()) {
                return Err(
                    file.fault(node, "camera: xmag, ymag and zfar must be finite, xmag and ymag not 0")
                );
            }
            let aspect = Some(half_width / half_height);
            (CameraProjection::Orthographic { half_height }, aspect, o.znear, o.zfar)
        }
        _ => return Err(file.fault(node, "camera: neither perspective nor orthographic")),
    };
    if near.is_nan() || far.is_nan() || near >= far {
        return Err(file.fault(node, format!("camera: znear {near} must be below zfar {far}")));
    }
    let aspect = aspect.filter(|&a| positive(a));
    Ok(Camera { name, position, forward, up, projection, aspect, near, far })
}

fn read_light(
    file: &File<'_>,
    index: usize,
    node: &Node,
    world: DMat4,
    node_name: &str,
) -> Result<Light, SceneLoadError> {
    let lights = file.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let json = lights
        .and_then(|l| l.lights.get(index))
        .ok_or_else(|| file.fault(node_name, format!("names light {index}, which does not exist")))?;
    let (position, direction, _) = axes(world);
    let kind = match json.type_ {
        Checked::Valid(LightType::Directional) => LightKind::Directional { direction },
        Checked::Valid(LightType::Point) => LightKind::Point { position },
        Checked::Valid(LightType::Spot) => {
            let spot =
                json.spot.as_ref().ok_or_else(|| file.fault(node_name, "spot light without `spot`"))?;
            let (inner_angle, outer_angle) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(inner_angle >= 0.0
                && inner_angle <= outer_angle
                && outer_angle <= core::f32::consts::FRAC_PI_2)
            {
                let problem = format!(
                    "light: cone angles {inner_angle} and {outer_angle} must be 0 ≤ inner ≤ outer ≤ π/2"
                );
                return Err(file.fault(node_name, problem));
            }
            LightKind::Spot { position, direction, inner_angle, outer_angle }
        }
        Checked::Invalid => return Err(file.fault(node_name, "light of unknown type")),
    };
    let power = Vec3::from(json.color) * json.intensity;
    if !power.is_finite() || power.min_element() < 0.0 {
        return Err(file.fault(node_name, format!("light: power {power} must be finite and not negative")));
    }
    let range = json.range.filter(|r| r.is_finite());
    if range.is_some_and(|r| r <= 0.0) {
        return Err(file.fault(node_name, "light: its range must be above 0"));
    }
    let name = node.name.as_deref().or(json.name.as_deref()).map(short_name).unwrap_or_default();
    Ok(Light { name, kind, power, range })
}
