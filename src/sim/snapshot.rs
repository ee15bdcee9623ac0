//! The state of the clay, whole: what an engine loads and saves, and a file of it.

use super::material::ClayMaterial;
use super::packet::{self, PacketError};
use super::params::Domain;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec3};
use serde::{Deserialize, Serialize};

/// A particle's relation to one cut: which sheet, which side of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Tag {
    /// The sheet's id; 0 is no cut.
    pub sheet: u8,
    /// Positive in front, negative behind; its magnitude counts from 1 to 100 how far the two sides have
    /// grown together, and is 127 where they are pressed since their blade left. 0 is no side: of a sheet,
    /// where they have.
    pub side: i8,
}

impl Tag {
    /// +1 in front, -1 behind, 0 none.
    pub fn sign(self) -> i8 {
        self.side.signum()
    }
}

/// Where a particle clings to a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Anchor {
    /// Place in the tool's own frame \[cells\].
    pub at: [f32; 3],
    /// The tool's id + 1; 0 is no anchor.
    pub tool: u32,
}

impl Anchor {
    /// The anchor at `at` \[cells\] in the frame of the tool of id `id`.
    pub(crate) fn on(id: u32, at: DVec3) -> Self {
        Self { at: at.as_vec3().to_array(), tool: id + 1 }
    }

    /// The tool's id and the place \[cells\] in its frame, if there is an anchor.
    pub(crate) fn get(&self) -> Option<(u32, DVec3)> {
        Some((self.tool.checked_sub(1)?, DVec3::from_array(self.at.map(f64::from))))
    }
}

/// Tools that a particle can cling to at once: those of a corner. One more presses without friction.
pub const ANCHORS_MAX: usize = 2;

/// One particle, as stored between frames. f32, 156 bytes, no padding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Particle {
    /// Cell index.
    pub cell: [i32; 3],
    /// Offset from the cell's low corner \[cells\], in [0, 1): f32 in absolute coordinates stalls slow creep.
    pub offset: [f32; 3],
    /// Velocity [m/s].
    pub velocity: [f32; 3],
    /// Affine velocity [1/s], `affine[c][r]` = d v_r / d x_c.
    pub affine: [[f32; 3]; 3],
    /// Elastic strain E = b_e - I [-]: xx yy zz xy xz yz.
    pub elastic_strain: [f32; 6],
    /// Accumulated plastic strain [-].
    pub hardening: f32,
    /// Working D of thixotropic clay [-]; 0 is fresh.
    pub structure: f32,
    /// Rest volume [m^3].
    pub rest_volume: f32,
    /// Stable identity.
    pub id: u32,
    /// Cuts the particle stands at, at most two sheets.
    pub tags: [Tag; 2],
    /// Where it clings to tools.
    pub anchors: [Anchor; ANCHORS_MAX],
    /// The walls that it touches, if they are separating ones, or has arrived at: a bit each, by number.
    pub walls: u32,
    /// The [body](super::body) that it is of, by number.
    pub body: u32,
}

impl Particle {
    /// A particle at rest at grid coordinate `grid` \[cells\].
    pub fn at(grid: DVec3, rest_volume: f32, id: u32) -> Self {
        let mut particle = Self { rest_volume, id, ..Self::default() };
        particle.set_grid(grid);
        particle
    }

    /// Grid coordinate \[cells\].
    pub fn grid(&self) -> DVec3 {
        IVec3::from_array(self.cell).as_dvec3() + DVec3::from_array(self.offset.map(f64::from))
    }

    /// Puts the particle at grid coordinate `grid` \[cells\].
    pub fn set_grid(&mut self, grid: DVec3) {
        let cell = grid.floor();
        self.cell = cell.as_ivec3().to_array();
        self.offset = (grid - cell).as_vec3().to_array();
    }

    /// Volume ratio J = sqrt det(I + E).
    pub fn volume_ratio(&self) -> f64 {
        let [xx, yy, zz, xy, xz, yz] = self.elastic_strain.map(f64::from);
        let (a, b, c) = (1.0 + xx, 1.0 + yy, 1.0 + zz);
        (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)).max(0.0).sqrt()
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let all = |v: &[f32]| v.iter().all(|x| x.is_finite());
        all(&self.offset)
            && all(&self.velocity)
            && self.affine.iter().all(|c| all(c))
            && all(&self.elastic_strain)
            && self.hardening.is_finite()
            && self.structure.is_finite()
            && self.rest_volume.is_finite()
            && self.anchors.iter().all(|anchor| all(&anchor.at))
    }
}

/// What the GPU engine counts on in a frame, known from the frame two before it: it settles the scales of
/// fixed point sums and how often particles are sorted, and with these the rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Greatest |v + A d| of a particle [m/s].
    pub reach: f64,
    /// Greatest node speed [m/s].
    pub speed: f64,
    /// Most particles in a cell.
    pub cell_count: u32,
    /// Greatest mass of a node, over that of the greatest power of two of rest volumes [m^3] that an eighth
    /// of a cell holds.
    pub node_mass: f64,
}

