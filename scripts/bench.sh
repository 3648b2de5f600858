#!/usr/bin/env bash
# Runs scenes several times and prints what they take.
# Usage: scripts/bench.sh [-r REPEATS] [SCENE:RANKS ..]
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/environment.sh
. "$root/scripts/environment.sh"
repeats=5
if [ "${1:-}" = -r ]; then
    repeats="${2:?number of repeats}"
    shift 2
fi
if [ $# -eq 0 ]; then
    set -- "$root/configs/curved_cantilever_1m.yaml:2" "$root/configs/shear_layer_39.yaml:1"
fi
bash "$root/scripts/setup.sh"
cargo build --release --locked --quiet --manifest-path "$root/Cargo.toml"
exec "$root/.venv/bin/python" "$root/scripts/measure_runs.py" \
    "${CARGO_TARGET_DIR:-$root/target}/release/mpm-petsc" "$repeats" "$@"
