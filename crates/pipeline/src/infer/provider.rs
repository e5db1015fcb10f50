//! Execution providers: hardware, or a library for it, that ONNX Runtime runs graphs on in the place of its own code for
//! the processor.

use serde::{Deserialize, Serialize};

/// An execution provider of ONNX Runtime, the one that is preferred first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Provider {
    /// Nvidia's GPUs.
    Cuda,
    /// Nvidia's GPUs, each graph compiled for the card first, for minutes.
    TensorRt,
    /// AMD's GPUs.
    MiGraphX,
    /// Any GPU of a Windows machine.
    DirectMl,
    /// Apple's GPUs and neural engines.
    CoreMl,
    /// Intel's processors and GPUs.
    OpenVino,
    /// Any GPU with Vulkan, Metal or Direct3D 12.
    WebGpu,
}

/// Beginning of the engines' names.
const ON: &str = "ONNX Runtime on ";

impl Provider {
    /// Key in files, on the command line and in Python.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Name for people.
    pub fn name(self) -> &'static str {
        self.engine_name().trim_start_matches(ON)
    }

    /// Name of the engine that it makes of ONNX Runtime.
    pub(super) fn engine_name(self) -> &'static str {
        match self {
            Self::Cuda => "ONNX Runtime on CUDA",
            Self::TensorRt => "ONNX Runtime on TensorRT",
            Self::MiGraphX => "ONNX Runtime on MIGraphX",
            Self::DirectMl => "ONNX Runtime on DirectML",
            Self::CoreMl => "ONNX Runtime on Core ML",
            Self::OpenVino => "ONNX Runtime on OpenVINO",
            Self::WebGpu => "ONNX Runtime on WebGPU",
        }
    }

    /// Memory of its own: batches are run at once there, and no limit of the process counts it.
    pub(crate) fn has_own_memory(self) -> bool {
        // OpenVINO's device is the processor unless a GPU is named, which nothing here does.
        self != Self::OpenVino
    }

    /// Largest difference from the processor's outputs that its own may have, as a share of their largest value.
    pub(crate) fn tolerance(self) -> f32 {
        match self {
            // Half precision inside, whatever the graph says.
            Self::CoreMl => 2e-2,
            _ => 1e-3,
        }
    }

    /// The system that a program of this build runs on can have it.
    pub fn is_possible_here(self) -> bool {
        match self {
            Self::DirectMl => cfg!(windows),
            Self::CoreMl => cfg!(target_os = "macos"),
            Self::WebGpu => true,
            Self::MiGraphX => cfg!(target_os = "linux"),
            Self::Cuda | Self::TensorRt | Self::OpenVino => cfg!(any(windows, target_os = "linux")),
        }
    }

    /// Everything that has to be there besides ONNX Runtime's library, in a sentence.
    pub(crate) fn needs(self) -> &'static str {
        match self {
            Self::Cuda => {
                "it needs Nvidia's driver, CUDA 13 and cuDNN 9 (`pip install nvidia-cuda-runtime nvidia-cublas \
                 nvidia-cufft nvidia-curand nvidia-cuda-nvrtc nvidia-cudnn-cu13`, their lib folders in LD_LIBRARY_PATH)"
            }
            Self::TensorRt => "it needs what CUDA needs, and TensorRT 10 (`pip install tensorrt`)",
            Self::MiGraphX => "it needs ROCm and MIGraphX of AMD's package source",
            Self::DirectMl => "it needs Windows 10 or newer and a driver for Direct3D 12",
            Self::CoreMl => "it needs macOS on an Apple processor",
            Self::OpenVino => "its library brings all it needs",
            Self::WebGpu => "it needs a GPU with a driver for Vulkan, Metal or Direct3D 12",
        }
    }

    /// The package of Python's index whose library has it.
    fn package(self) -> Option<&'static str> {
        match self {
            Self::Cuda | Self::TensorRt => Some("onnxruntime-gpu"),
            Self::DirectMl => Some("onnxruntime-directml"),
            Self::CoreMl => Some("onnxruntime"),
            Self::OpenVino => Some("onnxruntime-openvino"),
            Self::WebGpu => Some("onnxruntime-webgpu"),
            Self::MiGraphX => None,
        }
    }

    /// The way to a library with it, in a sentence.
    pub(super) fn way_to(self) -> String {
        let needs = self.needs();
        match self.package() {
            _ if !self.is_possible_here() => format!("there is none for this system; {needs}"),
            Some(package) => format!("install one that has it with `pip install {package}`; {needs}"),
            None => format!("set ORT_DYLIB_PATH to a library that has it; {needs}"),
        }
    }
}
