//! A device, surfaces on it, and what comes back from them. Shared by `validate` and the tests.

use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::sim::gpu::{GpuDevice, GpuError};
use bevy_clay::sim::params::Domain;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::gpu::{GpuSurface, MeshTarget, StatusReadback, SurfaceKernels, SurfaceRoom, SurfaceStatus, VERTEX_WORDS};
use bevy_clay::surface::grains::Grain;
use bevy_clay::surface::mesh::Mesh;
use glam::{IVec3, Vec3};
use std::collections::{HashMap, HashSet};
use std::time::{Duration, Instant};

/// A graphics device and the kernels of the surface.
pub struct Device {
    gpu: GpuDevice,
    kernels: SurfaceKernels,
}

/// One extraction: as it stands in the buffers, and as a mesh.
pub struct Output {
    /// What the passes say of it.
    pub status: SurfaceStatus,
    /// Words of vertices and indices, whole buffers.
    pub words: (Vec<u32>, Vec<u32>),
    /// The surface: vertices of each block by themselves.
    pub mesh: Mesh,
    /// The balls behind it.
    pub grains: Vec<Grain>,
    /// Of the vertices.
    pub normals: Vec<[f32; 3]>,
    numbers: Vec<u32>,
    /// What it was extracted from, where it was read back.
    pub field: Option<Field>,
}

impl Output {
    /// Whether the same is drawn, bit by bit.
    pub fn draws_as(&self, other: &Self) -> bool {
        let all = |o: &Self| (o.mesh.clone(), o.normals.clone(), o.numbers.clone(), o.grains.clone());
        all(self) == all(other)
    }

    /// The mesh with the vertices of each number made one.
    pub fn merged(&self) -> Mesh {
        let mut index = HashMap::new();
        let mut out = Mesh::default();
        let mut first = vec![];
        let merged: Vec<u32> = self
            .numbers
            .iter()
            .enumerate()
            .map(|(v, number)| {
                let next = out.positions.len() as u32;
                let at = *index.entry(*number).or_insert(next);
                if at == next {
                    out.positions.push(self.mesh.positions[v]);
                    first.push(v);
                } else {
                    let bits = |v: usize| (self.mesh.positions[v].map(f32::to_bits), self.normals[v].map(f32::to_bits));
                    assert_eq!(bits(first[at as usize]), bits(v), "place and normal of one vertex");
                }
                at
            })
            .collect();
        out.triangles = self.mesh.triangles.iter().map(|t| t.map(|v| merged[v as usize])).collect();
        out
    }
}

/// What tells a mesh from another, whose triangles may be in any order: counts, or triangles whose centres
/// are not within `distance` \[m\] of one of the other's.
pub fn difference(ours: &Mesh, theirs: &Mesh, distance: f32) -> Option<String> {
    let counts = |m: &Mesh| (m.positions.len(), m.triangles.len());
    if counts(ours) != counts(theirs) {
        return Some(format!("{:?} vertices and triangles, not {:?}", counts(ours), counts(theirs)));
    }
    // Centres by cells of a grid; each of theirs stands in all cells within the distance.
    let unit = 8.0 * distance;
    let key = |p: Vec3| (p / unit).round().as_ivec3();
    let centre = |m: &Mesh, t: &[u32; 3]| t.iter().map(|&v| Vec3::from_array(m.positions[v as usize])).sum::<Vec3>() / 3.0;
    let mut places: HashSet<IVec3> = HashSet::new();
    for t in &theirs.triangles {
        let corner = |i: i32| IVec3::new(i & 1, i >> 1 & 1, i >> 2).as_vec3() * 2.0 - 1.0;
        places.extend((0..8).map(|i| key(centre(theirs, t) + corner(i) * distance)));
    }
    let lost = ours.triangles.iter().filter(|t| !places.contains(&key(centre(ours, t)))).count();
    (lost > 0).then(|| format!("{lost} triangles that the other has not"))
}

