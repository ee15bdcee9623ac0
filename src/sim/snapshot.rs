//! The state of the clay, whole: what an engine loads and saves, and a file of it (version 2; version 1,
//! which knew less of the material, is read too).

use super::material::{ClayLaw, ClayMaterial, Weld};
use super::params::{Domain, Wall, Walls};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec3};

/// A particle's relation to one cut: which sheet, which side of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Tag {
    /// The sheet's id; 0 with side 0 is no cut.
    pub sheet: u8,
    /// Positive in front, negative behind, 0 none. Its magnitude counts from 1 how far the two sides have
    /// grown together.
    pub side: i8,
}

impl Tag {
    /// +1 in front, -1 behind, 0 none.
    pub fn sign(self) -> i8 {
        self.side.signum()
    }
}

/// One particle, as stored between frames. f32, 116 bytes, no padding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Particle {
    /// Cell index.
    pub cell: [i32; 3],
    /// Offset from the cell's low corner [cells], in [0, 1): f32 in absolute coordinates stalls slow creep.
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
}

impl Particle {
    /// A particle at rest at grid coordinate `grid` [cells].
    pub fn at(grid: DVec3, rest_volume: f32, id: u32) -> Self {
        let mut particle = Self { rest_volume, id, ..Self::default() };
        particle.set_grid(grid);
        particle
    }

    /// Grid coordinate [cells].
    pub fn grid(&self) -> DVec3 {
        IVec3::from_array(self.cell).as_dvec3() + DVec3::from_array(self.offset.map(f64::from))
    }

    /// Puts the particle at grid coordinate `grid` [cells].
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
    }
}

/// The whole state of the clay at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Where the clay is.
    pub domain: Domain,
    /// What it is made of.
    pub material: ClayMaterial,
    /// Simulated time [s].
    pub time: f64,
    /// The particles.
    pub particles: Vec<Particle>,
}

/// Why a snapshot's bytes could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// Not a snapshot file.
    #[error("not a clay snapshot: the first 8 bytes are not `bevyclay`")]
    NotASnapshot,
    /// A version this program does not know.
    #[error("clay snapshot of version {0}; this program reads versions 1 and 2")]
    Version(u32),
    /// The file is cut short, too long or changed.
    #[error("clay snapshot damaged: {0}")]
    Damaged(&'static str),
}

const MAGIC: &[u8; 8] = b"bevyclay";
const VERSION: u32 = 2;
/// Numbers in the header: the domain's and the material's, the time, spare ones.
const NUMBERS: usize = 24;
/// The same in version 1.
const NUMBERS_1: usize = 13;

/// Bytes before the particles: magic, version, walls, law, numbers, cells, particle count, checksum.
const fn header_bytes(numbers: usize) -> usize {
    8 + 4 + 6 + 2 + numbers * 8 + 12 + 4 + 8
}

impl Snapshot {
    /// Sum of rest volumes [m^3].
    pub fn rest_volume(&self) -> f64 {
        self.particles.iter().map(|p| f64::from(p.rest_volume)).sum()
    }

