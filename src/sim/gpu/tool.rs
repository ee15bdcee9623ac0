//! A tool as the device meets it.

use super::super::params::Domain;
use super::super::tool::{Blade, Contact, Motion, Outline, Pose, ToolPath, ToolShape};
use super::layout::twins;
use glam::{DMat3, DVec3, IVec3};

twins! {
    /// A tool in one substep, as the native engine meets it. Matrices have a word of padding a column.
    pub(super) GpuTool = "Tool" {
        /// cell of the origin at the end of the substep
        pub end_cell: [i32; 3] = "vec3i",
        /// `ToolShape::number`
        pub shape: u32 = "u32",
        /// the rest of it \[cells\]
        pub end_offset: [f32; 3] = "vec3f",
        /// `Contact::number`
        pub contact: u32 = "u32",
        /// the same at its start
        pub start_cell: [i32; 3] = "vec3i",
        /// the sheet by which a blade or a plate parts the clay; 0 of what does not
        pub sheet: u32 = "u32",
        /// the rest of it \[cells\]
        pub start_offset: [f32; 3] = "vec3f",
        /// of a separating contact [-]
        pub friction: f32 = "f32",
        /// frame -> grid
        pub end_rotation: [[f32; 4]; 3] = "mat3x3f",
        /// the same at the start
        pub start_rotation: [[f32; 4]; 3] = "mat3x3f",
        /// end_rotation - start_rotation
        pub turn: [[f32; 4]; 3] = "mat3x3f",
        /// from start to end \[cells\]
        pub travel: [f32; 3] = "vec3f",
        /// of a wire: where it stands along y in the frame of its strip
        pub radius: f32 = "f32",
        /// half the box; half width and height; half the capsule's axis or the cone's height in y
        pub size: [f32; 3] = "vec3f",
        /// of a bent blade: its index, and its number of points from bit 8 on
        pub profile: u32 = "u32",
        /// its id + 1, by which anchors name it
        pub anchor: u32 = "u32",
        /// nothing
        pub spare: [u32; 3] = "array<u32, 3>",
    }
}

impl GpuTool {
    /// The tool of `path` during the substep from `start` to `end` \[s\]; `profile` is the index of its
    /// profile, if it is a bent blade.
    #[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
    pub(super) fn new(path: &ToolPath, domain: &Domain, start: f64, end: f64, profile: u32) -> Self {
        let in_cells = |p: Pose| Pose { position: domain.to_grid(p.position), ..p };
        let motion = path.motion(start, end);
        let motion = Motion { start: in_cells(motion.start), end: in_cells(motion.end), duration: 1.0 };
        let shape = path.tool.shape.scaled(1.0 / domain.cell_width);
        let mut points = 0;
        let mut motion = motion;
        let (radius, size) = match shape {
            ToolShape::Sphere { radius } => (radius, DVec3::ZERO),
            ToolShape::Capsule { radius, half_length } => (radius, DVec3::Y * half_length),
            ToolShape::Box { half_size } => (0.0, half_size),
            ToolShape::Blade { half_width, half_height } | ToolShape::PointedBlade { half_width, half_height } => {
                (0.0, DVec3::new(half_width, half_height, 0.0))
            }
            ToolShape::Cone { radius, half_height } => (radius, DVec3::Y * half_height),
            ToolShape::BentBlade { profile, half_height } => {
                points = profile.points().len() as u32;
                (0.0, DVec3::Y * half_height)
            }
            ToolShape::Wire { half_length } => {
                let (strip, wire) = wire(half_length, motion);
                motion = strip;
                wire
            }
        };
        let [a, b] = [motion.start.position, motion.end.position];
        let [r, s] = [motion.start, motion.end].map(|p: Pose| DMat3::from_quat(p.rotation));
        let friction = match path.tool.contact {
            Contact::Stick | Contact::Slip => 0.0,
            Contact::Separate { friction } => friction,
        };
        Self {
            end_cell: cell(b).to_array(),
            shape: shape.number(),
            end_offset: (b - cell(b).as_dvec3()).as_vec3().to_array(),
            contact: path.tool.contact.number(),
            start_cell: cell(a).to_array(),
            sheet: if path.divides() { path.sheet_id().into() } else { 0 },
            start_offset: (a - cell(a).as_dvec3()).as_vec3().to_array(),
            friction: friction as f32,
            end_rotation: columns(s),
            start_rotation: columns(r),
            turn: columns(s - r),
            travel: (b - a).as_vec3().to_array(),
            radius: radius as f32,
            size: size.as_vec3().to_array(),
            profile: profile | points << 8,
            // Plans have no tool of the greatest id.
            anchor: path.id.wrapping_add(1),
            spare: [0; 3],
        }
    }
}

/// The motion of the strip that a wire leaves behind, where the wire stands along its Y, and the strip's half
/// extents; those of a wire that leaves none hold nothing.
fn wire(half_length: f64, motion: Motion) -> (Motion, (f64, DVec3)) {
    let outline = Outline::Wire { half_length };
    let (strip, at) = Blade::new(outline, motion, 1.0).strip();
    match strip {
        Outline::Rectangle { half_width, half_height } => {
            let y = at.end.to_local(motion.end.position).y;
            (at, (y, DVec3::new(half_width, half_height, 0.0)))
        }
        Outline::Triangle { .. } | Outline::Strip { .. } | Outline::Plate { .. } | Outline::Wire { .. } => {
            (motion, (0.0, DVec3::new(half_length, -1.0, 0.0)))
        }
    }
}

/// The cell of a tool, which may be anywhere: far outside, its offset takes over.
fn cell(x: DVec3) -> IVec3 {
    x.floor().clamp(DVec3::splat(-1e6), DVec3::splat(1e6)).as_ivec3()
}

fn columns(m: DMat3) -> [[f32; 4]; 3] {
    let column = |c: DVec3| {
        let [x, y, z] = c.as_vec3().to_array();
        [x, y, z, 0.0]
    };
    [column(m.x_axis), column(m.y_axis), column(m.z_axis)]
}
