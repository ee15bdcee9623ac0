//! What the loop of force is judged against: clays whose force is known, beds of spheres, and a whole loop of
//! hand, arm, servo and clay in virtual time.

pub mod bed;
pub mod clay;
pub mod frames;
pub mod rig;

#[cfg(test)]
mod tests;
