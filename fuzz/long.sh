#!/usr/bin/env bash
# The long form of all campaigns: so many inputs of each, a million where nothing else is said.
set -euo pipefail
cd "$(dirname "$0")/.."
export SDFC_FUZZ=${1:-1000000}
cargo test --release --locked -p sdfc-trials -- --nocapture --test-threads 1
cargo test --release --locked -p sdfc-runtime --test engines -- --nocapture programs:: damage::
