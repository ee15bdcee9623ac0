//! One compute pass, ready to run: made from its text alone.

use super::label::label;

/// A pipeline and what it binds.
#[derive(Debug)]
pub(crate) struct Kernel {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) bindings: Vec<Binding>,
}

/// A buffer that a text binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Binding {
    pub(crate) index: u32,
    pub(crate) is_uniform: bool,
    pub(crate) is_read_only: bool,
}

/// The bindings that `text` declares, in its order.
pub(crate) fn bindings(text: &str) -> Vec<Binding> {
    let declaration = |line: &str| {
        let after = line.strip_prefix("@group(0) @binding(")?;
        let (index, rest) = after.split_once(')')?;
        Some(Binding {
            index: index.parse().ok()?,
            is_uniform: rest.contains("var<uniform>"),
            is_read_only: rest.contains("var<storage, read>"),
        })
    };
    text.lines().filter_map(declaration).collect()
}

impl Kernel {
    /// Compiles `text`, whose entry point is `name`.
    pub(crate) fn new(device: &wgpu::Device, name: &str, text: String) -> Self {
        let label = label(name);
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
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { pipeline, layout, bindings }
    }
}
