//! Force: what a hand feels of the clay, a thousand times a second.
//!
//! | stage      | takes                          | makes                        | equation                  |
//! |------------|--------------------------------|------------------------------|---------------------------|
//! | [`model`]  | one clay frame                 | its contact with the tool    | local, of first order     |
//! | [`device`] | a device's own clock           | ticks: state in, force out   | -                         |
//! | [`safety`] | the force asked for, its age   | the force that a hand gets   | passivity observer        |
//!
//! Nothing here names the clay's engines: a frame's contact comes as a [`ContactModel`](model::ContactModel).
//! Units are SI, axes the world's (right-handed, Y up), forces those on the hand.

pub mod clock;
pub mod device;
pub mod model;
pub mod safety;
