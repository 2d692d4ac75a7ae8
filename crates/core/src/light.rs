use glam::Vec3;

/// What a punctual light radiates and from where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// Parallel light along `direction` (the way the light travels, unit length); the light's `power` is the irradiance
    /// on a surface that faces it, W/m².
    Directional {
        /// Unit direction of travel.
        direction: Vec3,
    },
    /// Isotropic point; `power` is its radiant intensity, W/sr.
    Point {
        /// Metres.
        position: Vec3,
    },
    /// A cone around `direction`; `power` is the radiant intensity inside the inner cone, W/sr.
    Spot {
        /// Metres.
        position: Vec3,
        /// Unit direction of the axis, away from the light.
        direction: Vec3,
        /// Half angle of full intensity, radians, `0 ≤ inner < outer`.
        inner_angle: f32,
        /// Half angle at which the intensity reaches 0, radians, `≤ π/2`.
        outer_angle: f32,
    },
}

/// A punctual light as `KHR_lights_punctual` defines it.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Name, for messages.
    pub name: String,
    /// Position, direction and shape.
    pub kind: LightKind,
    /// Colour × intensity per linear RGB channel: W/sr for points and spots, W/m² for directional lights.
    pub power: Vec3,
    /// Distance, metres, at which the light is windowed to 0 (`KHR_lights_punctual` `range`); `None` is physical.
    pub range: Option<f32>,
}

/// A [`Light`] seen from a surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Unit direction from the point to the light.
    pub direction: Vec3,
    /// Distance to the light, metres; infinite for a directional light.
    pub distance: f32,
    /// Irradiance on a surface at the point that faces the light, without occlusion, W/m².
    pub irradiance: Vec3,
}

impl Light {
    /// Radiant intensity towards the unit direction `w` (away from the light), W/sr; for a directional light the
    /// irradiance, whatever `w`.
    #[must_use]
    #[inline]
    pub fn intensity(&self, w: Vec3) -> Vec3 {
        match self.kind {
            LightKind::Spot { direction, inner_angle, outer_angle, .. } => {
                self.power * spot_attenuation(direction.dot(w), inner_angle, outer_angle)
            }
            LightKind::Directional { .. } | LightKind::Point { .. } => self.power,
        }
    }

    /// The light as seen from `p`. The irradiance is 0 outside a spot's cone, beyond `range` and at the light itself.
    #[must_use]
    #[inline]
    pub fn sample(&self, p: Vec3) -> LightSample {
        match self.kind {
            LightKind::Directional { direction } => {
                LightSample { direction: -direction, distance: f32::INFINITY, irradiance: self.power }
            }
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                let v = position - p;
                let distance = v.length();
                if distance.is_nan() || distance <= f32::MIN_POSITIVE {
                    return LightSample { direction: Vec3::Y, distance: 0.0, irradiance: Vec3::ZERO };
                }
                let direction = v / distance;
                let irradiance = self.intensity(-direction) * self.distance_attenuation(distance);
                LightSample { direction, distance, irradiance }
            }
        }
    }

    /// `1/d²`, windowed by [`Light::range`] as `KHR_lights_punctual` recommends: `max(0, min(1 − (d/range)⁴, 1)) / d²`.
    #[must_use]
    #[inline]
    pub fn distance_attenuation(&self, distance: f32) -> f32 {
        self.range_window(distance) / (distance * distance)
    }

    /// The window of [`Light::range`] alone, `[0, 1]`; 1 without a range.
    #[must_use]
    #[inline]
    pub fn range_window(&self, distance: f32) -> f32 {
        self.range.map_or(1.0, |range| (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0))
    }

    /// Position, metres; `None` for a directional light.
    #[must_use]
    pub fn position(&self) -> Option<Vec3> {
        match self.kind {
            LightKind::Directional { .. } => None,
            LightKind::Point { position } | LightKind::Spot { position, .. } => Some(position),
        }
    }
}

/// Angular attenuation of a spot light exactly as `KHR_lights_punctual` defines it, `[0, 1]`:
/// `clamp((cosθ − cos outer) / max(0.001, cos inner − cos outer), 0, 1)²`.
///
/// `cos_angle` is the cosine between the axis and the direction away from the light; angles in radians.
#[must_use]
#[inline]
pub fn spot_attenuation(cos_angle: f32, inner_angle: f32, outer_angle: f32) -> f32 {
    let scale = 1.0 / (inner_angle.cos() - outer_angle.cos()).max(0.001);
    let a = ((cos_angle - outer_angle.cos()) * scale).clamp(0.0, 1.0);
    a * a
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn spot_falloff_is_the_specified_one() {
        let (inner, outer) = (20.0_f32.to_radians(), 35.0_f32.to_radians());
        let at = |degrees: f32| spot_attenuation(degrees.to_radians().cos(), inner, outer);
        assert_eq!(at(0.0), 1.0);
        assert_eq!(at(20.0), 1.0);
        assert_eq!(at(35.1), 0.0);
        assert_eq!(at(120.0), 0.0);
        // ((cos 25° − cos 35°) / (cos 20° − cos 35°))², by hand: (0.0871556 / 0.1205405)² = 0.52278.
        assert_relative_eq!(at(25.0), 0.522_78, max_relative = 1e-3);
        // Equal angles: the 0.001 of the specification keeps it finite.
        assert!(spot_attenuation(1.0, 0.5, 0.5).is_finite());
    }

    #[test]
    fn point_light_follows_the_inverse_square_and_its_range() {
        let mut light = Light {
            name: String::new(),
            kind: LightKind::Point { position: Vec3::Y * 2.0 },
            power: Vec3::new(4.0, 8.0, 12.0),
            range: None,
        };
        let s = light.sample(Vec3::ZERO);
        assert_eq!((s.direction, s.distance, s.irradiance), (Vec3::Y, 2.0, Vec3::new(1.0, 2.0, 3.0)));
        light.range = Some(4.0);
        assert_relative_eq!(light.sample(Vec3::ZERO).irradiance.x, 1.0 - 1.0 / 16.0);
        light.range = Some(2.0);
        assert_eq!(light.sample(Vec3::ZERO).irradiance, Vec3::ZERO);
        assert_eq!(light.sample(Vec3::Y * 2.0).irradiance, Vec3::ZERO);
    }
}
