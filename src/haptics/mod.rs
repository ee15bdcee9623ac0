//! Force: what a hand feels of the clay, a thousand times a second.
//!
//! | stage      | takes                       | makes                                  | equation         |
//! |------------|-----------------------------|----------------------------------------|------------------|
//! | [`model`]  | one clay frame              | its contact, for the loop of the hand  | local            |
//! | [`touch`]  | a tool's touch in a report  | that contact, its stiffness put right  | least squares    |
//! | [`proxy`]  | spheres of tool and clay    | the nearest place outside the clay     | Eq. 6-7          |
//! | [`servo`]  | contact and the hand's pose | force, and the way of the clay's tool  | Eq. 8 and others |
//! | [`device`] | a device's own clock        | ticks: state in, force out             | -                |
//! | [`safety`] | the force asked for, its age | the force that a hand gets             | passivity        |
//!
//! Nothing here names the clay's engines: a frame's contact comes as a [`ContactModel`](model::ContactModel),
//! which [`touch`] makes from a report of any of them.
//! Units are SI, axes the world's (right-handed, Y up), forces those on the hand.

pub mod arm_tool;
pub mod clock;
pub mod device;
pub mod guarded;
pub mod model;
pub mod priority;
pub mod proxy;
#[cfg(any(test, feature = "reference"))]
pub mod reference;
pub mod safety;
pub mod servo;
pub mod touch;
pub mod virtual_hand;
pub mod virtual_loop;

/// Tests that nothing is allocated in a tick end where something is.
#[cfg(test)]
#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;
