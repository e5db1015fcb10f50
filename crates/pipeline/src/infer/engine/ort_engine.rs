//! ONNX Runtime behind [`Session`], through a library that is loaded when it is first wanted.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ort::environment::Environment;
use ort::ep::{self, ExecutionProvider as _, ExecutionProviderDispatch};
use ort::session::{Session as OrtSession, SessionInputValue};
use ort::value::TensorRef;

use super::{Input, Library, NoProvider, Provider, Searched, Session, threads};
use crate::infer::library::candidates;
use touch2touch_core::diffusion::Tensor;

/// The library stays loaded once it is: ONNX Runtime cannot be unloaded safely.
enum State {
    NotSearched,
    Loaded { environment: Environment, library: Library },
    Absent(Vec<Searched>),
}

static STATE: Mutex<State> = Mutex::new(State::NotSearched);

fn state() -> MutexGuard<'static, State> {
    let mut state = STATE.lock().unwrap_or_else(PoisonError::into_inner);
    if matches!(*state, State::NotSearched) {
        *state = search();
    }
    state
}

/// Tries the candidates in order; the first that loads is taken.
fn search() -> State {
    let mut searched = Vec::new();
    for (place, library) in candidates() {
        let Some(path) = library else {
            searched.push(Searched { place, outcome: "no library there".into() });
            continue;
        };
        match open(&path) {
            Ok(environment) => {
                let build = ort::info().to_owned();
                return State::Loaded { environment, library: Library { path, found_in: place, build } };
            }
            Err(reason) => {
                log::warn!("the ONNX Runtime library could not be used: {reason}: {}", path.display());
                searched.push(Searched { place, outcome: reason });
            }
        }
    }
    State::Absent(searched)
}

fn open(path: &std::path::Path) -> Result<Environment, String> {
    // The binding panics where a library is there but is not what it claims to be.
    let opened = std::panic::catch_unwind(|| {
        let builder = ort::init_from(path).map_err(|err| err.to_string())?;
        builder.with_name("touch2touch").with_telemetry(false).build().map_err(|err| err.to_string())
    });
    opened.unwrap_or_else(|_| Err("it is not a usable ONNX Runtime".into()))
}

/// The library of ONNX Runtime in use, loaded on the first call, or all the places that were searched in vain.
pub(in crate::infer) fn library() -> Result<Library, Vec<Searched>> {
    match &*state() {
        State::Loaded { library, .. } => Ok(library.clone()),
        State::Absent(searched) => Err(searched.clone()),
        State::NotSearched => Err(Vec::new()),
    }
}

pub(super) struct OnnxRuntimeSession {
    session: OrtSession,
}

/// A graph in memory, on the processor or on a provider; what the provider does not know stays on the processor.
pub(super) fn load(bytes: &[u8], provider: Option<Provider>) -> Result<OnnxRuntimeSession, String> {
    let environment = match &*state() {
        State::Loaded { environment, .. } => environment.clone(),
        _ => return Err("its library is not loaded".into()),
    };
    let build = || -> ort::Result<OrtSession> {
        // Spinning threads would burn the cores that the window needs.
        let builder = OrtSession::builder(&environment)?
            .with_intra_threads(threads())?
            .with_intra_op_spinning(false)?
            // Its errors come back as results; standard error is for our own words.
            .with_log_level(ort::logging::LogLevel::Fatal)?;
        let mut builder = match provider {
            Some(provider) => builder.with_execution_providers([dispatch(provider).error_on_failure()])?,
            None => builder,
        };
        builder.commit_from_memory(bytes)
    };
    Ok(OnnxRuntimeSession { session: build().map_err(|err| err.to_string())? })
}

