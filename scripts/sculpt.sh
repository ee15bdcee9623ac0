#!/usr/bin/env bash
# Sculpts the bunny with no window: runs assets/scenes/bunny_carve.ron to out/bunny_carve.
# Arguments go to the headless example: bash scripts/sculpt.sh --frames 10
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bash scripts/install.sh

out=out/bunny_carve
cargo run --quiet --no-default-features --example headless -- assets/scenes/bunny_carve.ron --out "$out" "$@"

echo
echo "Results in $PWD/$out:"
describe() { [ ! -e "$out/$1" ] || printf '  %-15s %s\n' "$1" "$2"; }
describe surface.stl "the surface at the end, watertight, in mm: for any mesh viewer or slicer"
describe particles.ply "the clay's particles at the end, for point viewers"
describe metrics.csv "one row per frame: time, energies, volume, tool forces, steps, wall time"
describe summary.json "the run in one page: engine, counts, timings, health"