    /// The snapshot as bytes: little-endian, versioned, with a checksum.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(header_bytes(NUMBERS) + self.particles.len() * size_of::<Particle>());
        out.extend(MAGIC);
        out.extend(VERSION.to_le_bytes());
        let (d, m) = (&self.domain, &self.material);
        let (law, [loss, rate, rest_time]) = law_code(m.law);
        out.extend(d.walls.low.iter().chain(&d.walls.high).map(|w| wall_code(*w)));
        out.extend([law, weld_code(m.weld)]);
        let mut numbers = [0.0; NUMBERS];
        numbers[..18].copy_from_slice(&[
            d.origin.x,
            d.origin.y,
            d.origin.z,
            d.cell_width,
            m.density,
            m.young_modulus,
            m.poisson_ratio,
            m.yield_stress,
            m.softening,
            m.softening_length,
            self.time,
            m.hardening_modulus,
            m.viscosity,
            m.flow_index,
            loss,
            rate,
            rest_time,
            0.0,
        ]);
        numbers.iter().for_each(|n| out.extend(n.to_le_bytes()));
        d.cells.to_array().iter().for_each(|n| out.extend(n.to_le_bytes()));
        out.extend(u32::try_from(self.particles.len()).unwrap_or(u32::MAX).to_le_bytes());
        let body: &[u8] = bytemuck::cast_slice(&self.particles);
        out.extend(checksum(&out, body).to_le_bytes());
        out.extend(body);
        out
    }

    /// Reads [`Self::to_bytes`].
    ///
    /// # Errors
    /// Bytes that are not a snapshot, are of another version, cut short or changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        if bytes.get(..8) != Some(MAGIC) {
            return Err(SnapshotError::NotASnapshot);
        }
        let version = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let numbers = match version {
            Some(VERSION) => NUMBERS,
            Some(1) => NUMBERS_1,
            Some(other) => return Err(SnapshotError::Version(other)),
            None => return Err(SnapshotError::Damaged("cut short within the header")),
        };
        let header = header_bytes(numbers);
        let (head, body) = bytes.split_at_checked(header).ok_or(SnapshotError::Damaged("cut short within the header"))?;
        let (fields, sum) = head.split_at(header - 8);
        let word = |at: usize| <[u8; 4]>::try_from(&fields[at..at + 4]).unwrap_or_default();
        let number = |i: usize| f64::from_le_bytes(<[u8; 8]>::try_from(&fields[20 + 8 * i..28 + 8 * i]).unwrap_or_default());
        let count = u32::from_le_bytes(word(header - 12)) as usize;
        if body.len() != count * size_of::<Particle>() {
            return Err(SnapshotError::Damaged("its length does not fit its particle count"));
        }
        if checksum(fields, body).to_le_bytes() != sum {
            return Err(SnapshotError::Damaged("its checksum does not fit its content"));
        }
        let wall = |i: usize| wall_from_code(fields[12 + i]).ok_or(SnapshotError::Damaged("a wall of unknown kind"));
        let walls = Walls { low: [wall(0)?, wall(1)?, wall(2)?], high: [wall(3)?, wall(4)?, wall(5)?] };
        let cells = IVec3::from_array([0, 1, 2].map(|i| i32::from_le_bytes(word(20 + numbers * 8 + 4 * i))));
        let of_2 = |i: usize, before: f64| if numbers == NUMBERS { number(i) } else { before };
        let law_numbers = [of_2(14, 0.0), of_2(15, 0.0), of_2(16, 0.0)];
        let law = law_from_code(fields[18], law_numbers).ok_or(SnapshotError::Damaged("a law of unknown kind"))?;
        let weld =
            Weld::ALL.get(usize::from(fields[19])).copied().ok_or(SnapshotError::Damaged("a weld rule of unknown kind"))?;
        let domain = Domain { origin: DVec3::new(number(0), number(1), number(2)), cell_width: number(3), cells, walls };
        let material = ClayMaterial {
            density: number(4),
            young_modulus: number(5),
            poisson_ratio: number(6),
            yield_stress: number(7),
            softening: number(8),
            softening_length: number(9),
            hardening_modulus: of_2(11, 0.0),
            viscosity: of_2(12, 0.0),
            flow_index: of_2(13, 1.0),
            law,
            weld,
        };
        Ok(Self { domain, material, time: number(10), particles: bytemuck::pod_collect_to_vec(body) })
    }
}

fn wall_code(wall: Wall) -> u8 {
    match wall {
        Wall::Slip => 0,
        Wall::Stick => 1,
        Wall::Separate => 2,
    }
}

fn wall_from_code(code: u8) -> Option<Wall> {
    [Wall::Slip, Wall::Stick, Wall::Separate].get(usize::from(code)).copied()
}

