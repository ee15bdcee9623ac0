//! The CPU engine: rayon over 4^3 blocks, eight lanes, AVX2 + FMA or SSE2 found at run time; the same bits at any number of threads.
//!
//! | file       | does                                                                        |
//! |------------|-----------------------------------------------------------------------------|
//! | `solver`   | the frame: substep loop, redo, report                                       |
//! | `state`    | particles in block order, the sort                                          |
//! | `passes`   | particle passes over blocks: gather, tags, scatter                          |
//! | `kernel`   | gather, law, scatter of one block, in lanes (`simd`, `law`)                 |
//! | `tags`     | sides of the blade                                                          |
//! | `grid`     | node sums and update; `special` where walls, tools and cuts meet            |
//! | `contact`  | tools in cells and substeps                                                 |
//! | `stats`    | sums for the report                                                         |

mod contact;
mod grid;
mod kernel;
mod law;
mod passes;
mod simd;
mod solver;
mod special;
mod state;
mod stats;
mod tags;

use super::engine::{Engine, EngineError, FramePlan, FrameReport, SurfaceParticle, SurfaceSource};
use super::params::{BLOCK, CELLS_MAX, Domain, PADDING, ParamsError};
use super::snapshot::{Particle, Snapshot};
use rayon::prelude::*;
use solver::{FrameState, Solver};
use state::unpack_cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

/// Frames that may be under way.
const PENDING_MAX: usize = 2;

/// The CPU engine. Frames run on a thread of its own, in a pool of as many threads as asked for.
pub struct NativeEngine {
    threads: usize,
    loaded: Option<Loaded>,
}

struct Loaded {
    domain: Domain,
    plans: Sender<FramePlan>,
    done: Receiver<(FrameReport, Arc<FrameState>)>,
    stop: Arc<AtomicBool>,
    pending: usize,
    latest: Arc<FrameState>,
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // The thread ends by itself within a substep; nobody waits for it.
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Default for NativeEngine {
    fn default() -> Self {
        Self::new()
    }
}

impl NativeEngine {
    /// An engine on all cores.
    pub fn new() -> Self {
        Self::with_threads(0)
    }

    /// An engine on `threads` cores, 0 for all.
    pub fn with_threads(threads: usize) -> Self {
        Self { threads, loaded: None }
    }

