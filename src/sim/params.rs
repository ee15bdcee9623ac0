//! Where the clay lives: the cell grid and its walls.
//!
//! Grid coordinates count cells: node `i` stands at `i`, cell `i` reaches from `i` to `i + 1`, world =
//! `origin + cell_width * grid`. Each wall stands on a plane of nodes, [`WALL_NODE`] nodes from the low end,
//! so that the nodes beyond it share a 4^3 block with it.

use super::variants::variants;
use glam::{DVec3, IVec3};
use serde::{Deserialize, Serialize};
use std::fmt::Display;

/// Cells along one edge of a block, the unit of storage and of scheduling.
pub const BLOCK: i32 = 4;
/// Node index of the low walls: one block of padding, then local index 1, so that nodes `w - 1, w, w + 1`
/// share a block.
pub const WALL_NODE: i32 = BLOCK + 1;
/// Cells the grid has beyond the clay's room: `WALL_NODE` below and the rest of two blocks above.
pub const PADDING: i32 = 3 * BLOCK;
/// The largest grid edge \[cells\]; the block table of a 1024^3 grid takes 64 MiB.
pub const CELLS_MAX: i32 = 1024;

/// What stands at one face of the domain. Clay moves freely up to it: slip and stick hold clay from when it
/// has arrived ([`arrival`](super::penalty::arrival)) until it is 1.5 cells away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Wall {
    /// Frictionless mirror: normal velocity reversed in the nodes beyond it, zero on the wall (second order;
    /// clamped walls do not converge).
    Slip,
    /// No slip: all velocity components reversed in the nodes beyond it, zero on the wall.
    Stick,
    /// Frictionless against each particle that touches it, as solid tools are: clay can leave.
    #[default]
    Separate,
}

variants! {
    /// Every wall.
    Wall: Slip, Stick, Separate
}

/// The six walls, low and high along each axis. By number they are the low ones along x, y, z, then the high
/// ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Walls {
    /// At the least x, y (the floor) and z.
    pub low: [Wall; 3],
    /// At the greatest x, y and z.
    pub high: [Wall; 3],
}

/// The room of the clay: a grid of cubic cells between six walls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Domain {
    /// World position of grid coordinate 0 \[m\].
    pub origin: DVec3,
    /// Cell width dx \[m\].
    pub cell_width: f64,
    /// Cells between the walls along each axis, a multiple of [`BLOCK`].
    pub cells: IVec3,
    /// What stands at each face.
    pub walls: Walls,
}

/// A parameter that cannot be used, by name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value}: {reason}")]
#[non_exhaustive]
pub struct ParamsError {
    /// The parameter.
    pub name: &'static str,
    /// Its value as given.
    pub value: String,
    /// What it has to be.
    pub reason: String,
}

impl ParamsError {
    /// An error about `name`. A value of many digits or letters is shown short, on one line.
    pub fn new(name: &'static str, value: impl Display, reason: impl Into<String>) -> Self {
        /// Letters of a value that are shown.
        const LONG: usize = 60;
        /// Letters of a number: all its digits and no rows of zeros.
        const LONG_NUMBER: usize = 24;
        let mut value = value.to_string().replace(char::is_control, " ");
        match value.parse::<f64>() {
            Ok(number) if value.len() > LONG_NUMBER => value = format!("{number:e}"),
            _ if value.chars().nth(LONG).is_some() => value = value.chars().take(LONG).chain("...".chars()).collect(),
            _ => {}
        }
        Self { name, value, reason: reason.into() }
    }
}

/// The values that a quantity may have. Finite numbers beyond them are slips of the pen that would stop a run
/// midway, or keep it busy for ever.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least.
    pub low: f64,
    /// The greatest.
    pub high: f64,
    /// What the quantity has to be.
    what: &'static str,
    /// Its unit.
    unit: &'static str,
    /// What lies at the bounds.
    why: &'static str,
}

impl Bounds {
    /// From `low` to `high` [`unit`], for the reason `why`; `what` a value has to be, in words that go before
    /// its bounds.
    pub const fn new(low: f64, high: f64, unit: &'static str, what: &'static str, why: &'static str) -> Self {
        Self { low, high, what, unit, why }
    }

    /// Checks a value.
    ///
    /// # Errors
    /// A value out of the bounds or not a number, by `name`.
    pub fn check(&self, name: &'static str, value: f64) -> Result<(), ParamsError> {
        let Self { low, high, what, unit, why } = *self;
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(ParamsError::new(name, value, format!("{what}, {low:e} to {high:e}{unit}: {why}")))
    }