/// The provider as the binding wants it.
fn dispatch(provider: Provider) -> ExecutionProviderDispatch {
    match provider {
        // Not in TF32: 32 bits are 32 bits.
        Provider::Cuda => ep::CUDA::default().with_tf32(false).build(),
        Provider::TensorRt => ep::TensorRT::default().build(),
        Provider::MiGraphX => ep::MIGraphX::default().build(),
        Provider::DirectMl => ep::DirectML::default().build(),
        Provider::CoreMl => ep::CoreML::default().build(),
        Provider::OpenVino => ep::OpenVINO::default().with_device_type("CPU").with_num_threads(threads()).build(),
        Provider::WebGpu => ep::WebGPU::default().build(),
    }
}

/// The library in use was built with the provider.
fn is_in_the_library(provider: Provider) -> bool {
    let found = match provider {
        Provider::Cuda => ep::CUDA::is_available(),
        Provider::TensorRt => ep::TensorRT::is_available(),
        Provider::MiGraphX => ep::MIGraphX::is_available(),
        Provider::DirectMl => ep::DirectML::is_available(),
        Provider::CoreMl => ep::CoreML::is_available(),
        Provider::OpenVino => ep::OpenVINO::is_available(),
        Provider::WebGpu => ep::WebGPU::is_available(),
    };
    found.unwrap_or(false)
}

/// Starts a provider with a graph of one operator, once in a program's life.
pub(in crate::infer) fn try_provider(provider: Provider) -> Result<(), NoProvider> {
    /// One operator, `y = max(x, 0)`: `onnx.helper.make_node("Relu", ["x"], ["y"])` in opset 17.
    const GRAPH: &[u8] = include_bytes!("probe.onnx");
    static TRIED: Mutex<BTreeMap<Provider, Result<(), NoProvider>>> = Mutex::new(BTreeMap::new());
    // A library that is not loaded may yet be: nothing is kept of that.
    if library().is_err() {
        return Err(NoProvider::NotInTheLibrary(provider));
    }
    let mut tried = TRIED.lock().unwrap_or_else(PoisonError::into_inner);
    let attempt = || {
        if !is_in_the_library(provider) {
            return Err(NoProvider::NotInTheLibrary(provider));
        }
        let x = Tensor::filled(vec![1, 4], -1.0);
        let run = load(GRAPH, Some(provider)).and_then(|mut session| session.run(&[("x", Input::F32(&x))], "y"));
        let said = match run {
            Ok(y) if y.data() == [0.0; 4] => return Ok(()),
            Ok(_) => "it computes wrong numbers".to_owned(),
            // On one line: the library's words may go over many, with paths of its own source.
            Err(reason) => reason.split_whitespace().collect::<Vec<_>>().join(" "),
        };
        Err(NoProvider::DoesNotStart { provider, said })
    };
    tried.entry(provider).or_insert_with(attempt).clone()
}

impl Session for OnnxRuntimeSession {
    fn run(&mut self, inputs: &[(&str, Input<'_>)], output: &str) -> Result<Tensor, String> {
        let mut values: Vec<(std::borrow::Cow<'_, str>, SessionInputValue<'_>)> = Vec::with_capacity(inputs.len());
        for &(name, input) in inputs {
            let value = match input {
                Input::F32(t) => {
                    TensorRef::from_array_view((t.shape(), t.data())).map_err(|err| err.to_string())?.into()
                }
                Input::I64(numbers) => {
                    TensorRef::from_array_view(([numbers.len()], numbers)).map_err(|err| err.to_string())?.into()
                }
            };
            values.push((name.into(), value));
        }
        let outputs = self.session.run(values).map_err(|err| err.to_string())?;
        let value = outputs.get(output).ok_or_else(|| format!("no output `{output}` came back"))?;
        let (shape, data) = value.try_extract_tensor::<f32>().map_err(|err| err.to_string())?;
        let shape = shape.iter().map(|&d| usize::try_from(d).unwrap_or(0)).collect();
        Tensor::new(shape, data.to_vec()).ok_or_else(|| format!("`{output}` is malformed"))
    }
}
