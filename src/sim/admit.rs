//! What a snapshot's numbers have to be for an engine's indices to hold.

use super::body::BODY_MAX;
use super::params::{BLOCK, CELLS_MAX, PADDING, ParamsError};
use super::snapshot::{Forecast, Particle, Snapshot};

/// Checks what a snapshot's numbers have to be for the engine's indices to hold; returns the particles in
/// motion and the ids of those not finite.
pub(super) fn admit(snapshot: &Snapshot) -> Result<(Vec<Particle>, Vec<u32>), ParamsError> {
    snapshot.material.validate()?;
    let d = &snapshot.domain;
    let fits = |c: i32| c >= BLOCK && c % BLOCK == 0 && c <= CELLS_MAX - PADDING;
    if !(d.cell_width.is_finite() && d.cell_width > 0.0 && d.origin.is_finite() && d.cells.to_array().into_iter().all(fits)) {
        let reason = format!("cells must be multiples of {BLOCK} up to {}, the cell width positive", CELLS_MAX - PADDING);
        return Err(ParamsError::new("domain", format!("{} cells of {} m", d.cells, d.cell_width), reason));
    }
    let is_bound = |f: &Forecast| [f.reach, f.speed, f.node_mass].iter().all(|x| x.is_finite() && *x >= 0.0);
    if let Some(forecast) = snapshot.forecasts.iter().flatten().find(|f| !is_bound(f)) {
        return Err(ParamsError::new("forecasts", format!("{forecast:?}"), "must be finite and not negative"));
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
        if p.body > BODY_MAX {
            return Err(ParamsError::new("body", format!("{} (id {})", p.body, p.id), "must be 16383 at most"));
        }
        // Cell and offset as the sort needs them, whoever made the snapshot.
        let mut p = *p;
        if p.offset.iter().any(|o| !(0.0..=1.0).contains(o)) {
            p.set_grid(x);
        }
        moving.push(p);
    }
    Ok((moving, quarantined))
}
