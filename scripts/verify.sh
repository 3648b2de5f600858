#!/usr/bin/env bash
# Runs the examples and writes docs/verification.md with its pictures from the results.
# Usage: scripts/verify.sh [--quick] [--study] [--reuse] [--only SECTION ..]
#   --quick   only examples of a few seconds; the others keep their last numbers
#   --study   the long scenes of configs/study too; without it they keep their last numbers
#   --reuse   do not run a scene again whose file and program are as they were
#   --only    only these sections, by the names in scripts/verification/cases.py
# It ends with exit code 1 where a number is outside its tolerance and no note says why.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/environment.sh
. "$root/scripts/environment.sh"
bash "$root/scripts/setup.sh"
cargo build --release --locked --quiet --manifest-path "$root/Cargo.toml"
exec "$root/.venv/bin/python" "$root/scripts/verify.py" \
    "${CARGO_TARGET_DIR:-$root/target}/release/mpm-petsc" "$@"
