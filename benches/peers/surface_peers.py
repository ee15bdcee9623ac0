#!/usr/bin/env python3
"""Peers of the surface: what others say of the exported files, and how long others take on the same data.

    python surface_peers.py DUMP ROWS.json
    python surface_peers.py --again DUMP ROWS.json

DUMP is what `validate surface --dump DUMP --json ROWS.json` wrote. The rows of this program go into ROWS.json, beside ours. Our times were measured by
that command, before the peers; those of another dump, made after them and added by `--again`, show how much the machine changed meanwhile.

trimesh judges each file: is_watertight, is_volume (also oriented), bodies, volume. It merges equal positions as it loads. lib3mf, of the 3MF consortium,
reads the 3MF files in its strict mode.
scikit-image and splashsurf make meshes: least wall time and least CPU time over all threads of 5 runs each, triangles, volume error, edges that are not of two triangles.
"""
import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import lib3mf
import numpy as np
import pysplashsurf
import trimesh
from skimage.measure import marching_cubes

RUNS = 5
# Limit of T8 in percent, as in validate.
VOLUME_OFF = 0.1


def row(case, value, unit, limit=None, bound="max", **more):
    ok = limit is None or (value <= limit if bound == "max" else value >= limit)
    return {"case": case, "value": value, "unit": unit, "limit": limit, "bound": bound, "ok": bool(ok), **more}


def judge_file(folder, file):
    """Rows of trimesh about an exported file."""
    loaded = trimesh.load(folder / file["file"])
    mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    units = file["units_per_metre"]
    off = 100 * abs(mesh.volume / units**3 / file["volume"] - 1)
    bodies = len(mesh.split(only_watertight=False))
    tool = f"trimesh {trimesh.__version__}"
    name = f"{file['file']}: "
    rows = [
        row(name + "watertight", float(mesh.is_watertight), "-", 1.0, "min", tool=tool),
        row(name + "is a volume", float(mesh.is_volume), "-", 1.0, "min", tool=tool),
        row(name + "bodies too many or too few", float(abs(bodies - file["bodies"])), "count", 0.0, tool=tool),
        row(name + "volume off", off, "%", VOLUME_OFF, tool=tool),
    ]
    if file["file"].endswith(".3mf"):
        # Up is +Y in the clay and +Z in the file: the bunny is higher than it is long.
        low, high = mesh.bounds
        glb = trimesh.load(folder / file["file"].replace(".3mf", ".glb")).to_mesh()
        up = 100 * abs((high - low)[2] / units / np.ptp(glb.bounds, axis=0)[1] - 1)
        rows.append(row(name + "height along z off that of the clay along y", up, "%", 0.1, tool=tool))
        rows += judge_3mf(folder, file)
    return rows


def judge_3mf(folder, file):
    """Rows of lib3mf's strict reader."""
    tool = f"lib3mf {version('lib3mf')}"
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(folder / file["file"]))
    objects, bad = model.GetMeshObjects(), 0
    while objects.MoveNext():
        found = objects.GetCurrentMeshObject()
        bad += not (found.IsManifoldAndOriented() and found.IsValid())
    name = f"{file['file']}, strictly read: "
    return [
        row(name + "warnings", float(reader.GetWarningCount()), "count", 0.0, tool=tool),
        row(name + "objects not manifold, oriented and valid", float(bad), "count", 0.0, tool=tool),
        row(name + "unit is not the millimetre", float(model.GetUnit() != lib3mf.ModelUnit.MilliMeter), "-", 0.0, tool=tool),
        row(name + "objects too many or too few", float(abs(objects.Count() - file["bodies"])), "count", 0.0, tool=tool),
    ]


def best(make):
    """The result of a call and the least wall and CPU time of some [ms]."""
    wall, cpu, made = np.inf, np.inf, None
    for _ in range(RUNS):
        began, began_cpu = time.perf_counter(), time.process_time()
        made = make()
        wall = min(wall, 1e3 * (time.perf_counter() - began))
        cpu = min(cpu, 1e3 * (time.process_time() - began_cpu))
    return made, wall, cpu


