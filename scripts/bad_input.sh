#!/usr/bin/env bash
# Gives the headless example bad input of every kind. Each must end with exit code 2, one line that names the fault, and nothing written.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo build --quiet --no-default-features --example headless
headless() { "${CARGO_TARGET_DIR:-target}/debug/examples/headless" "$@"; }

# scene NAME TEXT: writes a scene file. mesh NAME FILE: a scene of one mesh.
scene() { printf '%s\n' "$2" >"$work/$1.ron"; }
mesh() { scene "$1" "(clay: [Mesh(path: \"$2\", height: 0.03)], cell_width: 0.003)"; }
box='clay: [Box(size: (0.02, 0.02, 0.02))]'

# refused NAME PATTERN [OUT]: the scene is refused with a line that holds the pattern.
refused() {
    local out=${3:-$work/out-$1} status=0 lines
    headless "$work/$1.ron" --out "$out" >"$work/stdout" 2>"$work/stderr" || status=$?
    lines=$(wc -l <"$work/stderr")
    if [ "$status" -ne 2 ] || [ "$lines" -ne 1 ] || ! grep -q -- "$2" "$work/stderr" || [ -e "$work/out-$1" ]; then
        printf 'FAILED %s: exit code %s, %s lines, expected 2, 1 and "%s":\n' "$1" "$status" "$lines" "$2"
        cat "$work/stderr"
        return 1
    fi
    printf 'ok %-16s %s\n' "$1" "$(sed "s|$work/||g" "$work/stderr")"
}

bunny=$PWD/assets/meshes/bunny.obj
head -c 20000 "$bunny" >"$work/cut.obj" # cut within the vertices: no faces
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >"$work/index.obj"
printf 'v 0 0 zero\n' >"$work/malformed.obj"
printf 'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >"$work/nan.obj"
printf 'solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0' >"$work/cut.stl"
head -c 100 /dev/zero >"$work/binary.stl"
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n' >"$work/cut.ply"
printf 'ply\nformat sideways 1.0\nend_header\n' >"$work/malformed.ply"

printf 'glTF\002\000\000\000\377\000\000\000' >"$work/cut.glb"
printf '{"asset": {"version": "2.0"},\n"meshes": 3}' >"$work/malformed.gltf"
# gltf NAME EXTENSION MODE: a mesh of one primitive.
gltf() {
    printf '{"asset": {"version": "2.0"}, "extensionsRequired": [%s], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {}, "mode": %s}]}]}' \
        "$2" "$3" >"$work/$1.gltf"
}
gltf draco '"KHR_draco_mesh_compression"' 4
gltf points '' 0

# clay NAME TEXT: a clay file, and a scene of it.
clay() {
    printf '%s\n' "$2" >"$work/$1.clay.ron"
    scene "$1" "($box, cell_width: 0.005, duration: 0.01, material: File(\"$1.clay.ron\"))"
}

refused no_such_file "no_such_file.ron"
mesh no_mesh no_such.obj && refused no_mesh "no_such.obj"
mesh cut_obj cut.obj && refused cut_obj "cut.obj"
mesh bad_index index.obj && refused bad_index "index.obj"
mesh malformed_obj malformed.obj && refused malformed_obj "malformed.obj"
mesh nan_mesh nan.obj && refused nan_mesh "nan.obj"
mesh cut_stl cut.stl && refused cut_stl "cut.stl"
mesh empty_stl binary.stl && refused empty_stl "binary.stl"
mesh cut_ply cut.ply && refused cut_ply "cut.ply"
mesh malformed_ply malformed.ply && refused malformed_ply "malformed.ply"
mesh cut_glb cut.glb && refused cut_glb "cut.glb.*cut short"
mesh malformed_gltf malformed.gltf && refused malformed_gltf "malformed.gltf:2:"
mesh draco draco.gltf && refused draco "draco.gltf.*compressed by KHR_draco"
mesh points points.gltf && refused points "points.gltf.*points"
scene surface "($box, cell_width: 0.005, outputs: (surface: \"x.fbx\"))" && refused surface "surface.ron.*x.fbx.*.3mf"
scene export "($box, cell_width: 0.005, outputs: (export: (simplify: -1)))" && refused export "export.ron.*simplify = -1"
scene thin "(clay: [Box(size: (0.02, 0.0002, 0.02))], cell_width: 0.01, jitter: 0)" && refused thin "thin.ron"
scene absurd "($box, cell_width: 0.0000005)" && refused absurd "iB"
scene modulus "($box, cell_width: 0.002, material: Values(density: 1700, young_modulus: -1, poisson_ratio: 0.4, yield_stress: 8000))" && refused modulus "young_modulus"
scene poisson "($box, cell_width: 0.002, material: Values(density: 1700, young_modulus: 1e5, poisson_ratio: 0.5, yield_stress: 8000))" && refused poisson "poisson_ratio"
scene time_step "($box, cell_width: 0.002, time_step: 0)" && refused time_step "time_step"
scene unknown "($box,
  cell_width: 0.002, colour: 3)" && refused unknown "unknown.ron:2.*colour"
scene fine "($box, cell_width: 0.005, duration: 0.01)" && refused fine "/dev/null/x" /dev/null/x

scene no_clay "($box, cell_width: 0.005, material: File(\"no_such.clay.ron\"))" && refused no_clay "no_clay.ron: material.*no_such.clay.ron"
clay bad_unit "(
  density: \"3 kPa\")" && refused bad_unit "bad_unit.clay.ron:2:3: density.*kg/m^3"
clay bad_value "(yield_stress: \"-3 kPa\")" && refused bad_value "bad_value.clay.ron:1:2: yield_stress"
clay no_base "(extends: \"no_such.clay.ron\")" && refused no_base "no_base.clay.ron:1:2: extends.*no_such.clay.ron"
clay circle "(extends: \"circle.clay.ron\")" && refused circle "circle.clay.ron:1:2: extends.*circle"
clay bad_law "(law: Melted)" && refused bad_law "bad_law.clay.ron:1:.*Melted"

# warned NAME PATTERN: the scene runs, with a warning that holds the pattern.
warned() {
    headless "$work/$1.ron" --out "$work/out-$1" >/dev/null 2>"$work/stderr"
    grep -q "warning: $2" "$work/stderr" || { echo "FAILED $1: no warning of $2"; cat "$work/stderr"; exit 1; }
    echo "ok $1 works: $(sed "s|$work/||g" "$work/stderr")"
}

# An unknown key of a clay file is a warning, and so is an open mesh.
clay unknown_key "(
  yeild_stress: \"9 kPa\")" && warned unknown_key ".*unknown_key.clay.ron:2:3: .*yield_stress"
grep -v '^f 1 ' "$bunny" | head -n -20 >"$work/open.obj"
scene open "(clay: [Mesh(path: \"open.obj\", height: 0.03)], cell_width: 0.003, duration: 0.01)"
warned open ".*open"
