#!/usr/bin/env bash
# Cost of a substep beside Taichi, on the same scene, in the same minutes: `benches/peers/run.sh [OUT.json]`.
# Each case runs ours, Taichi, ours again: work of others on the machine then shows as a difference between our two figures.
# core-ns = CPU time of all threads per particle and substep.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/peers.json}
mkdir -p "$(dirname "$out")"
venv=${CLAY_VENV:-.venv}
if ! "$venv/bin/python" -c 'import taichi' 2>/dev/null; then
  python3 -m venv "$venv" || { echo "error: python3-venv is needed for $venv" >&2; exit 1; }
  "$venv/bin/pip" install --quiet 'taichi==1.7.4' 'numpy<2.3'
fi
cargo build --quiet --release --no-default-features --bench substep
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
case_of() { # PARTICLES GRID
  local ours=(cargo bench --quiet --no-default-features --bench substep -- --json --particles "$1" --grid "$2")
  "${ours[@]}" | grep '^{' >>"$work/rows"
  for model in hencky simo; do
    "$venv/bin/python" benches/peers/taichi_bench.py --arch cpu --threads "$(nproc)" --particles "$1" --grid "$2" --model "$model" --json "$work/$model" >/dev/null
    cat "$work/$model" >>"$work/taichi"
  done
  "${ours[@]}" | grep '^{' >>"$work/rows"
}
case_of 104900 60
case_of 13800 60
"$venv/bin/python" - "$work" "$out" <<'PY'
import json, subprocess, sys, datetime
work, out = sys.argv[1:]
ours = [json.loads(line) for line in open(f"{work}/rows")]
decoder, text, taichi = json.JSONDecoder(), open(f"{work}/taichi").read().strip(), []
while text:
    rows, end = decoder.raw_decode(text)
    taichi += rows
    text = text[end:].strip()
rows = []
for n, g in dict.fromkeys((r["particles"], r["grid"]) for r in ours):
    mine = [r["core_ns_per_particle"] for r in ours if (r["particles"], r["grid"]) == (n, g)]
    rows += [{"tool": "bevy_clay native", "particles": n, "grid": g, "core_ns": v} for v in mine]
    for r in taichi:
        if (r["particles"], r["grid"]) == (n, g):
            v = r["cpu_ms"] / n * 1e6
            rows.append({"tool": f"{r['tool']} {r['model']}", "particles": n, "grid": g, "core_ns": v, "ours_over_it": min(mine) / v, "ok": r["ok"]})
cpu = next(line.split(":")[1].strip() for line in open("/proc/cpuinfo") if "model name" in line)
commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
json.dump({"suite": "peers", "adapter": cpu, "commit": commit, "date": str(datetime.date.today()), "rows": rows}, open(out, "w"), indent=1)
for r in rows:
    print(f"{r['particles']:7d} {r['grid']:3d}^3  {r['tool']:28s} {r['core_ns']:8.1f} core-ns" + (f"   ours / it = {r['ours_over_it']:.3f}" if "ours_over_it" in r else ""))
PY
echo "written: $out"
