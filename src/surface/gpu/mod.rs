//! The surface on the GPU: the same fields, the same rules, the same mesh, by compute passes into buffers
//! that are given.
//!
//! | file       | does                                                                     |
//! |------------|--------------------------------------------------------------------------|
//! | `surface`  | the compiled passes; a surface and its buffers                           |
//! | `encode`   | the order of the passes, once                                            |
//! | `wgsl`     | the passes: one text each in `pass`, with the shared parts beside it     |
//! | `layout`   | Rust twins of the WGSL structs                                           |
//! | `buffers`  | buffers, what is bound where, room                                       |
//! | `readback` | the status back on the host, without waiting                             |
//! | `field`    | fields to and from the device: for tests                                 |
//!
//! Only what has changed is extracted. Each block of 8^3 nodes keeps the values that its mesh was made of,
//! until some value in it has changed by 1 % of the inside's; then it and the neighbours that see a change
//! are extracted anew, each in its own region of the buffers, and the rest stays where it is. So the mesh is
//! that of one field, whose blocks are up to 1 % old, and as closed as any; no bit of it changes while the
//! clay is at rest, which costs its fields alone. A block that outgrows its region gets one behind all
//! others; once these take twice what is needed, all blocks are laid out anew. Between the regions are
//! triangles without size.
//!
//! Sums are in fixed point, and slots and regions are dealt by prefix sums, so runs repeat bit by bit.
//!
//! Vertices are 7 words: place \[m\], normal, and the number of their edge and variant. Those on the faces of
//! blocks of 8^3 nodes stand in each block that has them, with the same place, normal and number: so the mesh
//! is closed to the eye and can be merged by number, in rooms of up to 290 cells a side (580 with nodes every
//! cell): beyond that numbers repeat. Behind them come, if asked for, balls for the particles that the
//! surface does not show, in the order of the particles, with numbers from 2^31 on.

mod buffers;
mod encode;
mod field;
mod layout;
mod readback;
mod surface;
mod wgsl;

pub use buffers::SurfaceRoom;
pub use encode::MeshTarget;
pub use layout::{SurfaceStatus, VERTEX_WORDS, flag};
pub use readback::StatusReadback;
pub use surface::{GpuSurface, SurfaceKernels};
