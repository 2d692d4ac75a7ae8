//! References that model less than the truth, each made when it is first asked for.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::Vec3;
use indirect_core::Scene;
use indirect_metrics::{Reference as MetricsReference, compare};
use reference_pathtracer::{Bounces, Components, Estimate, PixelFilter};

use super::data::{Matched, Run, Truth};
use super::effort::{Effort, TRUTH_SEED};
use super::truth::{affordable, deviation, relative_mean_error};
use crate::failure::{Failure, Outcome};
use crate::stage::{Source, Stage};
use crate::technique::{ReferenceOptions, Transport};

/// What a reference models, and whether emissive surfaces light it.
pub(super) type Model = (Transport, bool);

/// References with less than the truth, each made when it is first asked for.
pub(super) struct Models<'a> {
    pub(super) source: &'a Source,
    pub(super) stage: &'a Stage<'a>,
    pub(super) truth: &'a Truth,
    pub(super) effort: Effort,
    pub(super) made: BTreeMap<Model, Rc<Estimate>>,
}

impl Models<'_> {
    pub(super) fn estimate(&mut self, model: Model) -> Outcome<Rc<Estimate>> {
        if let Some(estimate) = self.made.get(&model) {
            return Ok(Rc::clone(estimate));
        }
        let (transport, emitters) = model;
        let options = ReferenceOptions {
            components: Components::Indirect,
            bounces: if transport.bounces == Transport::ALL {
                Bounces::Infinite
            } else {
                Bounces::Count(transport.bounces)
            },
            unoccluded: !transport.occluded,
            spp: 0,
            noise_target: Some(self.effort.noise_target()),
            seed: TRUTH_SEED + 1,
            pixel_filter: PixelFilter::Center,
        };
        let what = format!("reference of {transport}");
        let estimate = if emitters {
            affordable(self.stage, options, self.effort, &what)?
        } else {
            let without = Source {
                file: self.source.file.clone(),
                scene: without_emission(&self.source.scene),
                warnings: Vec::new(),
                load_ms: 0.0,
            };
            let stage = Stage::new(&without, self.source.camera(None)?, self.stage.size, None);
            affordable(&stage, options, self.effort, &what)?
        };
        let estimate = Rc::new(estimate);
        self.made.insert(model, Rc::clone(&estimate));
        Ok(estimate)
    }

    /// The models between the truth and what a technique with this transport must approach, which is the last: each with its
    /// name and what it leaves out that the one before has.
    pub(super) fn chain(&self, transport: Transport) -> Vec<(&'static str, String, Model)> {
        let Transport { bounces, occluded, emitters } = transport;
        let seen = Transport { occluded: true, ..transport };
        let mut chain = Vec::new();
        if bounces != Transport::ALL {
            chain.push(("later bounces", format!("the model stops after bounce {bounces}"), (seen, true)));
        }
        if !occluded {
            let why = "the model lets light of the first bounce pass through what stands between";
            chain.push(("visibility", why.to_owned(), (transport, true)));
        }
        if self.stage.profile.emissive_triangles > 0 && !emitters {
            let why = "the model has no light from emissive surfaces";
            chain.push(("emitters", why.to_owned(), (transport, false)));
        }
        chain
    }

    /// The error of a run against the last of its chain; `None` where that is black.
    pub(super) fn judge(&mut self, run: &Run, transport: Transport) -> Outcome<Option<Matched>> {
        use indirect_metrics::MetricsError;
        let Some((.., model)) = self.chain(transport).pop() else { return Ok(None) };
        if !model.1 && self.stage.profile.punctual_lights() == 0 {
            return Ok(None);
        }
        let matched = self.estimate(model)?;
        let reference = MetricsReference {
            image: &matched.indirect,
            surface: &matched.surface,
            standard_error: Some(&deviation(&matched.indirect_variance)),
            relative_mean_error: relative_mean_error(&matched),
        };
        match compare(&run.indirect, &reference) {
            Ok(error) => Ok(Some(Matched { transport, error })),
            Err(MetricsError::BlackReference | MetricsError::NoSurface) => Ok(None),
            Err(e) => Err(Failure::Check(format!("{}: {}: {e}", self.stage.file, run.technique))),
        }
    }
}

/// The scene with its emissive surfaces switched off.
fn without_emission(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for m in &mut scene.materials {
        m.emission = Vec3::ZERO;
    }
    scene
}