    /// Checks a value of either sign against the greatest value.
    ///
    /// # Errors
    /// A value beyond it or not a number, by `name`.
    pub fn check_signed(&self, name: &'static str, value: f64) -> Result<(), ParamsError> {
        let Self { high, unit, why, .. } = *self;
        // A NaN is in no range.
        if (-high..=high).contains(&value) {
            return Ok(());
        }
        Err(ParamsError::new(name, value, format!("must be finite, -{high:e} to {high:e}{unit}: {why}")))
    }

    /// Checks each coordinate of a vector, which may point anywhere, against the greatest value.
    ///
    /// # Errors
    /// A coordinate beyond it or not a number, by `name`.
    pub fn check_vector(&self, name: &'static str, vector: DVec3) -> Result<(), ParamsError> {
        let Self { high, unit, why, .. } = *self;
        // A NaN is in no range.
        if vector.to_array().into_iter().all(|x| (-high..=high).contains(&x)) {
            return Ok(());
        }
        Err(ParamsError::new(name, vector, format!("must be finite and within {high:e}{unit} of 0 along each axis: {why}")))
    }
}

/// Lengths and distances from the origin. The sheets that a clay's grains are stacks of are 1 nm thick.
pub const LENGTH: Bounds = Bounds::new(
    1e-9,
    1e4,
    " m",
    "must be a positive length in metres",
    "farther out f32, which mesh files hold, does not tell 1 mm apart",
);

/// Times. In the least, light goes 0.3 mm; the greatest is eleven days.
pub const TIME: Bounds =
    Bounds::new(1e-12, 1e6, " s", "must be a positive time in seconds", "eleven days of clay are more than any run ends in");

/// Gravity. Ten thousand times the Earth's, where geotechnical centrifuges end at 500.
pub const GRAVITY: Bounds = Bounds::new(0.0, 1e5, " m/s^2", "must be finite", "ten thousand times the Earth's");

/// Speeds of tools: twice that of sound in steel.
pub const SPEED: Bounds = Bounds::new(0.0, 1e4, " m/s", "must be a speed", "twice that of sound in steel");

impl Domain {
    /// The domain that holds the box `low`..`high` \[m\]; its walls stand at `low` and at `low` + whole blocks
    /// of cells, at or beyond `high`.
    ///
    /// # Errors
    /// A cell width that is not finite and positive, an empty or non-finite box, or more than [`CELLS_MAX`]
    /// cells along an axis.
    pub fn new(low: DVec3, high: DVec3, cell_width: f64, walls: Walls) -> Result<Self, ParamsError> {
        if !(cell_width.is_finite() && cell_width > 0.0) {
            return Err(ParamsError::new("cell_width", cell_width, "must be a positive length in metres"));
        }
        if !(low.is_finite() && high.is_finite() && (high - low).min_element() > 0.0) {
            return Err(ParamsError::new("domain", format!("{low} .. {high}"), "must be a finite box with low < high"));
        }
        // An extent given as a whole number of cells must not gain a block by rounding: 1e-9 of a block is
        // far below f64 noise of extents.
        let blocks = ((high - low) / (cell_width * f64::from(BLOCK)) - 1e-9).ceil().max(DVec3::ONE);
        if blocks.max_element() * f64::from(BLOCK) + f64::from(PADDING) > f64::from(CELLS_MAX) {
            let fits = (high - low).max_element() / f64::from(CELLS_MAX - PADDING);
            return Err(ParamsError::new(
                "cell_width",
                cell_width,
                format!(
                    "gives more than {CELLS_MAX} cells along an axis; the smallest cell width for this domain is {fits:.3e} m"
                ),
            ));
        }
        let cells = blocks.as_ivec3() * BLOCK;
        Ok(Self { origin: low - cell_width * f64::from(WALL_NODE), cell_width, cells, walls })
    }

    /// Cells of the whole grid along each axis, padding included, a multiple of [`BLOCK`].
    pub fn grid_cells(&self) -> IVec3 {
        self.cells + PADDING
    }

    /// Blocks of the whole grid along each axis.
    pub fn blocks(&self) -> IVec3 {
        self.grid_cells() / BLOCK
    }

    /// Node indices of the low and high wall along each axis.
    pub fn wall_nodes(&self) -> (IVec3, IVec3) {
        (IVec3::splat(WALL_NODE), self.cells + WALL_NODE)
    }

    /// World positions of the low and high corners of the room \[m\].
    pub fn corners(&self) -> (DVec3, DVec3) {
        let (low, high) = self.wall_nodes();
        (self.to_world(low.as_dvec3()), self.to_world(high.as_dvec3()))
    }

    /// World position \[m\] -> grid coordinate \[cells\].
    pub fn to_grid(&self, world: DVec3) -> DVec3 {
        (world - self.origin) / self.cell_width
    }

    /// Grid coordinate \[cells\] -> world position \[m\].
    pub fn to_world(&self, grid: DVec3) -> DVec3 {
        self.origin + self.cell_width * grid
    }
}