/// What tells grains from others \[m\]: which particles they are, places 1e-4 cells apart, radii 1e-3. Those
/// that hardly show, with a radius of 0.02 cells, may be there or not.
pub fn grain_difference(ours: &[Grain], theirs: &[Grain], cell_width: f64) -> Option<String> {
    let cells = |length: f32| f64::from(length) / cell_width;
    let key = |all: &[Grain]| all.iter().map(|g| (g.particle, *g)).collect::<HashMap<_, _>>();
    let (a, b) = (key(ours), key(theirs));
    let has_lost = |from: &[Grain], to: &HashMap<u32, Grain>| {
        from.iter().find(|g| cells(g.radius) > 0.02 && !to.contains_key(&g.particle)).map(|g| format!("{g:?} is alone"))
    };
    let differs = |g: &&Grain| {
        b.get(&g.particle).is_some_and(|h| {
            let apart = Vec3::from_array(g.position).distance(Vec3::from_array(h.position));
            let is_seen = cells(g.radius.max(h.radius)) > 0.02;
            cells(apart) > 1e-4 || (is_seen && cells((g.radius - h.radius).abs()) > 1e-3)
        })
    };
    let order = ours.windows(2).find(|w| w[0].particle >= w[1].particle).map(|w| format!("out of order: {w:?}"));
    let other = || ours.iter().find(differs).map(|g| format!("{g:?}, not {:?}", b[&g.particle]));
    order.or_else(|| has_lost(ours, &b)).or_else(|| has_lost(theirs, &a)).or_else(other)
}

/// Where vertices and indices begin in their buffers: not at 0, as in a slab that others share.
const FIRST: (u32, u32) = (5, 6);

/// A surface at work, with a mesh of its own.
pub struct Run<'a> {
    device: &'a Device,
    surface: GpuSurface,
    readback: StatusReadback,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// Room for vertices and indices.
    pub capacity: (u32, u32),
}

impl Device {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// A device that lacks what they need.
    pub fn new(gpu: GpuDevice) -> Result<Self, GpuError> {
        let kernels = SurfaceKernels::new(&gpu.device)?;
        Ok(Self { gpu, kernels })
    }

    /// A surface of `count` particles.
    pub fn surface(&self, domain: &Domain, count: u32, settings: &SurfaceSettings) -> GpuSurface {
        GpuSurface::new(&self.kernels, domain, count, settings, SurfaceRoom::for_particles(count as usize)).expect("a surface")
    }

    /// A surface of `source` at work.
    pub fn run(&self, source: &SurfaceSource, settings: &SurfaceSettings, room: SurfaceRoom) -> Run<'_> {
        let count = source.particles.len() as u32;
        let surface = GpuSurface::new(&self.kernels, &source.domain, count, settings, room).expect("a surface");
        self.run_of(surface)
    }

    /// [`Self::run`] with grains.
    pub fn run_with_grains(&self, source: &SurfaceSource, settings: &SurfaceSettings) -> Run<'_> {
        let count = source.particles.len() as u32;
        let room = SurfaceRoom::for_particles(source.particles.len());
        let surface = |room| GpuSurface::with_grains(&self.kernels, &source.domain, count, settings, room).expect("a surface");
        let status = self.run_of(surface(room)).frame(source, false).status;
        self.run_of(surface(room.grown(&status)))
    }

    /// The device itself.
    pub fn gpu(&self) -> GpuDevice {
        self.gpu.clone()
    }

    /// Whether the device draws in software.
    pub fn is_software(&self) -> bool {
        self.gpu.is_software()
    }

    fn run_of(&self, surface: GpuSurface) -> Run<'_> {
        let capacity = (160_000, 700_000);
        let vertices = self.buffer(4 * u64::from(VERTEX_WORDS * (FIRST.0 + capacity.0)));
        let indices = self.buffer(4 * u64::from(FIRST.1 + capacity.1));
        Run { device: self, surface, readback: StatusReadback::new(&self.gpu.device), vertices, indices, capacity }
    }

    /// One frame of a clay of its own, with its fields; with as much room as it asks for.
    pub fn extract(&self, source: &SurfaceSource, settings: &SurfaceSettings) -> Output {
        let mut room = SurfaceRoom::for_particles(source.particles.len());
        let mut run = self.run(source, settings, room);
        let mut output = run.frame(source, false);
        while room.grown(&output.status) != room {
            room = room.grown(&output.status);
            run = self.run(source, settings, room);
            output = run.frame(source, false);
        }
        output.field = Some(run.field(&output.status, run.surface.field_buffers()));
        output
    }

    /// The mesh of given fields.
    pub fn extract_field(&self, surface: &mut GpuSurface, field: &Field) -> Output {
        surface.load_field(&self.gpu.queue, field);
        let vertices = self.buffer(4 * u64::from(VERTEX_WORDS) * 20_000);
        let indices = self.buffer(4 * 60_000);
        let target = MeshTarget {
            vertices: &vertices,
            vertex_first: 0,
            vertex_capacity: 20_000,
            indices: &indices,
            index_first: 0,
            index_capacity: 60_000,
        };
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        surface.encode_mesh(&self.gpu.queue, &mut encoder, &target);
        self.gpu.queue.submit([encoder.finish()]);
        let status = self.status(surface);
        output(status, self.read(&vertices), self.read(&indices))
    }

    fn buffer(&self, size: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.gpu.device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    }

    fn status(&self, surface: &GpuSurface) -> SurfaceStatus {
        SurfaceStatus::from_bytes(bytemuck::cast_slice(&self.read(surface.status_buffer()))).expect("a status")
    }

    fn read(&self, from: &wgpu::Buffer) -> Vec<u32> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let descriptor = wgpu::BufferDescriptor { label: None, size: from.size(), usage, mapped_at_creation: false };
        let staging = device.create_buffer(&descriptor);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(from, 0, &staging, 0, from.size());
        queue.submit([encoder.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |result| result.expect("mapped"));
        device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        bytemuck::pod_collect_to_vec(&staging.slice(..).get_mapped_range())
    }
}

