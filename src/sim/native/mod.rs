//! The CPU engine: rayon over 4^3 blocks, eight lanes, AVX2 + FMA or SSE2 found at run time; the same bits at
//! any number of threads.
//!
//! | file       | does                                                                        |
//! |------------|-----------------------------------------------------------------------------|
//! | `solver`   | the frame: substep loop, redo, report                                       |
//! | `state`    | particles in block order, the sort                                          |
//! | `passes`   | particle passes over blocks: gather, tags, scatter                          |
//! | `shares`   | who does what, where threads share the same work over and over              |
//! | `step`     | the numbers of a substep, `particle_step` those with the tools about        |
//! | `kernel`   | gather, law, scatter of one block, in lanes (`simd`, `law`)                 |
//! | `averaging`| anti-locking: volumes of flowing particles                                  |
//! | `tags`     | sides of the blade                                                          |
//! | `nodes`    | the nodes of a block, and their places in the tiles about it                |
//! | `grid`     | node sums and update: `joint`, and `meeting` where walls, tools, cuts meet  |
//! | `tagged`   | tiles and sums of clay near cuts                                            |
//! | `grid_step`| the numbers of a grid update, and what it met                               |
//! | `contact`  | tools in cells and substeps; `penalty` solid ones on particles, as `walls`  |
//! | `stats`    | sums for the report                                                         |
//! | `implicit` | the implicit step                                                           |

mod about;
mod averaging;
mod carry;
mod contact;
mod ghost;
mod grid;
mod grid_step;
mod implicit;
mod joint;
mod kernel;
mod law;
mod meeting;
mod nodes;
mod particle_step;
mod passes;
mod penalty;
mod shares;
mod simd;
mod solver;
mod state;
mod stats;
mod step;
mod tagged;
mod tags;
mod touch;
mod walls;
mod weld;

use super::admit::admit;
use super::engine::{Deferred, Engine, EngineError, StateTicket};
use super::frame::{FramePlan, FrameReport, SurfaceParticle, SurfaceSource};
use super::health::Health;
use super::limits::PENDING_MAX;
use super::params::Domain;
use super::snapshot::{Particle, Snapshot};
use rayon::prelude::*;
use solver::{FrameState, Solver};
use state::unpack_cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

/// The CPU engine. Frames run on a thread of its own, in a pool of as many threads as asked for.
pub struct NativeEngine {
    threads: usize,
    loaded: Option<Loaded>,
}

struct Loaded {
    domain: Domain,
    plans: Sender<Order>,
    done: Receiver<Ended>,
    stop: Arc<AtomicBool>,
    pending: usize,
    latest: Arc<FrameState>,
    /// Failures among the reports handed out.
    failures: u64,
}

/// A plan, and how many failures were known when it was made.
struct Order {
    plan: FramePlan,
    failures: u64,
}

/// A frame that ended, and how many had failed by then.
struct Ended {
    report: FrameReport,
    state: Arc<FrameState>,
    failures: u64,
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

/// What the processor's lanes round like.
fn kind() -> &'static str {
    if simd::has_fma() { "AVX2 + FMA" } else { "8 lanes" }
}

/// What the surface needs of a particle.
#[expect(clippy::cast_possible_truncation, reason = "the surface is f32")]
fn surface_particle((hot, cold): (&state::Hot, &state::Cold)) -> SurfaceParticle {
    let cell = unpack_cell(hot.cell);
    let [first, second] = cold.tags;
    SurfaceParticle {
        position: std::array::from_fn(|d| cell[d] as f32 + hot.offset[d]),
        volume_ratio: Particle { elastic_strain: hot.strain, ..Particle::default() }.volume_ratio() as f32,
        density_weight: hot.mass / 8.0,
        tags: u32::from_le_bytes([first.sheet, first.side.cast_unsigned(), second.sheet, second.side.cast_unsigned()]),
        body: cold.body,
    }
}

impl Engine for NativeEngine {
    fn describe(&self) -> String {
        let threads = if self.threads == 0 { rayon::current_num_threads() } else { self.threads };
        format!("native CPU engine, {threads} threads, {}", kind())
    }

    /// Without the number of threads; with what comes with a mathematical library of its own.
    fn identity(&self) -> String {
        use std::env::consts::{ARCH, OS};
        format!("native CPU engine, {}, {ARCH}, {OS}", kind())
    }

    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError> {
        let (particles, quarantined) = admit(snapshot)?;
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().map_err(|e| EngineError::Stopped(e.to_string()))?;
        let (hot, cold) = state::convert(&snapshot.domain, &particles);
        let latest = Arc::new(FrameState { hot, cold, time: snapshot.time, material: snapshot.material });
        let (plans, todo) = channel::<Order>();
        let (finished, done) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let (domain, material, time, stopped) = (snapshot.domain, snapshot.material, snapshot.time, stop.clone());
        let run = move || {
            let mut solver = pool.install(|| Solver::new(domain, material, time, &particles, quarantined));
            drop(particles);
            let mut failures = 0;
            while let Ok(order) = todo.recv() {
                // A plan for a state that never came would let its tools jump over the frame that failed.
                let report = if order.failures < failures {
                    solver.give_up(&order.plan)
                } else {
                    let Some(report) = pool.install(|| solver.run(&order.plan, &stopped)) else { return };
                    failures += u64::from(report.health.contains(Health::GIVEN_UP));
                    report
                };
                if finished.send(Ended { report, state: solver.frame_state(), failures }).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("clay".into()).spawn(run).map_err(|e| EngineError::Stopped(e.to_string()))?;
        self.loaded = Some(Loaded { domain, plans, done, stop, pending: 0, latest, failures: 0 });
        Ok(())
    }

    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError> {
        plan.validate()?;
        let loaded = self.loaded()?;
        if loaded.pending >= PENDING_MAX {
            return Err(EngineError::Busy(loaded.pending));
        }
        let order = Order { plan, failures: loaded.failures };
        loaded.plans.send(order).map_err(|_| EngineError::Stopped("its thread has ended".into()))?;
        loaded.pending += 1;
        Ok(())
    }

    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
        let loaded = self.loaded()?;
        match loaded.done.try_recv() {
            Ok(ended) => {
                loaded.pending -= 1;
                loaded.latest = ended.state;
                loaded.failures = ended.failures;
                Ok(Some(ended.report))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(EngineError::Stopped("its thread has ended".into())),
        }
    }

    fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
        let loaded = self.loaded.as_ref()?;
        let (state, domain) = (loaded.latest.clone(), loaded.domain);
        Some(Box::new(move || {
            let particles = state.hot.par_iter().zip(&state.cold).map(surface_particle).collect();
            Ok(SurfaceSource { domain, particles: Arc::new(particles) })
        }))
    }

    fn state_deferred(&self) -> Result<Deferred<Snapshot>, EngineError> {
        let loaded = self.loaded.as_ref().ok_or(EngineError::NotLoaded)?;
        let (state, domain) = (loaded.latest.clone(), loaded.domain);
        Ok(Box::new(move || {
            let particles = state.hot.iter().zip(&state.cold).map(|(h, c)| state::particle(h, c)).collect();
            Ok(Snapshot { time: state.time, ..Snapshot::new(domain, state.material, particles) })
        }))
    }

    fn request_state(&mut self) -> Result<StateTicket, EngineError> {
        // The frame's end is shared with the engine's thread: nothing has to be copied first.
        let state = self.state_deferred()?;
        let (promise, ticket) = StateTicket::new();
        promise.keep(state);
        Ok(ticket)
    }

    fn pending(&self) -> usize {
        self.loaded.as_ref().map_or(0, |l| l.pending)
    }
}
