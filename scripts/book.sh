#!/usr/bin/env bash
# Builds the documentation as a book of web pages, target/book/docs/index.html, and checks the links in it.
# mdBook and its preprocessor for formulas are installed under target/tools the first time (a few minutes).
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"

mdbook_version=0.5.4
katex_version=0.10.0
tools="$root/target/tools"
export PATH="$tools/bin:$PATH"

install_tool() {
    local name="$1" version="$2"
    shift 2
    if ! cargo install --list --root "$tools" 2>/dev/null | grep -q "^$name v$version:"; then
        echo "book: installing $name $version"
        cargo install --quiet --locked --root "$tools" --version "$version" "$@" "$name" </dev/null
    fi
}
install_tool mdbook "$mdbook_version" --no-default-features --features search
install_tool mdbook-katex "$katex_version"

book="$root/target/book"
rm -rf "$book"
mkdir -p "$book"
MDBOOK_LOG=error RUST_LOG=error mdbook build docs
# What the pages link to outside docs.
cp -r README.md LICENSE-MIT LICENSE-APACHE configs "$book/"
mkdir -p "$book/scripts" "$book/tests"
cp -r scripts/verification "$book/scripts/"
cp -r tests/reference "$book/tests/"
# mdBook calls the page of a README index, but leaves the links to it.
cp "$book/docs/decisions/index.html" "$book/docs/decisions/README.html"
python3 scripts/check_book.py "$book/docs"
echo "book: $book/docs/index.html"
