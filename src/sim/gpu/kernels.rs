//! Pipelines, made once a device.

use super::device::{GpuError, guarded};
use super::kernel::Kernel;
use super::pass::{Id, PASSES};
use super::wgsl::{CLASSES, compose};
use std::sync::OnceLock;

/// The passes for each of [`CLASSES`], compiled when they are first asked for.
#[derive(Debug)]
pub(super) struct KernelSets {
    device: wgpu::Device,
    sets: [OnceLock<Kernels>; CLASSES.len()],
}

impl KernelSets {
    /// Compiles those of clay with at most one cut in one place; seconds on software adapters.
    ///
    /// # Errors
    /// What the device refused.
    pub(super) fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let sets = Self { device: device.clone(), sets: Default::default() };
        sets.get(CLASSES[0])?;
        sets.get(CLASSES[1])?;
        Ok(sets)
    }

    /// The passes for at least so many classes.
    ///
    /// # Errors
    /// What the device refused.
    pub(super) fn get(&self, classes: u32) -> Result<&Kernels, GpuError> {
        let index = CLASSES.iter().position(|c| *c >= classes).unwrap_or(CLASSES.len() - 1);
        if let Some(kernels) = self.sets[index].get() {
            return Ok(kernels);
        }
        let compiled = Kernels::new(&self.device, CLASSES[index])?;
        Ok(self.sets[index].get_or_init(|| compiled))
    }
}

/// The passes for clay of so many classes.
#[derive(Debug)]
pub(super) struct Kernels {
    pub classes: u32,
    kernels: Vec<Option<Kernel>>,
}

impl Kernels {
    /// Compiles all passes; seconds on software adapters.
    ///
    /// # Errors
    /// What the device refused.
    fn new(device: &wgpu::Device, classes: u32) -> Result<Self, GpuError> {
        let compile = |pass: &super::pass::Pass| {
            let is_needed = classes > 1 || !pass.is_for_cuts;
            is_needed.then(|| guarded(device, &format!("pass {}", pass.name), || kernel(device, pass, classes))).transpose()
        };
        Ok(Self { classes, kernels: PASSES.iter().map(compile).collect::<Result<_, _>>()? })
    }

    /// A pass, if clay of this kind has it.
    pub(super) fn get(&self, id: Id) -> Option<&Kernel> {
        self.kernels[id as usize].as_ref()
    }
}

fn kernel(device: &wgpu::Device, pass: &super::pass::Pass, classes: u32) -> Kernel {
    Kernel::new(device, pass.name, compose(pass, classes))
}