impl Run<'_> {
    /// Another surface for the same mesh.
    pub fn begin_anew(&mut self, source: &SurfaceSource, settings: &SurfaceSettings) {
        self.surface = self.device.surface(&source.domain, source.particles.len() as u32, settings);
    }

    /// Time of one of `count` runs, one after the other, on each of the sources in turn, which are as large
    /// as the first: the least of three rounds, as a device that was idle is slow at first.
    pub fn time(&mut self, sources: &[&SurfaceSource], count: usize, is_forced: bool) -> Duration {
        let gpu = &self.device.gpu;
        let upload = |source: &&SurfaceSource| {
            let particles = self.device.buffer(28 * source.particles.len() as u64);
            gpu.queue.write_buffer(&particles, 0, bytemuck::cast_slice(&source.particles[..]));
            particles
        };
        let particles: Vec<wgpu::Buffer> = sources.iter().map(upload).collect();
        let mut submit = |k: usize| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let target = target(&self.vertices, &self.indices, self.capacity);
            let particles = (&particles[k % particles.len()], sources[0].particles.len() as u32);
            self.surface.encode(&gpu.queue, &mut encoder, particles, &target, is_forced);
            gpu.queue.submit([encoder.finish()]);
        };
        let wait = || gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        let mut round = || {
            let start = Instant::now();
            (1..=count).for_each(&mut submit);
            wait();
            start.elapsed() / count as u32
        };
        [round(), round(), round()].into_iter().min().unwrap_or_default()
    }

    /// The fields that the mesh is made of: of each block those of its last extraction.
    pub fn kept_field(&self, status: &SurfaceStatus) -> Field {
        self.field(status, self.surface.kept_field_buffers())
    }

    fn field(&self, status: &SurfaceStatus, buffers: [&wgpu::Buffer; 3]) -> Field {
        let words = buffers.map(|b| self.device.read(b));
        self.surface.field_of(status, words.each_ref().map(|w| &w[..]))
    }

    /// Runs the passes once.
    pub fn frame(&mut self, source: &SurfaceSource, is_forced: bool) -> Output {
        let count = source.particles.len() as u32;
        let particles = self.device.buffer(28 * u64::from(count.max(1)));
        self.device.gpu.queue.write_buffer(&particles, 0, bytemuck::cast_slice(&source.particles[..]));
        self.frame_of((&particles, count), is_forced)
    }

    /// Runs the passes once, on particles that are on the device.
    pub fn frame_of(&mut self, (particles, count): (&wgpu::Buffer, u32), is_forced: bool) -> Output {
        let gpu = &self.device.gpu;
        let target = target(&self.vertices, &self.indices, self.capacity);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.surface.encode(&gpu.queue, &mut encoder, (particles, count), &target, is_forced);
        self.readback.encode(&mut encoder, &self.surface);
        // Asked for twice, it comes once.
        self.readback.encode(&mut encoder, &self.surface);
        gpu.queue.submit([encoder.finish()]);
        self.readback.submitted();
        let status = self.await_status();
        assert_eq!((self.readback.take(), self.device.status(&self.surface)), (None, status));
        let vertices = self.device.read(&self.vertices).split_off((VERTEX_WORDS * FIRST.0) as usize);
        let indices = self.device.read(&self.indices).split_off(FIRST.1 as usize);
        output(status, vertices, indices)
    }

    /// The status that is on its way. Whoever polls a device calls back for all who wait, and may not be done
    /// with it when others' polls return.
    fn await_status(&mut self) -> SurfaceStatus {
        let start = Instant::now();
        loop {
            self.device.gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
            if let Some(status) = self.readback.take() {
                return status;
            }
            assert!(start.elapsed() < ANSWER_MAX, "no status");
            std::thread::yield_now();
        }
    }
}

