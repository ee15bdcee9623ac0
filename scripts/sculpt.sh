#!/usr/bin/env bash
# Sculpts: in a window where there is a display, on the processor where there is no graphics unit. Without a display it sculpts the bunny of
# assets/scenes/bunny_carve.ron by itself and writes the results to out/bunny_carve.
# Arguments go to the example that runs: bash scripts/sculpt.sh --scene assets/scenes/bunny_carve.ron
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# has_display: whether an X server answers to DISPLAY (a Wayland desktop has one too, as XWayland).
has_display() {
    local name=${DISPLAY:-}
    case $name in
    "") return 1 ;;
    :*) name=${name#:} && [ -S "/tmp/.X11-unix/X${name%%.*}" ] ;;
    *) return 0 ;;
    esac
}

if has_display; then
    bash scripts/install.sh --window
    exec cargo demo sculpt -- "$@"
fi

echo "No display: sculpting without a window."
bash scripts/install.sh --window
out=out/bunny_carve
cargo demo headless -- assets/scenes/bunny_carve.ron --out "$out" "$@"

echo
echo "Results in $PWD/$out:"
describe() { [ ! -e "$out/$1" ] || printf '  %-15s %s\n' "$1" "$2"; }
compgen -G "$out/frame_*.png" >/dev/null && printf '  %-15s %s\n' "frame_*.png" "pictures of the run"
describe surface.stl "the surface at the end, watertight, in mm: for any mesh viewer or slicer"
describe particles.ply "the clay's particles at the end, for point viewers"
describe metrics.csv "one row per frame: time, energies, volume, tool forces, steps, wall time"
describe summary.json "the run in one page: engine, counts, timings, health"
