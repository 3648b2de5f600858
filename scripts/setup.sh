#!/usr/bin/env bash
# Installs what building, running and testing need on Debian 12: only what is missing, so that a second call does nothing.
# Usage: scripts/setup.sh [build]     with "build" only what building and running need, without the Python readers
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/environment.sh
. "$root/scripts/environment.sh"

build_packages=(
    build-essential pkgconf libclang-dev ca-certificates
    libopenmpi-dev openmpi-bin libpetsc-real-dev libhdf5-openmpi-dev libmetis-dev
    libopenblas0-serial # several times faster than the reference BLAS that PETSc comes with
)
# The Python environment, and what VTK needs to draw without a display.
reader_packages=(python3 python3-venv libgl1 libegl1 libegl-mesa0 libgl1-mesa-dri libxrender1)

# What the tests of the report open it with.
test_packages=(chromium)

fail() {
    echo "setup: $*" >&2
    exit 1
}

install_missing() {
    command -v dpkg-query >/dev/null || fail "this is not a Debian system; needed are the packages: $*"
    local missing=() package
    for package in "$@"; do
        if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
            missing+=("$package")
        fi
    done
    [ ${#missing[@]} -eq 0 ] && return
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "only root can install: ${missing[*]}"
        as_root=(sudo)
    fi
    echo "setup: installing ${missing[*]}"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq </dev/null
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}" </dev/null
}

check_rust() {
    local needed found
    needed="$(sed -n 's/^rust-version = "\(.*\)"/\1/p' "$root/Cargo.toml" | head -n 1)"
    local advice="install it with rustup (https://rustup.rs), for example: rustup toolchain install stable"
    command -v cargo >/dev/null || fail "Rust $needed or newer is missing; $advice"
    found="$(cd "$root" && cargo --version | cut -d ' ' -f 2)"
    if [ "$(printf '%s\n' "$needed" "$found" | sort -V | head -n 1)" != "$needed" ]; then
        fail "Rust $found is too old, $needed or newer is needed; $advice"
    fi
}

make_python_environment() {
    local python=/usr/bin/python3 place="$root/.venv" wanted
    wanted="$("$python" --version) $(sha256sum <"$root/scripts/requirements.txt")"
    if [ -x "$place/bin/python" ] && [ "$(cat "$place/complete" 2>/dev/null)" = "$wanted" ]; then
        return
    fi
    echo "setup: installing the Python packages of scripts/requirements.txt into .venv"
    rm -rf "$place"
    "$python" -m venv "$place"
    "$place/bin/python" -m pip install --quiet --disable-pip-version-check -r "$root/scripts/requirements.txt" </dev/null
    # Written last, so that an installation that was cut short is made anew.
    printf '%s\n' "$wanted" >"$place/complete"
}

case "${1:-all}" in
build)
    install_missing "${build_packages[@]}"
    check_rust
    ;;
all)
    install_missing "${build_packages[@]}" "${reader_packages[@]}" "${test_packages[@]}"
    check_rust
    make_python_environment
    ;;
*) fail "unknown argument $1; usage: scripts/setup.sh [build]" ;;
esac
