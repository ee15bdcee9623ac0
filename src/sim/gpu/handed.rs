//! What frames have handed out: surface particles and state, on the host or in a mapped buffer, with the grid
//! and time they belong to.

use super::super::engine::{Deferred, StateLost, StatePromise};
use super::super::frame::{SurfaceParticle, SurfaceSource};
use super::super::material::ClayMaterial;
use super::super::params::Domain;
use super::super::snapshot::{Forecast, Particle, Snapshot};
use super::readback::Readback;
use super::report::surface_particle;
use std::sync::Arc;

/// The clay at the end of a frame.
#[derive(Debug)]
pub(super) struct Ended {
    pub domain: Domain,
    pub material: ClayMaterial,
    pub time: f64,
    /// How many frames had been reported by then.
    pub frame: usize,
    /// What the next two frames count on.
    pub forecasts: [Forecast; 2],
    pub held: Held,
}

/// Where its particles are.
#[derive(Debug)]
pub(super) enum Held {
    Loaded(Vec<Particle>),
    Device(Readback),
    /// Read back, and changed since.
    Found {
        records: Vec<Particle>,
        surface: Vec<SurfaceParticle>,
    },
}

impl Held {
    /// The staging, for another frame.
    pub(super) fn recycled(self) -> Option<Readback> {
        match self {
            Self::Device(readback) => Some(readback.recycle()),
            Self::Loaded(_) | Self::Found { .. } => None,
        }
    }
}

impl Ended {
    pub(super) fn snapshot(&self) -> Result<Snapshot, StateLost> {
        let particles = match &self.held {
            Held::Loaded(records) | Held::Found { records, .. } => records.clone(),
            Held::Device(readback) => readback.records()?,
        };
        let forecasts = Some(self.forecasts);
        Ok(Snapshot { domain: self.domain, material: self.material, time: self.time, forecasts, particles })
    }

    fn surface(&self) -> Result<SurfaceSource, StateLost> {
        let particles = match &self.held {
            Held::Loaded(particles) => particles.iter().map(|p| surface_particle(p, self.domain.cell_width)).collect(),
            Held::Device(readback) => readback.surface()?,
            Held::Found { surface, .. } => surface.clone(),
        };
        Ok(SurfaceSource { domain: self.domain, particles: Arc::new(particles) })
    }
}

/// The newest of each kind; both may be of one frame.
#[derive(Clone, Debug)]
pub(super) struct Handed {
    pub surface: Arc<Ended>,
    pub state: Arc<Ended>,
}

impl Handed {
    /// Clay as loaded.
    pub(super) fn new(ended: Ended) -> Self {
        let ended = Arc::new(ended);
        Self { surface: ended.clone(), state: ended }
    }

    pub(super) fn surface_deferred(&self) -> Deferred<SurfaceSource> {
        let ended = self.surface.clone();
        Box::new(move || ended.surface())
    }

    pub(super) fn state_deferred(&self) -> Deferred<Snapshot> {
        let ended = self.state.clone();
        Box::new(move || ended.snapshot())
    }
}

/// Hands a state to everybody who asked for it.
pub(super) fn answer(state: &Arc<Ended>, promises: Vec<StatePromise>) {
    for promise in promises {
        let state = state.clone();
        promise.keep(Box::new(move || state.snapshot()));
    }
}

/// The staging of something that nobody reads any more.
pub(super) fn spare(ended: Arc<Ended>) -> Option<Readback> {
    Arc::into_inner(ended)?.held.recycled()
}

/// A copy of the state that no frame makes.
pub(super) struct Copy {
    pub material: ClayMaterial,
    pub time: f64,
    pub frame: usize,
    pub readback: Readback,
    pub forecasts: [Forecast; 2],
    pub is_submitted: bool,
    pub promises: Vec<StatePromise>,
}
