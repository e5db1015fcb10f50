//! Comparison of an execution provider's outputs with the processor's.

use super::{as_inputs, batch_of_one};
use crate::infer::bundle::Bundle;
use crate::infer::bundle::contract::promised;
use crate::infer::engine::{EngineKind, Graph};
use touch2touch_core::diffusion::{GaussianNoise, Tensor};

/// Training step of the diffusion at which its denoiser is compared: half noise.
const STEP: i64 = 500;

/// Runs every graph of a bundle on noise, by the engine and by ONNX Runtime on the processor. What is not on a provider is
/// not compared.
///
/// # Errors
/// Words of the difference, or of the graph that could not be run.
pub(super) fn with_the_processor(bundle: &Bundle, engine: EngineKind) -> Result<(), String> {
    let EngineKind::On(provider) = engine else { return Ok(()) };
    for (role, file) in bundle.files() {
        let Some((inputs, outputs)) = promised(role, bundle.spec()) else { continue };
        let mut noise = GaussianNoise::new(1);
        let mut drawn = |shape: Vec<usize>| {
            let mut tensor = Tensor::filled(shape, STEP as f32);
            // A single number is the timestep.
            let is_number = tensor.shape().len() == 1;
            tensor.data_mut().iter_mut().filter(|_| !is_number).for_each(|v| *v = noise.draw() as f32);
            tensor
        };
        let given: Vec<(&str, Tensor)> = inputs.iter().map(|p| (&*p.name, drawn(batch_of_one(&p.shape)))).collect();
        let inputs = as_inputs(bundle, &given, &[STEP]);
        let run = |engine| -> Result<Vec<Tensor>, String> {
            let mut graph = Graph::load(engine, role, file).map_err(|err| err.to_string())?;
            let outputs = outputs.iter();
            let run = outputs.map(|output| graph.run(&inputs, &output.name, &batch_of_one(&output.shape)));
            run.collect::<Result<_, _>>().map_err(|err| err.to_string())
        };
        let (expected, found) = (run(EngineKind::Ort)?, run(engine)?);
        let share = expected.iter().zip(&found).map(|(a, b)| difference(a, b)).fold(0.0, f32::max);
        log::debug!("the graph `{}` on {}: differs by {share:.1e}", role.key(), engine.label());
        if share > provider.tolerance() {
            return Err(format!(
                "the graph `{}` differs from the processor by {:.2} % of its largest value (at most {:.1} % \
                 is taken)",
                role.key(),
                100.0 * share,
                100.0 * provider.tolerance()
            ));
        }
    }
    Ok(())
}

/// Largest difference as a share of the largest value; both are finite.
fn difference(expected: &Tensor, found: &Tensor) -> f32 {
    let largest = expected.data().iter().fold(0.0, |max: f32, v| max.max(v.abs()));
    let apart = expected.data().iter().zip(found.data()).fold(0.0, |max: f32, (a, b)| max.max((a - b).abs()));
    if apart == 0.0 { 0.0 } else { apart / largest.max(f32::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_shares_of_the_largest_value() {
        let tensor = |data: [f32; 3]| Tensor::new(vec![1, 3], data.to_vec()).unwrap();
        let share = difference(&tensor([-4.0, 1.0, 0.0]), &tensor([-4.0, 1.5, 0.1]));
        assert!((share - 0.125).abs() < 1e-6, "{share}");
        assert_eq!(difference(&tensor([0.0; 3]), &tensor([0.0; 3])), 0.0);
        assert!(difference(&tensor([0.0; 3]), &tensor([1e-9, 0.0, 0.0])) > 1.0);
    }
}
