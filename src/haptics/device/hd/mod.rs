//! HDAPI, the interface of 3D Systems' libHD: what is called ([`sys`]) and how it is found ([`library`]).
//!
//! libHD is not part of this project and may not be shipped with it: it is loaded at run time if it is there.

pub mod library;
pub mod sys;
