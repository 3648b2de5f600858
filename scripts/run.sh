#!/usr/bin/env bash
# Sets up, builds and runs a scene.
# Usage: scripts/run.sh SCENE [-n RANKS] [options of mpm-petsc]     two ranks unless told otherwise
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/environment.sh
. "$root/scripts/environment.sh"

usage() {
    sed -n '2,3s/^# //p' "${BASH_SOURCE[0]}" >&2
    exit 2
}

[ $# -ge 1 ] || usage
scene="$1"
shift
ranks=2
options=()
while [ $# -gt 0 ]; do
    case "$1" in
    -n)
        [[ "${2:-}" =~ ^[1-9][0-9]*$ ]] || usage
        ranks="$2"
        shift 2
        ;;
    --)
        options+=("$@")
        break
        ;;
    *)
        options+=("$1")
        shift
        ;;
    esac
done

bash "$root/scripts/setup.sh" build
cargo build --release --locked --quiet --manifest-path "$root/Cargo.toml"
program=("${CARGO_TARGET_DIR:-$root/target}/release/mpm-petsc" "$scene" "${options[@]}")
if [ "$ranks" -eq 1 ]; then
    exec "${program[@]}"
fi
exec mpirun --quiet -n "$ranks" "${program[@]}"
