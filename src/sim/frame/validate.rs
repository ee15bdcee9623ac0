//! What a plan's numbers have to be.

use super::super::cut::{JOINT_SHEET, PLATE_SHEET};
use super::super::integrator::{Integrator, PASSES};
use super::super::params::ParamsError;
use super::super::tool::{ToolPath, ToolShape};
use super::super::validation::Validation;
use super::FramePlan;

impl FramePlan {
    /// Checks every number.
    ///
    /// # Errors
    /// The first parameter that is out of its range, by name.
    pub fn validate(&self) -> Result<(), ParamsError> {
        // First: a bad material makes a senseless time step.
        self.material.validate()?;
        self.validate_step()?;
        if !(self.volume_averaging.is_finite() && self.volume_averaging >= 0.0) {
            return Err(ParamsError::new("volume_averaging", self.volume_averaging, "must be a plastic strain, or 0 for none"));
        }
        if !self.gravity.is_finite() {
            return Err(ParamsError::new("gravity", self.gravity, "must be finite"));
        }
        self.tools.iter().try_for_each(|path| self.validate_tool(path))?;
        self.validate_implicit()?;
        self.validate_cutting()
    }

    fn validate_step(&self) -> Result<(), ParamsError> {
        if !(self.dt.is_finite() && self.dt > 0.0) {
            return Err(ParamsError::new("dt", self.dt, "must be a positive time step in seconds"));
        }
        // 1e-15 s keeps 1 / dt an f32; more than 1e7 substeps are hours for a handful of particles.
        if self.dt < 1e-15 {
            return Err(ParamsError::new("dt", self.dt, "must be at least 1e-15 s"));
        }
        if !(1..=10_000_000).contains(&self.steps) {
            let reason = "must be 1 to 10,000,000; a longer frame or a finer step needs more frames";
            return Err(ParamsError::new("steps", self.steps, reason));
        }
        match self.integrator {
            Integrator::Explicit { density_scale } if !(density_scale.is_finite() && density_scale >= 1.0) => {
                Err(ParamsError::new("density_scale", density_scale, "must be 1 or more"))
            }
            Integrator::Implicit { passes } if !PASSES.contains(&passes) => {
                Err(ParamsError::new("passes", passes, "must be 3 to 1000 a step: fewer find nothing"))
            }
            Integrator::Explicit { .. } | Integrator::Implicit { .. } => Ok(()),
        }
    }

    /// The implicit step has no inputs of validation cases.
    fn validate_implicit(&self) -> Result<(), ParamsError> {
        let refusal = |reason| Err(ParamsError::new("integrator", "Implicit", reason));
        match self.integrator {
            Integrator::Explicit { .. } => Ok(()),
            Integrator::Implicit { .. } if self.validation != Validation::default() => {
                refusal("takes no inputs of validation cases")
            }
            Integrator::Implicit { .. } => Ok(()),
        }
    }

    fn validate_tool(&self, path: &ToolPath) -> Result<(), ParamsError> {
        path.tool.validate()?;
        if path.samples.is_empty() || !path.is_finite() {
            let reason = "needs at least one sample, finite numbers and times in order";
            return Err(ParamsError::new("tool path", format!("tool {}", path.id), reason));
        }
        if !path.samples.iter().all(|s| s.pose.rotation.is_normalized()) {
            return Err(ParamsError::new("tool path", format!("tool {}", path.id), "needs rotations of length 1"));
        }
        if path.id == u32::MAX {
            return Err(ParamsError::new("tool id", path.id, "must be less than 4294967295, which stands for no tool"));
        }
        let is_box = matches!(path.tool.shape, ToolShape::Box { .. });
        if path.sheet >= JOINT_SHEET && !(is_box && path.sheet >= PLATE_SHEET) {
            return Err(ParamsError::new(
                "sheet",
                path.sheet,
                "must be less than 239 but of a box, or 240 and more of one: a plate",
            ));
        }
        let is_rival = |p: &&ToolPath| p.id == path.id || (p.divides() && path.divides() && p.sheet_id() == path.sheet_id());
        if self.tools.iter().filter(is_rival).count() > 1 {
            let reason = "must be another than every other tool's, and each blade and plate needs a sheet of its own (a blade's \
                by default the id's, from 1 to 238 and around)";
            return Err(ParamsError::new("tool id", path.id, reason));
        }
        Ok(())
    }

    /// Methods kept for comparison know no wires and no inputs of validation cases.
    fn validate_cutting(&self) -> Result<(), ParamsError> {
        let refusal = |reason| Err(ParamsError::new("cutting", format!("{:?}", self.cutting), reason));
        if self.cutting.keeps_cuts() {
            return Ok(());
        }
        if self.tools.iter().any(|path| path.tool.shape.is_wire()) {
            return refusal("is kept for comparison and knows no wires");
        }
        if let Integrator::Implicit { .. } = self.integrator {
            return refusal("is kept for comparison and has the explicit step only");
        }
        if self.validation != Validation::default() {
            return refusal("is kept for comparison and takes no inputs of validation cases");
        }
        Ok(())
    }
}
