//! Devices of execution providers, as their makers' own tools tell of them.

use std::process::Command;

use crate::infer::engine::Provider;

/// Name and memory of the device that a provider runs on; `None` where no tool tells.
pub(super) fn describe(provider: Provider) -> Option<String> {
    match provider {
        Provider::Cuda | Provider::TensorRt => {
            let words = ["--query-gpu=name,memory.total,memory.free", "--format=csv,noheader,nounits", "--id=0"];
            let output = Command::new("nvidia-smi").args(words).output().ok()?;
            output.status.success().then(|| nvidia(&String::from_utf8_lossy(&output.stdout)))?
        }
        Provider::OpenVino => Some("the processor".into()),
        Provider::CoreMl => Some("Apple's GPU and neural engine, in half precision".into()),
        Provider::MiGraphX | Provider::DirectMl | Provider::WebGpu => None,
    }
}

/// `name, total MiB, free MiB` in words.
fn nvidia(line: &str) -> Option<String> {
    let mut parts = line.trim().rsplitn(3, ',').map(str::trim);
    let free: f64 = parts.next()?.parse().ok()?;
    let total: f64 = parts.next()?.parse().ok()?;
    Some(format!("{}, {:.1} GiB of which {:.1} are free", parts.next()?, total / 1024.0, free / 1024.0))
}
