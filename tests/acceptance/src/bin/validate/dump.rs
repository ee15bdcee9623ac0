//! Data for peers, programs in Python under benches/peers: files in every format, particles, fields, and our
//! own figures on them.

use bevy_clay::scene::prelude::{ExportFormat, write_mesh};
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::extract::{extract, extract_field};
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::mesh::Mesh;
use clay_acceptance::cases::files::{bunny, cut_block};
use clay_acceptance::cases::surface::{ball, parted_block};
use clay_acceptance::lab::Size;
use cpu_time::ProcessTime;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Nodes along an edge of the fields.
const NODES: i32 = 200;
/// Runs of which the best counts.
const RUNS: usize = 5;
/// Radius of the ball of 104,900 particles [cells].
const PARTICLE_BALL: f64 = 14.63;
/// Radius of the large ball [nodes].
const LARGE_BALL: f64 = 80.0;

/// The file of our own figures.
pub(crate) const OURS: &str = "ours.json";

/// Writes into `folder`; [`OURS`] holds our figures: `files` with the volume
/// that each should have [m^3], `times` [ms].
pub(crate) fn write(folder: &Path, size: Size) -> Result<(), String> {
    let fault = |e: std::io::Error| format!("--dump {}: {e}", folder.display());
    let mut files = vec![];
    let meshes =
        [("bunny", bunny(folder, size.pick(0.0025, 0.002, 0.001)), 1), ("cut", cut_block(), 2), ("blade", parted_block(), 2)];
    for (name, mesh, bodies) in meshes {
        for format in ExportFormat::ALL {
            let file = format!("{name}_out.{}", format.extension());
            write_mesh(&folder.join(&file), &mesh).map_err(|e| format!("--dump: {e}"))?;
            let unit = if format == ExportFormat::Glb { 1.0 } else { 1e3 };
            files.push(json!({"file": file, "volume": mesh.volume(), "bodies": bodies, "units_per_metre": unit}));
        }
    }
    let mut times = vec![];
    let domain = Domain::new(DVec3::ZERO, DVec3::splat(192.0), 1.0, Walls::default()).map_err(|e| e.to_string())?;
    let particles = ball(DVec3::new(96.13, 95.87, 96.31), PARTICLE_BALL, 0.25);
    let exact = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let positions: Vec<[f32; 3]> = particles.iter().map(|p| p.position).collect();
    write_array(&folder.join("particles.npy"), &format!("({}, 3)", positions.len()), positions.as_flattened()).map_err(fault)?;
    let count = particles.len();
    let source = SurfaceSource { domain, particles: particles.into() };
    for (tier, name) in [(Tier::Fine, "fine"), (Tier::Coarse, "coarse")] {
        let (mesh, took) = best(|| extract(&source, &SurfaceSettings::new(tier)));
        times.push(row(&format!("{count} particles, {name}"), "particles", &mesh, took, exact(PARTICLE_BALL)));
    }
    // Equation 9 of those particles, plain, on all nodes; and a ball as large as fits, by distance.
    let large = |p: Vec3| (LARGE_BALL as f32 - p.distance(Vec3::splat(99.37))) / 4.0 + 0.5;
    for (name, values, radius) in [("small", spline_sum(&positions), PARTICLE_BALL), ("large", on_nodes(large), LARGE_BALL)] {
        let file = format!("field_{name}");
        write_array(&folder.join(format!("{file}.npy")), &format!("({NODES}, {NODES}, {NODES})"), &values).map_err(fault)?;
        let (field, prepare) = best(|| Field::from_nodes([NODES as usize; 3], &values, None));
        let (mesh, took) = best(|| extract_field(&field, 0.5));
        let mut row = row(&format!("{file}, {NODES}^3 nodes"), &file, &mesh, took, exact(radius));
        row["copy_ms"] = prepare.wall.into();
        times.push(row);
    }
    let ours = json!({"files": files, "times": times, "threads": std::thread::available_parallelism().map_or(1, usize::from)});
    fs::write(folder.join(OURS), format!("{ours:#}\n")).map_err(fault)
}

fn row(case: &str, data: &str, mesh: &Mesh, times: Times, exact: f64) -> Value {
    json!({"case": case, "data": data, "ms": times.wall, "cpu_ms": times.cpu, "triangles": mesh.triangles.len(), "volume": mesh.volume(), "exact_volume": exact})
}

/// Least times of some runs [ms].
#[derive(Clone, Copy, Debug)]
struct Times {
    wall: f64,
    /// Of all threads.
    cpu: f64,
}

/// What `make` makes, and its times.
fn best<T>(make: impl Fn() -> T) -> (T, Times) {
    let timed = || {
        let (began, began_cpu) = (Instant::now(), ProcessTime::now());
        let made = make();
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        (made, Times { wall: ms(began.elapsed()), cpu: ms(began_cpu.elapsed()) })
    };
    (1..RUNS).fold(timed(), |(_, least), _| {
        let (made, again) = timed();
        (made, Times { wall: least.wall.min(again.wall), cpu: least.cpu.min(again.cpu) })
    })
}

/// Values of a function of the place on all nodes, x fastest.
fn on_nodes(value: impl Fn(Vec3) -> f32) -> Vec<f32> {
    let place = |i: i32| Vec3::new((i % NODES) as f32, (i / NODES % NODES) as f32, (i / NODES / NODES) as f32);
    (0..NODES.pow(3)).map(|i| value(place(i))).collect()
}

/// Sum of the particles' quadratic B-splines at the nodes, an eighth of a cell each.
fn spline_sum(positions: &[[f32; 3]]) -> Vec<f32> {
    let mut sums = vec![0.0; NODES.pow(3) as usize];
    for &position in positions {
        let base = position.map(|x| (x - 0.5).floor());
        let weights = [0, 1, 2].map(|axis| {
            let t = position[axis] - base[axis];
            [0.5 * (1.5 - t).powi(2), 0.75 - (t - 1.0).powi(2), 0.5 * (t - 0.5).powi(2)]
        });
        let [x, y, z] = base.map(|b| b as usize);
        let n = NODES as usize;
        for i in 0..27 {
            let [a, b, c] = [i % 3, i / 3 % 3, i / 9];
            sums[x + a + n * (y + b + n * (z + c))] += weights[0][a] * weights[1][b] * weights[2][c] / 8.0;
        }
    }
    sums
}

/// Writes an array of NumPy's format 1.0: little-endian f32, the last index fastest.
fn write_array(path: &Path, shape: &str, values: &[f32]) -> std::io::Result<()> {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version and length take 10 bytes; data begin at a multiple of 64.
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    header.extend(std::iter::repeat_n(' ', length - header.len() - 1));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    fs::write(path, bytes)
}
