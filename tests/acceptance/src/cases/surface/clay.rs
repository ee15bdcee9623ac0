//! Clay for surfaces: jittered lattices, balls, clusters, cubes with cuts of no width. Shared by `validate`
//! and the tests of the surface.

use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::sim::params::{Domain, Walls};
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::mesh::Mesh;
use bevy_clay::surface::stitch::print_ready;
use glam::{DMat3, DVec3};

/// The generator `SplitMix64`: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Each coordinate uniform in `low..high`.
    pub fn vector(&mut self, low: f64, high: f64) -> DVec3 {
        DVec3::new(self.range(low, high), self.range(low, high), self.range(low, high))
    }

    /// A direction, uniform on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.vector(-1.0, 1.0);
            if (1e-3..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }
}

/// Cell width \[m\].
pub const CELL: f64 = 0.001;

/// A cube of a room, `cells` wide.
pub fn domain(cells: f64) -> Domain {
    Domain::new(DVec3::ZERO, DVec3::splat(cells * CELL), CELL, Walls::default()).expect("a domain")
}

/// Points of a lattice of half a cell, jittered by `jitter` lattice spacings, for which `is_in` holds
/// \[cells\].
pub fn lattice(low: DVec3, high: DVec3, jitter: f64, random: &mut Random, is_in: impl Fn(DVec3) -> bool) -> Vec<DVec3> {
    let mut points = Vec::new();
    let n = ((high - low) * 2.0).round().as_uvec3();
    for z in 0..n.z {
        for y in 0..n.y {
            for x in 0..n.x {
                let at = low + DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.5 + 0.25;
                let at = at + random.vector(-jitter, jitter) * 0.5;
                if is_in(at) {
                    points.push(at);
                }
            }
        }
    }
    points
}

/// Clay at `points` \[cells\], 8 particles per cell, with the given packed tags.
pub fn source(domain: Domain, points: &[DVec3], tags: impl Fn(usize) -> u32, volume_ratio: f64) -> SurfaceSource {
    let particle = |(i, p): (usize, &DVec3)| SurfaceParticle {
        position: p.as_vec3().to_array(),
        volume_ratio: volume_ratio as f32,
        density_weight: 0.125,
        tags: tags(i),
        body: 0,
    };
    SurfaceSource { domain, particles: points.iter().enumerate().map(particle).collect::<Vec<_>>().into() }
}

/// Middle of [`ball`] \[cells\]: no node, no middle of nodes.
pub const BALL_CENTRE: DVec3 = DVec3::new(22.13, 21.87, 22.31);

/// A ball of `radius` cells.
pub fn ball(radius: f64, jitter: f64, seed: u64) -> SurfaceSource {
    let half = (radius + 1.5).ceil();
    let low = BALL_CENTRE.floor() - half;
    let points = lattice(low, low + 2.0 * half + 1.0, jitter, &mut Random(seed), |p| p.distance(BALL_CENTRE) < radius);
    source(domain(40.0), &points, |_| 0, 1.0)
}

/// The `count` lattice points nearest a random centre.
pub fn cluster(count: usize, random: &mut Random) -> Vec<DVec3> {
    let mut points = lattice(DVec3::splat(-2.0), DVec3::splat(2.0), 0.0, random, |_| true);
    points = points.iter().map(|p| p - 0.25).collect();
    points.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    points.truncate(count);
    let centre = DVec3::splat(15.0) + random.vector(0.0, 1.0);
    points.iter().map(|p| centre + *p + random.vector(-0.1, 0.1)).collect()
}

/// A cube of 6 cells, 40 particles and 30 clusters of 1 to 30 anywhere, also in each other.
pub fn scattered(random: &mut Random) -> SurfaceSource {
    let low = DVec3::splat(10.0) + random.vector(0.0, 1.0);
    let mut points = lattice(low, low + 6.0, 0.25, random, |_| true);
    points.extend((0..40).map(|_| random.vector(4.0, 26.0)));
    for count in 1..=30 {
        let shift = random.vector(4.0, 26.0) - 15.5;
        points.extend(cluster(count, random).iter().map(|p| p + shift));
    }
    source(domain(30.0), &points, |_| 0, 1.0)
}