    fn loaded(&mut self) -> Result<&mut Loaded, EngineError> {
        self.loaded.as_mut().ok_or(EngineError::NotLoaded)
    }
}

/// Checks what a snapshot's numbers have to be for the engine's indices to hold; returns the particles in motion and the ids of those not finite.
fn admit(snapshot: &Snapshot) -> Result<(Vec<Particle>, Vec<u32>), ParamsError> {
    snapshot.material.validate()?;
    let d = &snapshot.domain;
    let fits = |c: i32| c >= BLOCK && c % BLOCK == 0 && c <= CELLS_MAX - PADDING;
    if !(d.cell_width.is_finite() && d.cell_width > 0.0 && d.origin.is_finite() && d.cells.to_array().into_iter().all(fits)) {
        let reason = format!("cells must be multiples of {BLOCK} up to {}, the cell width positive", CELLS_MAX - PADDING);
        return Err(ParamsError::new("domain", format!("{} cells of {} m", d.cells, d.cell_width), reason));
    }
    let (low, high) = d.wall_nodes();
    let (mut moving, mut quarantined) = (Vec::with_capacity(snapshot.particles.len()), vec![]);
    for p in &snapshot.particles {
        if !p.is_finite() {
            quarantined.push(p.id);
            continue;
        }
        let x = p.grid();
        if !(x.cmpge(low.as_dvec3()).all() && x.cmple(high.as_dvec3()).all()) {
            let world = d.to_world(x);
            return Err(ParamsError::new(
                "particle position",
                format!("{world} (id {})", p.id),
                "must lie between the domain's walls",
            ));
        }
        if p.rest_volume <= 0.0 {
            return Err(ParamsError::new("rest_volume", format!("{} (id {})", p.rest_volume, p.id), "must be positive"));
        }
        // Cell and offset as the sort needs them, and sides that are signs, whoever made the snapshot.
        let mut p = *p;
        if p.offset.iter().any(|o| !(0.0..=1.0).contains(o)) {
            p.set_grid(x);
        }
        p.tags.iter_mut().for_each(|t| t.side = t.side.signum());
        moving.push(p);
    }
    Ok((moving, quarantined))
}

impl Engine for NativeEngine {
    fn describe(&self) -> String {
        let threads = if self.threads == 0 { rayon::current_num_threads() } else { self.threads };
        let kind = if kernel::has_fma() { "AVX2 + FMA" } else { "8 lanes" };
        format!("native CPU engine, {threads} threads, {kind}")
    }

    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError> {
        let (particles, quarantined) = admit(snapshot)?;
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().map_err(|e| EngineError::Stopped(e.to_string()))?;
        let (hot, cold) = state::convert(&snapshot.domain, &particles);
        let latest = Arc::new(FrameState { hot, cold, time: snapshot.time, material: snapshot.material });
        let (plans, todo) = channel::<FramePlan>();
        let (finished, done) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let (domain, material, time, stopped) = (snapshot.domain, snapshot.material, snapshot.time, stop.clone());
        let run = move || {
            let mut solver = pool.install(|| Solver::new(domain, material, time, &particles, quarantined));
            drop(particles);
            while let Ok(plan) = todo.recv() {
                let Some(report) = pool.install(|| solver.run(&plan, &stopped)) else { return };
                if finished.send((report, solver.frame_state())).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("clay".into()).spawn(run).map_err(|e| EngineError::Stopped(e.to_string()))?;
        self.loaded = Some(Loaded { domain, plans, done, stop, pending: 0, latest });
        Ok(())
    }

    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError> {
        plan.validate()?;
        let loaded = self.loaded()?;
        if loaded.pending >= PENDING_MAX {
            return Err(EngineError::Busy(loaded.pending));
        }
        loaded.plans.send(plan).map_err(|_| EngineError::Stopped("its thread has ended".into()))?;
        loaded.pending += 1;
        Ok(())
    }

    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
        let loaded = self.loaded()?;
        match loaded.done.try_recv() {
            Ok((report, state)) => {
                loaded.pending -= 1;
                loaded.latest = state;
                Ok(Some(report))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(EngineError::Stopped("its thread has ended".into())),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the surface is f32")]
    fn surface(&self) -> Option<SurfaceSource> {
        let loaded = self.loaded.as_ref()?;
        let state = &loaded.latest;
        let point = |(h, c): (&state::Hot, &state::Cold)| {
            let cell = unpack_cell(h.cell);
            SurfaceParticle {
                position: std::array::from_fn(|d| cell[d] as f32 + h.offset[d]),
                volume_ratio: Particle { elastic_strain: h.strain, ..Particle::default() }.volume_ratio() as f32,
                density_weight: h.mass / 8.0,
                tags: u32::from_le_bytes([
                    c.tags[0].sheet,
                    c.tags[0].side.cast_unsigned(),
                    c.tags[1].sheet,
                    c.tags[1].side.cast_unsigned(),
                ]),
            }
        };
        let particles = state.hot.par_iter().zip(&state.cold).map(point).collect();
        Some(SurfaceSource { domain: loaded.domain, particles: Arc::new(particles) })
    }

    fn save(&self) -> Result<Snapshot, EngineError> {
        let loaded = self.loaded.as_ref().ok_or(EngineError::NotLoaded)?;
        let state = &loaded.latest;
        let particles = state.hot.iter().zip(&state.cold).map(|(h, c)| state::particle(h, c)).collect();
        Ok(Snapshot { domain: loaded.domain, material: state.material, time: state.time, particles })
    }

    fn pending(&self) -> usize {
        self.loaded.as_ref().map_or(0, |l| l.pending)
    }
}