def odd_edges(faces):
    """Edges that are not of two triangles."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts != 2).sum())


def timed(tool, case, data, make, exact):
    (vertices, faces), ms, cpu_ms = best(make)
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    volume = abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
    return row(f"{tool}: {case}", ms, "ms", cpu_ms=cpu_ms, tool=tool, data=data, triangles=len(faces),
               volume_error_percent=100 * (volume / exact - 1), odd_edges=odd_edges(faces))


def splashsurf(points, cube, smoothing):
    """Lengths in cells; 8 particles per cell, so a particle's radius is a quarter of a cell. `cube` in radii, as the kernel of 2."""
    reconstruction = pysplashsurf.reconstruction_pipeline(
        points, particle_radius=0.25, rest_density=1000.0, smoothing_length=2.0, cube_size=cube, iso_surface_threshold=0.5,
        mesh_smoothing_iters=smoothing or None, mesh_smoothing_weights=bool(smoothing), mesh_cleanup=bool(smoothing), compute_normals=True)
    mesh = reconstruction[0] if isinstance(reconstruction, tuple) else reconstruction
    mesh = getattr(mesh, "mesh", mesh)
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles).astype(np.int64)


def peers_of(folder, ours):
    exact = {t["data"]: t["exact_volume"] for t in ours["times"]}
    points = np.load(folder / "particles.npy")
    splash = f"splashsurf {version('pysplashsurf')}"
    rows = [
        timed(splash, f"{len(points)} particles, nodes every {cube / 4:g} cells, {steps} smoothing steps", "particles",
              lambda: splashsurf(points, cube, steps), exact["particles"])
        for cube, steps in ((2.0, 0), (1.0, 0), (1.0, 25))
    ]
    skimage = f"scikit-image {version('scikit-image')}"
    for data in ("field_small", "field_large"):
        field = np.load(folder / f"{data}.npy")
        for method in ("lewiner", "lorensen"):
            rows.append(timed(skimage, f"{data}, {field.shape[0]}^3 nodes, {method}", data,
                              lambda: marching_cubes(field, 0.5, method=method)[:2], exact[data]))
    return rows


def ours_of(ours, when):
    return [
        row(f"bevy_clay: {t['case']}, {when} the peers", t["ms"], "ms", cpu_ms=t["cpu_ms"], tool="bevy_clay", data=t["data"],
            triangles=t["triangles"], volume_error_percent=100 * (t["volume"] / t["exact_volume"] - 1))
        for t in ours["times"]
    ]


def main():
    is_again = sys.argv[1] == "--again"
    folder, out = (Path(a) for a in sys.argv[-2:])
    ours = json.loads((folder / "ours.json").read_text())
    if is_again:
        rows = ours_of(ours, "after")
    else:
        rows = [r for file in ours["files"] for r in judge_file(folder, file)]
        rows += ours_of(ours, "before") + peers_of(folder, ours)
    result = json.loads(out.read_text())
    result["rows"] += rows
    result["peers"] = {"python": sys.version.split()[0], "numpy": np.__version__, "threads": ours["threads"]}
    out.write_text(json.dumps(result, indent=1) + "\n")
    for r in rows:
        more = f"{r['cpu_ms']:8.1f} CPU ms, {r['triangles']:7d} triangles, volume {r['volume_error_percent']:+.2f} %" if "cpu_ms" in r else ""
        more += f", {r['odd_edges']} odd edges" if r.get("odd_edges") else ""
        sign = "" if r["limit"] is None else ("ok" if r["ok"] else "MISS")
        print(f"{r['case']:84s} {r['value']:10.4g} {r['unit']:5s} {sign}{more}")
    return 0 if all(r["ok"] for r in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
