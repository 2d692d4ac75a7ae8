//! Shared vocabulary of the `indirect` workspace.
//!
//! Plain data that a renderer already has ([`Scene`], [`View`], [`Light`], [`Material`], [`GBuffer`], [`Image`]) and the
//! small geometry that every transport method needs ([`form_factor`], [`solid_angle`], [`octahedral`],
//! [`math::offset_ray_origin`]). No I/O and no GPU.
//!
//! # Conventions
//!
//! * Metres, radians, right-handed world, Y up. View depth is positive along the view direction; NDC z is in `[0, 1]`.
//! * One value per linear RGB channel in a [`glam::Vec3`]: radiance W/(sr·m²), irradiance and radiosity W/m², flux W,
//!   radiant intensity W/sr. glTF's candela and lux are read as W/sr and W/m², one to one.
//! * A Lambertian surface of albedo `ρ` has the BRDF `ρ/π` and reflects on both sides. A diffuse patch that leaves the
//!   flux `Φ` (already reflected) has the intensity `I(ω) = Φ/π · max(0, n·ω)`.
//! * Image row 0 is the top row; texel `(x, y)` covers `[x, x+1) × [y, y+1)` and is shaded at its centre.
//!
//! # Example
//!
//! ```
//! use glam::Vec3;
//! use indirect_core::form_factor::{point_to_disc, point_to_point};
//!
//! // A unit-area patch one metre above a receiver that faces it. The truth for a square is 0.2395.
//! let (n, up) = (Vec3::NEG_Y, Vec3::Y);
//! let disc = point_to_disc(Vec3::ZERO, up, Vec3::Y, n, 1.0);
//! let point = point_to_point(Vec3::ZERO, up, Vec3::Y, n, 1.0);
//! assert!((disc - 0.2415).abs() < 1e-3 && (point - 0.3183).abs() < 1e-3);
//! ```

pub mod form_factor;
pub mod layout;
pub mod math;
pub mod octahedral;
pub mod settings;
pub mod solid_angle;
pub mod sort;

mod error;
mod gbuffer;
mod image;
mod light;
mod material;
mod pass;
mod profile;
mod ray;
mod scene;
mod view;

pub use error::SceneError;
pub use gbuffer::{GBuffer, NO_TRIANGLE};
pub use glam;
pub use image::Image;
pub use light::{Light, LightKind, LightSample, spot_attenuation};
pub use material::{AlphaMode, Material, Texture, TextureRef, Wrap};
pub use pass::PassTime;
pub use profile::SceneProfile;
pub use ray::{Hit, Ray};
pub use scene::{Aabb, Camera, CameraProjection, Mesh, Scene, Surface};
pub use view::{BadClipMatrix, ClipView, MapView, Projection, View};
