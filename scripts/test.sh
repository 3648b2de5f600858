#!/usr/bin/env bash
# Sets up and runs all checks and tests; stops at the first check that fails, but runs all tests.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/environment.sh
. "$root/scripts/environment.sh"
bash "$root/scripts/setup.sh"
cd "$root"

cargo fmt --all --check
bash scripts/check_layers.sh
cargo clippy --workspace --all-targets --locked -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked
bash scripts/book.sh
cargo test --workspace --locked --no-fail-fast
