//! The surface as a whole: topology against the node oracle, cuts, accuracy on a sphere, clusters.

mod bodies;
mod cuts;
mod fields;
mod files;
mod lips;
mod ray;
mod rims;
mod sphere;
mod whole;
