//! Pipelines, made once a device.

use super::device::{GpuError, guarded};
use super::pass::{Id, PASSES};
use super::wgsl::{Binding, CLASSES, bindings, compose};
use std::sync::OnceLock;

/// A pass ready to run.
#[derive(Debug)]
pub(super) struct Kernel {
    pub pipeline: wgpu::ComputePipeline,
    pub layout: wgpu::BindGroupLayout,
    pub bindings: Vec<Binding>,
}

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
    let text = compose(pass, classes);
    let label = format!("clay:{}", pass.name);
    let bindings = bindings(&text);
    let entry = |b: &Binding| wgpu::BindGroupLayoutEntry {
        binding: b.index,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: if b.is_uniform {
                wgpu::BufferBindingType::Uniform
            } else {
                wgpu::BufferBindingType::Storage { read_only: b.is_read_only }
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = bindings.iter().map(entry).collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&label), entries: &entries });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&label),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(&label),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(&label),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some(pass.name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    Kernel { pipeline, layout, bindings }
}
