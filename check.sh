#!/usr/bin/env bash
# Passes the tests: everything that CI runs, fastest first, with all set-up of its own.
# On Debian and Ubuntu it installs a software Vulkan driver and the window libraries (asks for sudo if need be);
# a missing GPU, ONNX Runtime or window is then a failure, not a skip. Tests on reference data that is not part of the
# repository run, and are demanded, where that data lies in ../shared (or TOUCH2TOUCH_SHARED); what is not tried is said.
set -euo pipefail
cd "$(dirname "$0")"
step() { printf '\n== %s (%ss)\n' "$*" "$SECONDS"; }

step "packages"
. ./setup.sh
need_packages test

step "format"
cargo fmt --all --check

step "lints: everything, then the command line without windows and model engines"
cargo clippy --locked --workspace --features ui-test --all-targets -- -D warnings
cargo clippy --locked --no-default-features -- -D warnings

step "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps --document-private-items --features ui-test

if [ -d "${TOUCH2TOUCH_SHARED:-../shared}" ]; then
  export REQUIRE_SHARED=1
else
  printf '\nNOT TRIED: tests on the reference data, which is not in %s\n' "${TOUCH2TOUCH_SHARED:-../shared}"
fi

step "tests: the science, the job without model engines, the tuning of networks"
cargo test --locked -p touch2touch-core -p touch2touch-work -p touch2touch-tuning

step "the ONNX Runtime library, plain and with a provider, fetched by the product itself"
export ORT_DYLIB_PATH="$PWD/target/onnxruntime" TOUCH2TOUCH_OPENVINO="$PWD/target/openvino"
cargo run --locked --quiet --features ui-test -- runtime --fetch --dir "$ORT_DYLIB_PATH"
if [ "$(uname -sm)" = "Linux x86_64" ]; then
  cargo run --locked --quiet --features ui-test -- runtime --fetch --provider openvino --dir "$TOUCH2TOUCH_OPENVINO"
fi

step "the Python package: its wheel in a fresh environment"
python3 -m venv --clear target/python-venv
python=target/python-venv/bin/python
"$python" -m pip install --quiet maturin numpy pytest mypy pyarrow duckdb pandas polars "ray[data]"
"$python" -m maturin build --locked --profile dev --interpreter "$python" --out target/wheels
"$python" -m pip install --quiet --no-index --find-links target/wheels touch2touch

step "tests: files, models on both engines, GPU on a software driver, the studio by clicks and keys"
export REQUIRE_GPU=1 REQUIRE_ORT=1 REQUIRE_PYTHON=1 TOUCH2TOUCH_PYTHON="$PWD/$python"
if [ -z "${VK_DRIVER_FILES:-}" ]; then
  # One named driver for every machine: pictures and timings of the tests then mean the same everywhere.
  driver=$(find /usr/share/vulkan/icd.d -name 'lvp_icd*.json' 2>/dev/null | head -n 1)
  [ -z "$driver" ] || export VK_DRIVER_FILES="$driver"
fi
cargo test --locked -p touch2touch -p touch2touch-work -p touch2touch-bench --features ui-test

step "the Python package: tests, types"
TOUCH2TOUCH_PROGRAM="$PWD/target/debug/touch2touch" "$python" -m pytest --quiet -p no:cacheprovider
"$python" -m mypy.stubtest touch2touch --mypy-config-file pyproject.toml

step "tables of measurements and of the study of methods"
python3 -m unittest --quiet training.test_study_tables

step "all passed"
