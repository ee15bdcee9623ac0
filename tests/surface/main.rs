//! The surface as a whole: topology against the node oracle, cuts, accuracy on a sphere, clusters, time.

#[path = "../../examples/validate/surface/clay.rs"]
mod clay;
#[path = "../../examples/gallery/clusters.rs"]
mod clusters;
mod cuts;
mod fields;
mod files;
mod lips;
mod ray;
mod sphere;
mod whole;
