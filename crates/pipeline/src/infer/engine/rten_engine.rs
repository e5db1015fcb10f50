//! rten behind [`Session`].

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use rten::{Model, RunOptions, ThreadPool, Value, ValueOrView, ValueView};

use super::{Input, Session, threads};
use touch2touch_core::diffusion::Tensor;

/// One pool for all graphs: they never run at the same time.
fn pool() -> Arc<ThreadPool> {
    static POOL: OnceLock<Arc<ThreadPool>> = OnceLock::new();
    POOL.get_or_init(|| Arc::new(ThreadPool::with_num_threads(threads()))).clone()
}

pub(super) struct RtenSession {
    model: Model,
}

pub(super) fn load(bytes: Cow<'static, [u8]>) -> Result<RtenSession, String> {
    let model = match bytes {
        Cow::Borrowed(bytes) => Model::load_static_slice(bytes),
        Cow::Owned(bytes) => Model::load(bytes),
    };
    Ok(RtenSession { model: model.map_err(|err| err.to_string())? })
}

impl Session for RtenSession {
    fn run(&mut self, inputs: &[(&str, Input<'_>)], output: &str) -> Result<Tensor, String> {
        let node = |name: &str| self.model.node_id(name).map_err(|err| err.to_string());
        let mut values: Vec<(_, ValueOrView<'_>)> = Vec::with_capacity(inputs.len());
        for &(name, input) in inputs {
            let value: ValueOrView<'_> = match input {
                Input::F32(t) => ValueView::from_shape(t.shape(), t.data()).map_err(|err| err.to_string())?.into(),
                Input::I64(numbers) => {
                    // rten holds 64-bit numbers in 32 bits.
                    let small: Result<Vec<i32>, _> = numbers.iter().map(|&n| i32::try_from(n)).collect();
                    let small = small.map_err(|err| format!("`{name}`: {err}"))?;
                    Value::from_shape([small.len()], small).map_err(|err| err.to_string())?.into()
                }
            };
            values.push((node(name)?, value));
        }
        let options = RunOptions::default().with_thread_pool(Some(pool()));
        let mut results = self.model.run(values, &[node(output)?], Some(options)).map_err(|err| err.to_string())?;
        let value = results.pop().ok_or("no output came back")?;
        let tensor = value.into_tensor::<f32>().ok_or_else(|| format!("`{output}` is not of type float32"))?;
        let shape = rten_tensor::Layout::shape(&tensor).to_vec();
        Tensor::new(shape, tensor.into_data()).ok_or_else(|| format!("`{output}` is malformed"))
    }
}
