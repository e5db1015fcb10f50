//! Packages of Python's index that have a library of ONNX Runtime inside: which providers each has, for which systems, pinned.

use std::path::{Path, PathBuf};

use super::provider::Provider;
use crate::io::folders;

/// A package of Python's index with a library of ONNX Runtime inside.
pub(super) struct Package {
    /// Providers that the library has; the first names its folder.
    providers: &'static [Provider],
    pub(super) name: &'static str,
    pub(super) version: &'static str,
    /// For Python 3.11; the library inside is the same for every Python.
    wheels: &'static [Wheel],
}

/// A platform's wheel.
pub(super) struct Wheel {
    os: &'static str,
    arch: &'static str,
    /// As pip names the platform.
    pub(super) platform: &'static str,
    pub(super) sha256: &'static str,
}

const fn wheel(os: &'static str, arch: &'static str, platform: &'static str, sha256: &'static str) -> Wheel {
    Wheel { os, arch, platform, sha256 }
}

const LINUX: &str = "manylinux_2_28_x86_64";
const MAC: &str = "macosx_14_0_arm64";
const WINDOWS: &str = "win_amd64";

/// Every package that can be fetched. On a Mac the first has Core ML.
const PACKAGES: [Package; 5] = [
    Package {
        providers: if cfg!(target_os = "macos") { &[Provider::CoreMl] } else { &[] },
        name: "onnxruntime",
        version: "1.31.1",
        wheels: &[
            wheel("linux", "x86_64", LINUX, "5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f"),
            wheel(
                "linux",
                "aarch64",
                "manylinux_2_28_aarch64",
                "da05378364c44d4407e463982d2bf8d5e4cfea873283757e48beeb41df97b7f3",
            ),
            wheel("macos", "aarch64", MAC, "60b6b69bfe580eab576cacc5d132a0e9cf2a37fcfd18d46dd191042b1d1ed0d7"),
            wheel("windows", "x86_64", WINDOWS, "c3d91b5de31e2fc82d71bd65b2b22bddee8b49057a3a36338e9a868e0ea90c05"),
        ],
    },
    Package {
        providers: &[Provider::Cuda, Provider::TensorRt],
        name: "onnxruntime-gpu",
        version: "1.31.1",
        wheels: &[
            wheel("linux", "x86_64", LINUX, "e26c475fe361b2015f45b4b824bd13f0bb20204e59b62814e6f0acd5f3d491a6"),
            wheel("windows", "x86_64", WINDOWS, "fd98341ba71c093153f0dcfc53eb69d57f706866fb45e94e5b0cde5d97a50dbf"),
        ],
    },
    Package {
        providers: &[Provider::OpenVino],
        name: "onnxruntime-openvino",
        version: "1.24.1",
        wheels: &[
            wheel("linux", "x86_64", LINUX, "3007c803634cc69c6d52af1dea7ce729d9bb62b9a11070fd2f959119199007a8"),
            wheel("windows", "x86_64", WINDOWS, "8042698232bf67f1f6b219c2b07728d7ae7ddff17d8524588de3675480609aef"),
        ],
    },
    Package {
        providers: &[Provider::WebGpu],
        name: "onnxruntime-webgpu",
        version: "1.27.0",
        wheels: &[
            wheel("linux", "x86_64", LINUX, "142eb8bdb803c58117bf64164d201f43180bc87229cac14b590aa4ea79e0f70b"),
            wheel("macos", "aarch64", MAC, "f39aec2f3e252dd445759065e1a7cd11f910fc87ce5de6e2edb1846ef7020034"),
            wheel("windows", "x86_64", WINDOWS, "c2de23fb6bb775f86d2eef57e3cac6f885d16289a84e6232d2e78803f84f38c5"),
        ],
    },
    Package {
        providers: &[Provider::DirectMl],
        name: "onnxruntime-directml",
        version: "1.24.4",
        wheels: &[wheel(
            "windows",
            "x86_64",
            WINDOWS,
            "96642a787e5a6f33bf043521c0f06eb1eb663f6b830e5862a2026d03f9c90543",
        )],
    },
];

impl Package {
    /// The package with a provider, or the plain one.
    pub(super) fn of(provider: Option<Provider>) -> Option<&'static Self> {
        match provider {
            None => PACKAGES.first(),
            Some(provider) => PACKAGES.iter().find(|package| package.providers.contains(&provider)),
        }
    }

    /// The wheel of the system that this program runs on.
    pub(super) fn wheel(&self) -> Option<&'static Wheel> {
        let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
        self.wheels.iter().find(|wheel| wheel.os == os && wheel.arch == arch)
    }

    /// Folder of the library, under the one of fetched libraries.
    pub(super) fn folder(&self, all: &Path) -> PathBuf {
        // The plain one was there before there were others.
        match self.providers {
            [] | [Provider::CoreMl] => all.to_owned(),
            [first, ..] => all.join(first.key()),
        }
    }
}

/// A library with the provider can be fetched for this system.
fn can_be_fetched(provider: Provider) -> bool {
    Package::of(Some(provider)).is_some_and(|package| package.wheel().is_some())
}

/// Folders of fetched libraries, those with a provider first.
#[cfg_attr(not(feature = "onnx"), allow(dead_code, reason = "only the ONNX engine looks for its library"))]
pub(super) fn fetched_folders() -> impl Iterator<Item = PathBuf> {
    let all = runtime_dir();
    let with_provider = PACKAGES.iter().rev();
    let folders = with_provider.filter_map(move |package| Some(package.folder(all.as_deref()?)));
    folders.filter(|folder| folder.is_dir())
}

/// The way to a library with a provider, in a sentence.
pub(super) fn way_to(provider: Provider) -> String {
    let needs = provider.needs();
    let key = provider.key();
    match (provider.is_possible_here(), can_be_fetched(provider)) {
        (false, _) => format!("there is none for this system; {needs}"),
        (true, true) => format!("fetch one that has it with `touch2touch runtime --fetch --provider {key}`; {needs}"),
        (true, false) => format!("set ORT_DYLIB_PATH to a library that has it; {needs}"),
    }
}

/// Folder of fetched libraries, unless another is named.
pub(super) fn runtime_dir() -> Option<PathBuf> {
    folders::program_data().map(|dir| dir.join("runtime"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use strum::IntoEnumIterator as _;

    #[test]
    fn every_pin_is_a_hash_and_every_package_has_a_folder_of_its_own() {
        let wheels = PACKAGES.iter().flat_map(|package| package.wheels);
        assert!(wheels.into_iter().all(|w| w.sha256.len() == 64 && w.sha256.bytes().all(|b| b.is_ascii_hexdigit())));
        let folders: std::collections::BTreeSet<_> = PACKAGES.iter().map(|p| p.folder(Path::new("all"))).collect();
        assert_eq!(folders.len(), PACKAGES.len());
    }

    #[test]
    fn every_provider_has_a_way_to_it() {
        for provider in Provider::iter() {
            let way = way_to(provider);
            assert!(way.contains(provider.needs()), "{way}");
            assert!(provider.is_possible_here() || !can_be_fetched(provider), "{provider:?}");
        }
    }
}