/// `s`, and `count` particles around it, each alone: 2 cells from the next, 2 from the ball.
pub fn with_dust(s: &SurfaceSource, count: usize) -> SurfaceSource {
    let at = |i: u32| DVec3::new(f64::from(i % 31), f64::from(i / 31 % 31), f64::from(i / 961)) * 2.0 + 1.5;
    let places: Vec<DVec3> = (0..29_791).map(at).filter(|p| p.distance(BALL_CENTRE) > 17.0).take(count).collect();
    let dust = source(domain(64.0), &places, |_| 0, 1.0);
    SurfaceSource { particles: s.particles.iter().chain(&dust.particles[..]).copied().collect::<Vec<_>>().into(), ..dust }
}

/// Other particles in the same room.
pub fn changed(source: &SurfaceSource, change: impl Fn(&mut Vec<SurfaceParticle>)) -> SurfaceSource {
    let mut particles = source.particles.to_vec();
    change(&mut particles);
    SurfaceSource { domain: source.domain, particles: particles.into() }
}

/// The top half cell of a clay pushed in by a fifth of a cell.
pub fn dented(source: &SurfaceSource) -> SurfaceSource {
    let top = source.particles.iter().map(|p| p.position[1]).fold(0.0, f32::max);
    changed(source, |all| all.iter_mut().filter(|p| p.position[1] > top - 0.5).for_each(|p| p.position[1] -= 0.2))
}

/// A cut of no width along a plane; particles within [`BAND`] of it know their side.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The plane's normal.
    pub normal: DVec3,
    /// A point of the plane \[cells\].
    pub point: DVec3,
    /// The cut is where p . direction > depth; zero and the least number for a cut right through.
    pub end: (DVec3, f64),
}

/// How far clay at a cut is tagged \[cells\].
pub const BAND: f64 = 3.0;

impl Cut {
    /// A cut right through.
    pub fn through(normal: DVec3, point: DVec3) -> Self {
        Self { normal, point, end: (DVec3::ZERO, f64::MIN) }
    }

    /// Distance of a point from the plane \[cells\].
    pub fn distance(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }

    /// 1, -1, or 0 beyond the band and the cut's end.
    pub fn side(&self, p: DVec3) -> i8 {
        let s = self.distance(p);
        if s.abs() < BAND && p.dot(self.end.0) > self.end.1 { if s >= 0.0 { 1 } else { -1 } } else { 0 }
    }
}

/// Middle of [`CutCube`] \[cells\].
pub const CUBE_CENTRE: DVec3 = DVec3::new(18.0, 18.0, 18.0);

/// Numbers of bodies.
const BODY_NUMBERS: [u32; 8] = [0, 5, 2, 16_383, 1, 300, 7, 30];

/// A cube of 12 cells with cuts, and the number of bodies that it is in.
pub struct CutCube {
    /// Its particles \[cells\].
    pub points: Vec<DVec3>,
    /// Its cuts.
    pub cuts: Vec<Cut>,
    /// Bodies that they leave.
    pub bodies: usize,
    seed: u64,
}

impl CutCube {
    /// A cube with `cuts`, its lattice jittered by `jitter` spacings.
    pub fn new(cuts: Vec<Cut>, bodies: usize, jitter: f64, random: &mut Random) -> Self {
        let points = lattice(CUBE_CENTRE - 6.0, CUBE_CENTRE + 6.0, jitter, random, |_| true);
        Self { points, cuts, bodies, seed: random.bits() }
    }

    /// Case `index` of one cut: even cuts go through, odd ones end at a random height; jitter 1/4 or 1/2.
    pub fn one(index: usize, random: &mut Random) -> Self {
        let mut cut = Cut::through(random.direction(), CUBE_CENTRE);
        if index % 2 == 1 {
            cut.normal = DVec3::new(cut.normal.x, 0.0, cut.normal.z).normalize();
        }
        cut.point = CUBE_CENTRE + random.vector(-1.5, 1.5);
        if index % 2 == 1 {
            cut.end = (DVec3::Y, CUBE_CENTRE.y - 2.0 + random.range(0.0, 4.0));
        }
        Self::new(vec![cut], if index.is_multiple_of(2) { 2 } else { 1 }, jitter_of(index), random)
    }