/// The whole state of the clay at one time. What serde sees is all but the particles: the head of
/// [`Self::to_bytes`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Where the clay is.
    pub domain: Domain,
    /// What it is made of.
    pub material: ClayMaterial,
    /// Simulated time \[s\].
    pub time: f64,
    /// What the GPU engine that saved it counts on in the next frame and in the one after it: a run that is
    /// restarted with them has the same bits as one that went on. Without them it bounds the same by the
    /// particles. Other engines carry nothing from frame to frame.
    pub forecasts: Option<[Forecast; 2]>,
    /// The particles.
    #[serde(skip)]
    pub particles: Vec<Particle>,
}

/// Why a snapshot's bytes could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// Not a snapshot file.
    #[error("not a clay snapshot: the first 8 bytes are not `bevyclay`")]
    NotASnapshot,
    /// A version this program does not know.
    #[error("clay snapshot of version {0}; this program reads version {VERSION}")]
    Version(u32),
    /// The file is cut short, too long or changed.
    #[error("clay snapshot damaged: {0}")]
    Damaged(String),
}

const MAGIC: &[u8; 8] = b"bevyclay";
const VERSION: u32 = 6;

impl Snapshot {
    /// Clay at time 0 that no engine has run.
    pub fn new(domain: Domain, material: ClayMaterial, particles: Vec<Particle>) -> Self {
        Self { domain, material, time: 0.0, forecasts: None, particles }
    }

    /// Sum of rest volumes [m^3].
    pub fn rest_volume(&self) -> f64 {
        self.particles.iter().map(|p| f64::from(p.rest_volume)).sum()
    }

    /// CRC-32 of everything in it, the order of the particles too: equal for equal bits.
    pub fn checksum(&self) -> u32 {
        packet::checksum(self, bytemuck::cast_slice(&self.particles))
    }

    /// The snapshot as bytes: 8 letters, a version, and a head and the particles as they are in memory, with
    /// a checksum of both.
    pub fn to_bytes(&self) -> Vec<u8> {
        let body: &[u8] = bytemuck::cast_slice(&self.particles);
        let mut out = Vec::with_capacity(HEAD_ABOUT + body.len());
        out.extend(MAGIC);
        out.extend(VERSION.to_le_bytes());
        // Memory takes whatever is written, and the head is numbers and names alone.
        let _ = packet::write(&mut out, self, body);
        out
    }

    /// Reads [`Self::to_bytes`].
    ///
    /// # Errors
    /// Bytes that are not a snapshot, are of another version, cut short, too long or changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let Some(bytes) = bytes.strip_prefix(MAGIC) else { return Err(SnapshotError::NotASnapshot) };
        let cut_short = || SnapshotError::Damaged("it is cut short".into());
        let (version, mut rest) = bytes.split_first_chunk::<4>().ok_or_else(cut_short)?;
        match u32::from_le_bytes(*version) {
            VERSION => {}
            other => return Err(SnapshotError::Version(other)),
        }
        let read = packet::read::<Self>(&mut rest).map_err(|error| match error {
            PacketError::CutShort => cut_short(),
            PacketError::Io(error) => SnapshotError::Damaged(error.to_string()),
            PacketError::Damaged(reason) => SnapshotError::Damaged(reason),
        })?;
        let (head, body) = read.ok_or_else(cut_short)?;
        if !rest.is_empty() {
            return Err(SnapshotError::Damaged("something follows its end".into()));
        }
        head.with_particles(&body).ok_or_else(|| SnapshotError::Damaged("it holds a part of a particle".into()))
    }

    /// This head with the particles of `body`, if they are whole.
    pub(crate) fn with_particles(self, body: &[u8]) -> Option<Self> {
        let is_whole = body.len().is_multiple_of(size_of::<Particle>());
        is_whole.then(|| Self { particles: bytemuck::pod_collect_to_vec(body), ..self })
    }
}

/// Room for a head \[bytes\], about: a vector that has too little grows.
const HEAD_ABOUT: usize = 1024;

#[cfg(test)]
mod tests {
    use super::super::material::{ClayLaw, Preset, Weld};
    use super::super::params::{Wall, Walls};
    use super::*;