/// What an answer may take: minutes on a machine that has much else to do are no failure.
const ANSWER_MAX: Duration = Duration::from_secs(300);

fn target<'a>(vertices: &'a wgpu::Buffer, indices: &'a wgpu::Buffer, capacity: (u32, u32)) -> MeshTarget<'a> {
    let ((vertex_first, index_first), (vertex_capacity, index_capacity)) = (FIRST, capacity);
    MeshTarget { vertices, vertex_first, vertex_capacity, indices, index_first, index_capacity }
}

fn output(status: SurfaceStatus, vertices: Vec<u32>, indices: Vec<u32>) -> Output {
    let balls = status.ball_counts();
    let is_whole = status.flags == 0;
    let vertex_count = if is_whole { (status.vertex_count - balls.0) as usize } else { 0 };
    let index_count = if is_whole { (status.index_count - balls.1) as usize } else { 0 };
    let three = |v: &[u32]| [v[0], v[1], v[2]].map(f32::from_bits);
    // Without what stands between the regions of blocks.
    let triangles = || indices[..index_count].chunks(3).filter(|t| **t != [0; 3]);
    let mut is_used = vec![false; vertex_count];
    triangles().flatten().for_each(|&v| is_used[v as usize] = true);
    let used = (0..vertex_count).filter(|&v| is_used[v]).map(|v| &vertices[v * VERTEX_WORDS as usize..][..VERTEX_WORDS as usize]);
    let mut places = Vec::with_capacity(vertex_count);
    let mut next = 0;
    is_used.iter().for_each(|is_used| {
        places.push(next);
        next += u32::from(*is_used);
    });
    let place = |v: u32| places[v as usize];
    let mesh = Mesh::new(used.clone().map(three).collect(), triangles().map(|t| [t[0], t[1], t[2]].map(place)).collect());
    let normals = used.clone().map(|v| three(&v[3..])).collect();
    let numbers = used.map(|v| v[6]).collect();
    let grains = if is_whole { grains(&status, &vertices, &indices) } else { vec![] };
    Output { status, words: (vertices, indices), mesh, grains, normals, numbers, field: None }
}

/// The grains whose balls are the last ones: each a mesh of its own, whose middle and volume are its grain's.
fn grains(status: &SurfaceStatus, vertices: &[u32], indices: &[u32]) -> Vec<Grain> {
    let (vertex_count, index_count) = status.ball_counts();
    let count = status.grain_count.max(1);
    let (each, corners) = ((vertex_count / count) as usize, (index_count / count) as usize);
    let (first, first_index) = (status.vertex_count - vertex_count, (status.index_count - index_count) as usize);
    let grain = |k: usize| {
        let begin = first as usize + k * each;
        let vertex = |v: usize| &vertices[v * VERTEX_WORDS as usize..][..VERTEX_WORDS as usize];
        let positions: Vec<[f32; 3]> =
            (begin..begin + each).map(|v| [vertex(v)[0], vertex(v)[1], vertex(v)[2]].map(f32::from_bits)).collect();
        let corners = &indices[first_index + k * corners..][..corners];
        let triangles = corners.chunks(3).map(|t| [t[0], t[1], t[2]].map(|v| v - begin as u32)).collect();
        let middle = positions.iter().map(|p| Vec3::from_array(*p)).sum::<Vec3>() / each as f32;
        for (v, p) in (begin..).zip(&positions) {
            let normal = Vec3::from_array([vertex(v)[3], vertex(v)[4], vertex(v)[5]].map(f32::from_bits));
            assert!((Vec3::from_array(*p) - middle).normalize_or(normal).dot(normal) > 0.99, "the normal of a ball");
        }
        let volume = Mesh::new(positions, triangles).volume();
        let radius = (0.75 * volume / std::f64::consts::PI).cbrt() as f32;
        Grain { position: middle.to_array(), radius, particle: (vertex(begin)[6] & 0x7fff_ffff) / 12 }
    };
    (0..status.grain_count as usize).map(grain).collect()
}
