#!/usr/bin/env bash
# What others say of our surfaces: `benches/peers/surface.sh [OUT.json] [--quick]`.
# trimesh and lib3mf judge the exported files; scikit-image and splashsurf are timed on the same particles and fields, between two runs of ours.
# OUT.json holds the rows of `validate surface` and then those of the peers. Exit code 1 if a file is not what it should be.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/surface_peers.json}
mkdir -p "$(dirname "$out")"
venv=${CLAY_VENV:-.venv}
if ! "$venv/bin/python" -c 'import trimesh, skimage, pysplashsurf, lib3mf, networkx, lxml, scipy' 2>/dev/null; then
  [ -x "$venv/bin/python" ] || python3 -m venv "$venv" || { echo "error: python3-venv is needed for $venv" >&2; exit 1; }
  "$venv/bin/pip" install --quiet 'trimesh==5.2.0' 'scikit-image==0.26.0' 'pysplashsurf==0.14.1.0' 'lib3mf==2.5.0' networkx lxml scipy
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# dump DIR ARGUMENT...
dump() {
  local folder=$1
  shift
  cargo run --quiet --release --no-default-features --bin validate -- surface --dump "$folder" "$@"
}
dump "$work/before" --json "$work/rows.json" "${@:2}"
status=0
"$venv/bin/python" benches/peers/surface_peers.py "$work/before" "$work/rows.json" || status=$?
[ "$status" -le 1 ] || exit "$status"
# Only the times of the second run are of use.
dump "$work/after" --quick --only sphere >"$work/log" || { cat "$work/log"; exit 1; }
"$venv/bin/python" benches/peers/surface_peers.py --again "$work/after" "$work/rows.json"
cp "$work/rows.json" "$out"
echo "written: $out"
exit "$status"
