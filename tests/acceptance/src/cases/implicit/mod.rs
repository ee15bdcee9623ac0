//! The implicit step against the explicit one at the clay's own density, and what must not break it.
//!
//! | file      | what                                                        |
//! |-----------|-------------------------------------------------------------|
//! | `stroke`  | a tool pressed into clay, integrated in whichever way       |
//! | `compare` | how far one run is from another                             |
//! | `free`    | clay that no tool drives, integrated in whichever way         |
//! | `pressed` | strips, balls and blades: force, ways, volume, passes   |
//! | `board`   | a board on all of the clay's face, under gravity        |
//! | `pads`    | a loose block squeezed on a floor without friction           |
//! | `rest`    | tools held and taken away, own weight, flight, landing      |
//! | `stops`   | a ball that stops at once                                   |
//! | `several` | mirrors, two tools, sheets, debris, determinism             |
//! | `planned` | clay whose frames a planner plans                           |
//! | `scenes`  | scenes drawn by lot                                         |

mod board;
mod compare;
mod free;
mod pads;
mod planned;
mod pressed;
mod rest;
mod scenes;
mod several;
mod stops;
mod stroke;

pub use board::boards;
pub use compare::Reference;
pub use free::{Free, Loose};
pub use pads::pads;
pub use pressed::{BUDGETS, Budget, balls, blades, presets, strips};
pub use rest::{held, landings, released, self_weight, tossed_block, unloading};
pub use scenes::scenes;
pub use several::{determinism, mirrored, sparse};
pub use stops::stops;
pub use stroke::{Pace, Pressed, SAMPLE, Sample, Shape, Stroke, Way, frame_travel};
