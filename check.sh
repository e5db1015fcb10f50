#!/usr/bin/env bash
# Passes the tests: what CI runs, with all set-up of its own. `./check.sh --all` adds what need not be tried each time: the
# documentation of the code, the command line without windows and model engines, the science with checked arithmetic, the
# wheel. On Debian and Ubuntu it installs a software Vulkan driver and the window libraries (asks for sudo if need be);
# a missing GPU, ONNX Runtime or window is then a failure, not a skip. Tests on reference data that is not part of the
# repository run, and are demanded, where that data lies in ../shared (or TOUCH2TOUCH_SHARED); what is not tried is said.
set -euo pipefail
cd "$(dirname "$0")"
step() { printf '\n== %s (%ss)\n' "$*" "$SECONDS"; }
# One set of features and the studio's profile for all: each dependency is built once.
whole=(--locked --release --workspace --features ui-test)
built="${CARGO_TARGET_DIR:-target}/release"
[[ $built = /* ]] || built="$PWD/$built"

step "packages"
. ./setup.sh
need_packages test

step "format"
cargo fmt --all --check

step "lints"
cargo clippy "${whole[@]}" --all-targets -- -D warnings

step "build: programs, tests, the Python package"
cargo test "${whole[@]}" --no-run
cargo build "${whole[@]}"

step "the Python package in an environment of its own"
python=target/python-venv/bin/python
[ -x "$python" ] || python3 -m venv target/python-venv
"$python" -m pip install --quiet numpy matplotlib pytest mypy onnxruntime==1.31.1 pyarrow duckdb pandas polars "ray[data]"
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')
rm -rf "$site/touch2touch"
cp -r python/touch2touch "$site/"
if [ -e "$built/libtouch2touch_python.dylib" ]; then library=dylib; else library=so; fi
cp "$built/libtouch2touch_python.$library" "$site/touch2touch/_native.abi3.so"

step "the ONNX Runtime library, plain and with a provider"
# Both packages put it into the same folder, so that the one with a provider has an environment of its own.
library() { "$1" -c 'import sysconfig; print(sysconfig.get_path("platlib") + "/onnxruntime/capi")'; }
ORT_DYLIB_PATH=$(library "$PWD/$python")
export ORT_DYLIB_PATH
if [ "$(uname -sm)" = "Linux x86_64" ]; then
  openvino=target/openvino-venv/bin/python
  [ -x "$openvino" ] || python3 -m venv target/openvino-venv
  "$openvino" -m pip install --quiet onnxruntime-openvino==1.24.1
  TOUCH2TOUCH_OPENVINO=$(library "$PWD/$openvino")
  export TOUCH2TOUCH_OPENVINO
fi

step "tests"
if [ -d "${TOUCH2TOUCH_SHARED:-../shared}" ]; then
  export REQUIRE_SHARED=1
else
  printf 'NOT TRIED: tests on the reference data, which is not in %s\n' "${TOUCH2TOUCH_SHARED:-../shared}"
fi
export REQUIRE_GPU=1 REQUIRE_ORT=1 REQUIRE_PYTHON=1 TOUCH2TOUCH_PYTHON="$PWD/$python"
if [ -z "${VK_DRIVER_FILES:-}" ]; then
  # One named driver for every machine: pictures and timings of the tests then mean the same everywhere.
  driver=$(find /usr/share/vulkan/icd.d -name 'lvp_icd*.json' 2>/dev/null | head -n 1)
  [ -z "$driver" ] || export VK_DRIVER_FILES="$driver"
fi
# Each test's time is printed beside it: the switch for that asks for the environment variable, which only the tests get.
timed=(--config 'target."cfg(all())".runner = ["env", "RUSTC_BOOTSTRAP=1"]')
cargo test "${whole[@]}" --lib --bins --tests "${timed[@]}" -- -Z unstable-options --report-time
cargo test "${whole[@]}" --doc

step "tests of the Python package, its types"
TOUCH2TOUCH_PROGRAM="$built/touch2touch" "$python" -m pytest --quiet -p no:cacheprovider
"$python" -m mypy.stubtest touch2touch --mypy-config-file pyproject.toml

step "tables of measurements and of the study of methods"
python3 -m unittest --quiet training.test_study_tables

if [ "${1:-}" = --all ]; then
  step "documentation of the code"
  RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps --document-private-items --features ui-test
  step "the command line without windows and model engines"
  cargo clippy --locked --no-default-features -- -D warnings
  step "the science with checked arithmetic"
  cargo test --locked -p touch2touch-core -p touch2touch-tuning
  step "the wheel in a fresh environment"
  "$python" -m pip install --quiet maturin
  rm -rf target/wheels
  "$python" -m maturin build --locked --release --interpreter "$python" --out target/wheels
  python3 -m venv --clear target/wheel-venv
  target/wheel-venv/bin/python -m pip install --quiet target/wheels/*.whl
  target/wheel-venv/bin/python -c 'import touch2touch; print(touch2touch.__version__)'
fi

step "all passed"
