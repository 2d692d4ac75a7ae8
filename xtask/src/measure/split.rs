//! The error of a technique's best run taken apart.

use indirect_core::Image;
use indirect_metrics::difference;

use super::data::{Part, Run, Split};
use super::models::Models;
use crate::failure::{Failure, Outcome};
use crate::technique::{Backend, Technique};

/// Takes the error of the best run apart: what the transport model leaves out, what the sampling adds, what the GPU's
/// arithmetic adds. `None` where the reference is black.
pub(super) fn split(
    models: &mut Models<'_>,
    technique: &dyn Technique,
    runs: &[Run],
) -> Outcome<Option<Split>> {
    let (stage, truth) = (models.stage, models.truth);
    let best = |backend| {
        let of = runs.iter().filter(|r| r.backend == backend && r.error.is_some());
        of.min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse()))
    };
    let Some(cpu) = best(Backend::Cpu) else { return Ok(None) };
    let pairs: Vec<_> = cpu.label.split_whitespace().map(str::to_owned).collect();
    let values = technique.parse(&pairs)?;
    let black = Image::new(stage.size);
    let mut made = Vec::new();
    for (name, why, model) in models.chain(technique.transport(&values)) {
        let dark = !model.1 && stage.profile.punctual_lights() == 0;
        made.push((name, why, if dark { None } else { Some(models.estimate(model)?) }));
    }
    // Each image with its name, what it leaves out that the one before has, and the variance of its pixels.
    let mut chain = vec![("truth", String::new(), &truth.images.indirect, Some(&truth.images.variance))];
    for (name, why, estimate) in &made {
        let (image, variance) =
            estimate.as_ref().map_or((&black, &black), |e| (&e.indirect, &e.indirect_variance));
        chain.push((name, why.clone(), image, Some(variance)));
    }
    chain.push((
        "discretisation",
        "maps, lattices and samples are finite; on the CPU".to_owned(),
        &cpu.indirect,
        None,
    ));
    let twin = runs.iter().find(|r| r.backend == Backend::Gpu && r.label == cpu.label);
    if let Some(gpu) = twin {
        chain.push((
            "precision",
            "the GPU against the CPU: rounding, and silhouette texels that fall to the other side".to_owned(),
            &gpu.indirect,
            None,
        ));
    }
    let part = |from: &Link<'_>, to: &Link<'_>| -> Outcome<Part> {
        let measures = difference(to.2, from.2, &truth.reference())
            .map_err(|e| Failure::Check(format!("{}: {e}", stage.file)))?;
        let noise =
            [from.3, to.3].into_iter().flatten().map(|v| truth.mean_square_noise(v)).sum::<f64>().sqrt();
        Ok(Part { name: to.0, explanation: to.1.clone(), measures, noise })
    };
    let parts = chain.windows(2).map(|pair| part(&pair[0], &pair[1])).collect::<Outcome<_>>()?;
    let whole = part(&chain[0], &chain[chain.len() - 1])?;
    Ok(Some(Split { label: cpu.label.clone(), parts, whole }))
}

/// Name, explanation, image and variance of an image in the chain from the truth to a technique.
type Link<'a> = (&'static str, String, &'a Image, Option<&'a Image>);
