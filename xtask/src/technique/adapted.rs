//! A technique of a crate, seen through its adapter.

use std::marker::PhantomData;

use indirect_core::SceneProfile;
use indirect_gpu::wgpu::Limits;
use indirect_technique::gpu::{Resources, Twin};
use serde_json::{Map, Value};

use super::model::{Adapter, Backend, Notes, Renderer, Technique, Transport};
use super::settings::Values;
use super::{renderer, settings};
use crate::failure::Outcome;
use crate::stage::Stage;

/// A technique through its adapter.
pub(super) struct Adapted<A>(pub(super) PhantomData<A>);

impl<A: Adapter> Technique for Adapted<A> {
    fn name(&self) -> &'static str {
        <A::Technique as indirect_technique::Technique>::NAME
    }

    fn summary(&self) -> &'static str {
        A::SUMMARY
    }

    fn table(&self) -> String {
        settings::table::<A::Technique>()
    }

    fn has_key(&self, name: &str) -> bool {
        settings::keys::<A::Technique>().any(|k| k.name == name)
    }

    fn parse(&self, pairs: &[String]) -> Outcome<Values> {
        Values::parse::<A::Technique, _>(pairs)
    }

    fn config(&self, values: &Values, profile: &SceneProfile, seed: u32) -> Map<String, Value> {
        // The pairs were checked when they were parsed.
        let mut config = values.json::<A::Technique>(profile).unwrap_or_default();
        config.entry("seed").and_modify(|v| {
            if v.as_u64() == Some(0) {
                *v = seed.into();
            }
        });
        config
    }

    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>> {
        A::sweep(quick)
    }

    fn notes(&self, profile: &SceneProfile) -> Notes {
        A::notes(profile)
    }

    fn transport(&self, values: &Values) -> Transport {
        let settings = values.settings::<A::Technique>(&SceneProfile::default());
        A::transport(&settings.map(|(options, _)| options).unwrap_or_default())
    }

    fn settles(&self, values: &Values) -> usize {
        let settings = values.settings::<A::Technique>(&SceneProfile::default());
        A::settles(&settings.map(|(options, _)| options).unwrap_or_default())
    }

    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        let mut twins = Vec::new();
        for (prefix, pairs) in A::TWINS {
            let values = Values::parse::<A::Technique, _>(pairs)?;
            let found = renderer::Gpu::<A::Technique>::new(stage, &values, 1)?.twins(stage)?;
            twins.extend(found.into_iter().map(|t| Twin { buffer: format!("{prefix}{}", t.buffer), ..t }));
        }
        Ok(twins)
    }

    fn diagram(&self, stage: &Stage<'_>) -> Outcome<String> {
        Ok(renderer::Gpu::<A::Technique>::new(stage, &Values::default(), 0)?.diagram())
    }

    fn required_limits(&self, stage: &Stage<'_>, values: &Values) -> Outcome<Limits> {
        let setup = renderer::setup::<A::Technique>(stage, values, 0)?;
        let maps = rsm::views::views(stage.scene).len();
        Ok(Resources::<A::Technique>::required_limits(&setup, stage.size, maps))
    }

    fn prepare(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer>> {
        Ok(match backend {
            Backend::Cpu => Box::new(renderer::Cpu::<A::Technique>::new(stage, values, seed)?),
            Backend::Gpu => Box::new(renderer::Gpu::<A::Technique>::new(stage, values, seed)?),
        })
    }

    fn prepare_mixed(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        others: Backend,
        choices: &[(String, Backend)],
    ) -> Outcome<Box<dyn Renderer>> {
        Ok(Box::new(renderer::Mixed::<A::Technique>::new(stage, values, seed, others, choices)?))
    }
}