    /// Two cuts through that cross at 45 to 90 degrees within the cube: four bodies.
    pub fn crossed(index: usize, random: &mut Random) -> Self {
        let cuts = crossing(random);
        Self::new(cuts.to_vec(), 4, jitter_of(index), random)
    }

    /// Two parallel cuts 2 to 4 cells apart: three slabs.
    pub fn slabs(index: usize, random: &mut Random) -> Self {
        let normal = random.direction();
        let first = Cut::through(normal, CUBE_CENTRE + random.vector(-0.5, 0.5) - normal * 1.5);
        let second = Cut::through(normal, first.point + normal * random.range(2.0, 4.0));
        Self::new(vec![first, second], 3, jitter_of(index), random)
    }

    /// A cut through, and one at right angles that stops in the middle of both halves, or of one: two bodies.
    pub fn crossed_by_partial(index: usize, random: &mut Random) -> Self {
        let [through, mut partial] = crossing(random);
        // Along the first cut's plane, so that it ends in both halves.
        let along = through.normal.cross(partial.normal).normalize();
        partial.end = (along, along.dot(CUBE_CENTRE) + random.range(-2.0, 2.0));
        Self::new(vec![through, partial], 2, jitter_of(index), random)
    }

    /// A cut through, and another of one of its halves only, up to the first: three bodies.
    pub fn joined(index: usize, random: &mut Random) -> Self {
        let [through, mut other] = crossing(random);
        other.end = (through.normal, through.normal.dot(through.point));
        Self::new(vec![through, other], 3, jitter_of(index), random)
    }

    /// Packed tags of the particles: the nearest two cuts, in any order, sizes of sides at random.
    pub fn tags(&self) -> Vec<u32> {
        let mut random = Random(self.seed);
        let tags_at = |p: &DVec3| {
            let mut tags: Vec<(f64, u8, i8)> =
                self.cuts.iter().zip(1u8..).map(|(c, k)| (c.distance(*p).abs(), k, c.side(*p))).collect();
            tags.retain(|t| t.2 != 0);
            tags.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut bytes = [0; 4];
            let flip = random.bits();
            for (i, &(_, sheet, side)) in tags.iter().take(2).enumerate() {
                let slot = (i + (flip & 1) as usize) % 2;
                let size = 1 + (flip >> 8 & 63) as i8;
                (bytes[2 * slot], bytes[2 * slot + 1]) = (sheet, (side * size).cast_unsigned());
            }
            u32::from_le_bytes(bytes)
        };
        self.points.iter().map(tags_at).collect()
    }

    /// The clay, after the affine map about the cube's centre.
    pub fn source(&self, map: DMat3) -> SurfaceSource {
        let points: Vec<DVec3> = self.points.iter().map(|p| CUBE_CENTRE + map * (*p - CUBE_CENTRE)).collect();
        let tags = self.tags();
        source(domain(30.0), &points, |i| tags[i], map.determinant().abs())
    }

    /// The clay with its cuts finished: a body for each combination of their sides, and no tags.
    pub fn parted_source(&self, map: DMat3) -> SurfaceSource {
        let whole = self.source(map);
        let side = |p: &DVec3, k: usize, cut: &Cut| u32::from(cut.distance(*p) >= 0.0) << k;
        let number = |p: &DVec3| BODY_NUMBERS[self.cuts.iter().enumerate().map(|(k, c)| side(p, k, c)).sum::<u32>() as usize];
        let parted = |all: &mut Vec<SurfaceParticle>| {
            all.iter_mut().zip(&self.points).for_each(|(p, at)| (p.body, p.tags) = (number(at), 0));
        };
        changed(&whole, parted)
    }

    /// Three cuts at right angles through a point, to be finished: eight bodies.
    pub fn octants(point: DVec3, axes: DMat3, random: &mut Random) -> Self {
        let cuts = [axes.x_axis, axes.y_axis, axes.z_axis].map(|normal| Cut::through(normal, point));
        Self::new(cuts.to_vec(), 8, 0.25, random)
    }

