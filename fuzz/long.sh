#!/usr/bin/env bash
# The long form of all random tests. The argument is the number of inputs for each, by default a million.
set -euo pipefail
cd "$(dirname "$0")/.."
export SDFC_FUZZ=${1:-1000000}
cargo test --release --locked -p sdfc-trials -- --nocapture --test-threads 1
cargo test --release --locked -p sdfc-runtime --test engines -- --nocapture programs:: damage::