    fn snapshot() -> Snapshot {
        let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Separate], high: [Wall::Separate, Wall::Slip, Wall::Stick] };
        let domain = Domain::new(DVec3::splat(-0.1), DVec3::splat(0.3), 0.01, walls).expect("domain");
        let particles = (0..1000u32)
            .map(|i| {
                let f = f64::from(i);
                let mut p = Particle::at(DVec3::new(f * 0.01 + 7.0, f * 0.02 + 6.0, 8.3), 1e-9, i);
                p.tags[1] = Tag { sheet: 3, side: -1 };
                p.anchors[1] = Anchor::on(i, DVec3::new(f, -f, 0.5));
                p.walls = i % 64;
                p.body = i % 5;
                p.elastic_strain[4] = f as f32 * 1e-4;
                p
            })
            .collect();
        let law = ClayLaw::Worked { loss: 0.5, rate: 2.0, rest_time: f64::INFINITY };
        let material = ClayMaterial {
            hardening_modulus: 1e3,
            viscosity: 20.0,
            flow_index: 0.3,
            law,
            weld: Weld::Off,
            ..Preset::Plasticine.material()
        };
        Snapshot { time: 1.25, ..Snapshot::new(domain, material, particles) }
    }

    /// Every law and weld rule, clay that does not yield, and what the GPU engine carries.
    #[test]
    fn bytes_round_trip() {
        let mut all = vec![snapshot(), Snapshot { particles: vec![], ..snapshot() }];
        for law in ClayLaw::ALL {
            for weld in Weld::ALL {
                let material = ClayMaterial { law, weld, yield_stress: f64::INFINITY, density: 1.0 / 3.0, ..snapshot().material };
                let forecast = |x| Forecast { reach: x, speed: 0.1 * x, cell_count: 9, node_mass: f64::MIN_POSITIVE };
                all.push(Snapshot { material, forecasts: Some([1.0 / 7.0, 1e300].map(forecast)), ..snapshot() });
            }
        }
        for s in all {
            assert_eq!(Snapshot::from_bytes(&s.to_bytes()), Ok(s));
        }
    }

    /// Snapshots of other versions are named and not read.
    #[test]
    fn other_versions_are_named() {
        for version in [0, 5, 7] {
            let mut bytes = snapshot().to_bytes();
            bytes[8..12].copy_from_slice(&u32::to_le_bytes(version));
            assert_eq!(Snapshot::from_bytes(&bytes), Err(SnapshotError::Version(version)));
        }
        assert_eq!(Snapshot::from_bytes(b"bevycla"), Err(SnapshotError::NotASnapshot));
    }

    /// Every cut of the file, a changed byte anywhere, and what follows its end are found.
    #[test]
    fn damaged_bytes_are_refused() {
        let bytes = snapshot().to_bytes();
        let body = bytes.len() - 1000 * size_of::<Particle>();
        for length in (0..body + 300).chain([bytes.len() - 1]) {
            assert!(Snapshot::from_bytes(&bytes[..length]).is_err(), "cut to {length}");
        }
        for at in (0..body + 300).chain((body..bytes.len()).step_by(97)) {
            for bit in [0x10, 0x01, 0x80] {
                let mut changed = bytes.clone();
                changed[at] ^= bit;
                assert!(Snapshot::from_bytes(&changed).is_err(), "byte {at}");
            }
        }
        assert!(Snapshot::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
    }

    /// A file that claims to hold 16 EiB, its checksums in order, is cut short: what it claims is not
    /// allocated.
    #[test]
    fn absurd_lengths_are_cut_short() {
        let mut bytes = snapshot().to_bytes();
        for (head, body) in [(u32::MAX, 0), (10, u64::MAX), (u32::MAX, u64::MAX)] {
            bytes[12..16].copy_from_slice(&head.to_le_bytes());
            bytes[16..24].copy_from_slice(&body.to_le_bytes());
            let sum = crc32fast::hash(&bytes[12..28]);
            bytes[28..32].copy_from_slice(&sum.to_le_bytes());
            assert_eq!(Snapshot::from_bytes(&bytes), Err(SnapshotError::Damaged("it is cut short".into())));
        }
    }

    /// Whole packets of something else, and of half a particle.
    #[test]
    fn other_content_is_refused() {
        let (head, body) = (snapshot(), [0; 3 * size_of::<Particle>() / 2]);
        let start = &snapshot().to_bytes()[..12];
        let mut half = start.to_vec();
        packet::write(&mut half, &head, &body).expect("written");
        assert_eq!(Snapshot::from_bytes(&half), Err(SnapshotError::Damaged("it holds a part of a particle".into())));
        let mut other = start.to_vec();
        packet::write(&mut other, &(1, "clay"), &body).expect("written");
        let error = Snapshot::from_bytes(&other).expect_err("no snapshot").to_string();
        assert!(error.starts_with("clay snapshot damaged: its head cannot be read: ") && error.lines().count() == 1, "{error}");
    }

    #[test]
    fn volume_ratio_of_stretched_strain_is_the_product_of_stretches() {
        let mut p = Particle::default();
        p.elastic_strain[..3].copy_from_slice(&[1.1f32 * 1.1 - 1.0, 0.9 * 0.9 - 1.0, 1.2 * 1.2 - 1.0]);
        assert!((p.volume_ratio() - 1.1 * 0.9 * 1.2).abs() < 1e-6);
    }
}
