//! Scene files, mesh files in and out, clay filled from meshes.
//!
//! A scene is a RON file. [`ClayScene::load`](file::ClayScene::load) reads it,
//! [`ClayScene::build`](file::ClayScene::build) makes the engine's snapshot of it and says what tools do in
//! each frame. Data flows through the files in this order:
//!
//! | file        | takes                   | makes                                                      |
//! |-------------|-------------------------|------------------------------------------------------------|
//! | [`mod@line`] | words of others         | one short line of a message                                |
//! | `text`      | a file                  | its bytes, RON with place and field of what is wrong       |
//! | [`stamp`]   | a path                  | what tells that the file there has changed                 |
//! | `check`     | a value                 | the same value, or an error that names its field           |
//! | [`mod@file`] | RON text                | [`ClayScene`](file::ClayScene), every value checked        |
//! | [`clay`]    | `*.clay.ron`            | [`ClayFile`](clay::ClayFile), a material, units read       |
//! | [`track`]   | keyframes               | tool paths of a frame                                      |
//! | [`placement`]| `*.placement.ron`     | where a haptic arm stands                                  |
//! | [`import`]  | OBJ, STL, PLY, glTF     | merged triangles                                           |
//! | [`winding`] | triangles               | generalized winding number                                 |
//! | [`solid`]   | boxes, balls, meshes    | inside tests, volumes                                      |
//! | [`fill`]    | solids                  | particles whose volumes sum up to the solids'              |
//! | [`build`]   | scene                   | snapshot, warnings, frame plans                            |
//! | [`hand`]    | scene, frame reports    | a tool led by an arm, what its hand felt                   |
//! | [`resample`]| snapshot, cell width    | the same clay on another grid                              |
//! | [`pieces`]  | snapshot                | which particles hold together; the clay without offcuts    |
//! | [`history`] | snapshots, by strokes   | those before, undone and redone to the bit                 |
//! | [`export`]  | surface, snapshot       | bodies in STL, PLY, OBJ, 3MF, GLB; particles in PLY        |
//! | [`recording`]| a run                  | a file of it; events of such a file                        |
//! | [`error`]   | whatever went wrong     | one line that names file, line and field                   |

pub mod build;
mod check;
pub mod clay;
pub mod error;
pub mod export;
pub mod file;
pub mod fill;
pub mod hand;
pub mod history;
pub mod import;
pub mod line;
pub mod pieces;
pub mod placement;
pub mod recording;
pub mod resample;
pub mod solid;
pub mod stamp;
mod text;
pub mod track;
pub mod winding;

/// What most programs need.
pub mod prelude {
    pub use super::build::BuiltScene;
    pub use super::clay::ClayFile;
    pub use super::error::SceneError;
    pub use super::export::{
        BodyFiles, ExportError, ExportFormat, ExportOptions, ExportReport, write_bodies, write_mesh, write_particles, write_text,
    };
    pub use super::file::{Body, ClayScene, MaterialChoice, MeshBody, Outputs, Room};
    pub use super::fill::FillReport;
    pub use super::hand::SceneHand;
    pub use super::history::{History, HistoryError};
    pub use super::import::{ImportedMesh, MeshFormat};
    pub use super::pieces::Pieces;
    pub use super::placement::PlacementFile;
    pub use super::recording::{Recorder, Recording, RecordingError};
    pub use super::resample::resample;
    pub use super::stamp::FileStamp;
    pub use super::track::{AxisAngle, Grip, Keyframe, ToolTrack};
}