/// Files from before there was a choice have 0.
fn weld_code(weld: Weld) -> u8 {
    Weld::ALL.iter().position(|w| *w == weld).unwrap_or_default() as u8
}

/// A law's code and numbers.
fn law_code(mut law: ClayLaw) -> (u8, [f64; 3]) {
    let mut numbers = [0.0; 3];
    numbers.iter_mut().zip(law.numbers_mut()).for_each(|(to, (_, number))| *to = *number);
    (law.number() as u8, numbers)
}

fn law_from_code(code: u8, numbers: [f64; 3]) -> Option<ClayLaw> {
    let mut law = *ClayLaw::ALL.get(usize::from(code))?;
    law.numbers_mut().into_iter().zip(numbers).for_each(|((_, number), from)| *number = from);
    Some(law)
}

/// FNV-1a over 8-byte words: finds damage, not malice.
fn checksum(head: &[u8], body: &[u8]) -> u64 {
    let word = |hash: u64, chunk: &[u8]| {
        let mut bytes = [0; 8];
        bytes[..chunk.len()].copy_from_slice(chunk);
        (hash ^ u64::from_le_bytes(bytes)).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
    };
    head.chunks(8).chain(body.chunks(8)).fold(0xcbf2_9ce4_8422_2325, word)
}

#[cfg(test)]
mod tests {
    use super::super::material::Preset;
    use super::*;

    fn snapshot() -> Snapshot {
        let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Separate], high: [Wall::Separate, Wall::Slip, Wall::Stick] };
        let domain = Domain::new(DVec3::splat(-0.1), DVec3::splat(0.3), 0.01, walls).expect("domain");
        let particles = (0..1000u32)
            .map(|i| {
                let f = f64::from(i);
                let mut p = Particle::at(DVec3::new(f * 0.01 + 7.0, f * 0.02 + 6.0, 8.3), 1e-9, i);
                p.tags[1] = Tag { sheet: 3, side: -1 };
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
        Snapshot { domain, material, time: 1.25, particles }
    }

    #[test]
    fn bytes_round_trip() {
        let s = snapshot();
        assert_eq!(Snapshot::from_bytes(&s.to_bytes()), Ok(s));
    }

    /// A file of version 1 gives the clay it was made of.
    #[test]
    fn version_1_is_read() {
        let material = Preset::StiffClay.material();
        let s = Snapshot { material, ..snapshot() };
        let new = s.to_bytes();
        let (head, body) = new.split_at(header_bytes(NUMBERS));
        let mut old = head[..20 + 11 * 8].to_vec();
        old[8..12].copy_from_slice(&1u32.to_le_bytes());
        old.extend([0; 16]);
        old.extend(&head[20 + NUMBERS * 8..head.len() - 8]);
        old.extend(checksum(&old, body).to_le_bytes());
        old.extend(body);
        assert_eq!(Snapshot::from_bytes(&old), Ok(s));
    }

    /// Every cut of the file, and a changed byte anywhere, is found.
    #[test]
    fn damaged_bytes_are_refused() {
        let bytes = snapshot().to_bytes();
        for length in [0, 7, 11, 100, header_bytes(NUMBERS), bytes.len() - 1] {
            assert!(Snapshot::from_bytes(&bytes[..length]).is_err(), "cut to {length}");
        }
        for at in (0..bytes.len()).step_by(97) {
            let mut changed = bytes.clone();
            changed[at] ^= 0x10;
            assert!(Snapshot::from_bytes(&changed).is_err(), "byte {at}");
        }
    }

    #[test]
    fn volume_ratio_of_stretched_strain_is_the_product_of_stretches() {
        let mut p = Particle::default();
        p.elastic_strain[..3].copy_from_slice(&[1.1f32 * 1.1 - 1.0, 0.9 * 0.9 - 1.0, 1.2 * 1.2 - 1.0]);
        assert!((p.volume_ratio() - 1.1 * 0.9 * 1.2).abs() < 1e-6);
    }
}
