#!/usr/bin/env bash
# Holds the modules of src to the table of what each may use, and "unsafe" to src/petsc and src/study/tether.rs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# module: modules it may use. Errors, problems and the clock depend on nothing that could turn the order around.
table="
problem:
clock:
interrupt:
version:
console:
file:
memory:
parallel:   console
error:      problem
continuum:
material:   continuum problem
grid:       parallel problem
points:     continuum grid parallel
condition:  continuum grid points
assembly:   continuum material grid points condition parallel clock
petsc:      parallel clock console error file
solve:      continuum grid points condition assembly petsc parallel clock error interrupt
output:     parallel clock error
report:     config file
verification: continuum material points parallel
scene:      continuum grid material points condition solve verification
config:     console file scene grid material points condition solve verification problem
study:      config console error file interrupt output points problem report scene version
app:        assembly clock condition config console continuum error file grid interrupt material memory output parallel petsc points problem report scene solve verification version
main:       app clock config console error interrupt parallel scene study
lib:
"
failed=0
complain() {
    echo "check_layers: $*" >&2
    failed=1
}

for path in src/*; do
    module="$(basename "$path" .rs)"
    if ! row="$(grep -E "^$module:" <<<"$table")"; then
        complain "$path has no row in the table"
        continue
    fi
    if grep -rn 'crate::{' "$path"; then
        complain "$path: write one line per module, so that this check sees it"
    fi
    while read -r used; do
        [[ " $module ${row#*:} " == *" $used "* ]] || complain "$path may not use $used: $(grep -rnl "crate::$used" "$path" | tr '\n' ' ')"
    done < <(grep -rhoE --exclude=tests.rs '\b(crate|mpm_petsc)::[a-z_]+' "$path" | sed 's/.*:://' | sort -u)
done

if grep -rnE '\bunsafe\b *(\{|fn|impl|extern)' src --include='*.rs' | grep -vE '^src/(petsc/|study/tether\.rs:)'; then
    complain "unsafe code belongs in src/petsc, but for what ties processes together"
fi
exit "$failed"
