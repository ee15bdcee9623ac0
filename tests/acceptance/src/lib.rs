//! Acceptance cases of `bevy_clay`: the solver and the surface against closed forms, computed beside each
//! scenario, and the engines against the oracle.
//!
//! | module | what |
//! |---|---|
//! | [`lab`] | rooms, blocks of clay, a bench that runs frames of it |
//! | [`cases`] | the cases: each makes rows |
//! | [`report`] | rows, and the known misses they are judged against |
//! | [`agreement`] | an engine against the oracle, particle by particle |
//! | [`restart`] | runs stopped and replayed, against those that went on |
//! | [`data`] | results on record, docs/data/*.json |
//! | [`plot`] | pictures of figures, as SVG and PNG |
//! | [`section`] | the parts of docs/EVIDENCE.md that programs write |
//! | [`machine`] | what figures were measured on |
//! | [`say`] | lines on standard output, which may be closed or full |
//!
//! The programs are `validate` (every case, as a table and as JSON), `chart` (error against time over every
//! knob), `work_precision` (error against passes and time, explicit and implicit) and `stability_map` (where
//! a run blows up). The tests beside them run the same cases, small.

pub mod agreement;
pub mod cases;
pub mod data;
pub mod lab;
pub mod machine;
pub mod plot;
pub mod report;
pub mod restart;
pub mod say;
pub mod section;