    /// A cube of two bodies that meet at a plane across x, and a cut across z: in the first or in both, from
    /// above down to `depth` or right through; tags of the one sheet.
    pub fn cut_beside_body(is_in_both: bool, depth: f64, random: &mut Random) -> (Self, SurfaceSource) {
        let face = Cut::through(DVec3::X, CUBE_CENTRE + random.vector(-0.5, 0.5));
        let cut = Cut { normal: DVec3::Z, point: CUBE_CENTRE + random.vector(-0.5, 0.5), end: (DVec3::Y, depth) };
        let pieces = if depth > CUBE_CENTRE.y - 6.0 { 2 } else { 3 + usize::from(is_in_both) };
        let cube = Self::new(vec![cut], pieces, 0.25, random);
        let bodied = |all: &mut Vec<SurfaceParticle>| {
            for (p, _) in all.iter_mut().zip(&cube.points).filter(|(_, at)| face.distance(**at) >= 0.0) {
                p.body = 5;
                p.tags = if is_in_both { p.tags } else { 0 };
            }
        };
        let source = changed(&cube.source(DMat3::IDENTITY), bodied);
        (cube, source)
    }

    /// What is wrong with the topology of an extracted mesh after repair: every body must be a ball.
    pub fn fault(&self, raw: &Mesh) -> Option<String> {
        let check = MeshCheck::of(raw);
        if check.open_edges + check.misoriented_edges > 0 {
            return Some(format!("not closed: {check:?}"));
        }
        let (mesh, repairs) = print_ready(raw);
        let fixed = MeshCheck::of(&mesh);
        if fixed.is_closed_manifold() && fixed.components == self.bodies && fixed.euler == 2 * self.bodies as i64 {
            return None;
        }
        let volumes: Vec<f64> = mesh.components().iter().map(|b| b.volume() / CELL.powi(3)).collect();
        Some(format!("{} bodies expected: {fixed:?}, {repairs:?}, volumes {volumes:.6?} cells", self.bodies))
    }
}

fn jitter_of(index: usize) -> f64 {
    [0.25, 0.5][index / 2 % 2]
}

/// Two planes at 45 to 90 degrees to each other, within 1.7 cells of the cube's centre.
fn crossing(random: &mut Random) -> [Cut; 2] {
    let first = random.direction();
    let second = loop {
        let d = random.direction();
        if d.dot(first).abs() < 0.7 {
            break d;
        }
    };
    [first, second].map(|normal| Cut::through(normal, CUBE_CENTRE + random.vector(-1.0, 1.0)))
}

/// A linear map near the identity: entries within 0.15 of its.
pub fn affine(random: &mut Random) -> DMat3 {
    let columns = [0, 1, 2].map(|d| DVec3::AXES[d] + random.vector(-0.15, 0.15));
    DMat3::from_cols(columns[0], columns[1], columns[2])
}

/// The lips of a cut at rest, over the parts away from the cube's faces.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lips {
    /// Areas of the lip of the back body, which faces forward, and of the front body [m^2].
    pub areas: [f64; 2],
    /// Mean distance of the front body's lip from the back body's, along the normal \[cells\].
    pub gap: f64,
    /// Distance from the plane, rms \[cells\].
    pub rms: f64,
}

impl Lips {
    /// The lips of `cut`, away from the cube's faces.
    pub fn of(mesh: &Mesh, domain: &Domain, cut: &Cut) -> Self {
        let (mut areas, mut sums, mut squares) = ([0.0; 2], [0.0; 2], 0.0);
        for t in &mesh.triangles {
            let vector = mesh.area_vector(*t);
            let centre = domain.to_grid(mesh.corners(*t).iter().sum::<DVec3>() / 3.0);
            let along = vector.dot(cut.normal) / vector.length();
            let is_deep = (centre - CUBE_CENTRE).abs().max_element() < 4.5;
            if is_deep && along.abs() > 0.7 && cut.distance(centre).abs() < 0.75 {
                let lip = usize::from(along < 0.0);
                areas[lip] += vector.length();
                sums[lip] += vector.length() * cut.distance(centre);
                squares += vector.length() * cut.distance(centre).powi(2);
            }
        }
        let rms = (squares / (areas[0] + areas[1])).sqrt();
        Self { areas, gap: sums[1] / areas[1] - sums[0] / areas[0], rms }
    }
}

/// A cut through the cube, across its x axis.
pub fn upright(random: &mut Random) -> CutCube {
    let normal = (random.direction() + 2.0 * DVec3::X).normalize();
    CutCube::new(vec![Cut::through(normal, CUBE_CENTRE + random.vector(-1.0, 1.0))], 2, 0.25, random)
}
