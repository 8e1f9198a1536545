//! The adapter: opened once, and every failure of it caught, since what is not caught ends the process.

use std::panic::{self, AssertUnwindSafe};
use std::sync::{Arc, Mutex, PoisonError, mpsc};

use pollster::block_on;

use crate::GpuError;

/// Storage buffers that the shader has.
const STORAGE_BUFFERS: u32 = 10;

/// A graphics processor to compute on. Clones share the device.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) program: Arc<Program>,
    adapter: String,
    failure: Arc<Mutex<Option<String>>>,
}

/// The shader, ready to run.
#[derive(Debug)]
pub(crate) struct Program {
    /// What a tissue has, where its places are read and written, kicks.
    pub groups: [wgpu::BindGroupLayout; 3],
    pub substep: wgpu::ComputePipeline,
    pub finish: wgpu::ComputePipeline,
}

impl Gpu {
    /// Opens the fastest adapter that there is, of a vendor or in software; `WGPU_BACKEND` in the environment narrows the
    /// choice. The device is one of our own, beside any that draws.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`] where there is none, [`GpuError::Limit`] or [`GpuError::Failed`] where it cannot run the
    /// shader.
    pub fn open() -> Result<Gpu, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::from_env().unwrap_or(wgpu::Backends::all()),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        }));
        let adapter = adapter.map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        let limits = adapter.limits();
        let needed = [
            (
                "max_storage_buffers_per_shader_stage",
                STORAGE_BUFFERS,
                limits.max_storage_buffers_per_shader_stage,
            ),
            (
                "max_compute_invocations_per_workgroup",
                crate::layout::SLICE as u32,
                limits.max_compute_invocations_per_workgroup,
            ),
        ];
        for (limit, needed, allowed) in needed {
            check_limit(limit, needed.into(), allowed.into())?;
        }
        // All that it has: tissue is limited by memory, not by what every browser grants.
        let opened = block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: limits,
            ..wgpu::DeviceDescriptor::default()
        }));
        let (device, queue) = opened.map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        let failure: Arc<Mutex<Option<String>>> = Arc::default();
        let heard = failure.clone();
        device.on_uncaptured_error(Arc::new(move |error| note(&heard, error.to_string())));
        let heard = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping a device counts as losing it.
            note(&heard, format!("device lost ({reason:?}): {message}"));
        });
        let program = Arc::new(Program::new(&device));
        let gpu = Gpu {
            device,
            queue,
            program,
            adapter: adapter.get_info().name,
            failure,
        };
        gpu.check()?;
        Ok(gpu)
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Whether all has gone well so far. A device that has failed stays so.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match &*failure {
            None => Ok(()),
            Some(failure) => Err(GpuError::Failed(failure.clone())),
        }
    }

    /// Waits for all that has been submitted, and reads a buffer that can be mapped.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        self.check()?;
        let (tell, hear) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
            // Nobody listens any more where waiting has failed.
            let _ = tell.send(mapped);
        });
        // wgpu panics where a device is lost while it is waited for.
        let waiting = AssertUnwindSafe(|| self.device.poll(wgpu::PollType::wait_indefinitely()));
        match panic::catch_unwind(waiting) {
            Ok(Ok(_)) => {}
            Ok(Err(error)) => return Err(GpuError::Failed(error.to_string())),
            Err(_) => return Err(GpuError::Failed("device lost while waiting for it".into())),
        }
        self.check()?;
        match hear.try_recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(GpuError::Failed(error.to_string())),
            Err(error) => return Err(GpuError::Failed(error.to_string())),
        }
        let bytes = buffer.get_mapped_range(..).to_vec();
        buffer.unmap();
        Ok(bytes)
    }
}

/// Keeps the first failure: what follows it says less.
fn note(failure: &Mutex<Option<String>>, message: String) {
    let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
    failure.get_or_insert(message);
}

/// Refuses what is beyond a limit.
pub(crate) fn check_limit(limit: &'static str, needed: u64, allowed: u64) -> Result<(), GpuError> {
    if needed <= allowed {
        return Ok(());
    }
    Err(GpuError::Limit { limit, needed, allowed })
}

impl Program {
    fn new(device: &wgpu::Device) -> Program {
        use wgpu::BufferBindingType::{Storage, Uniform};
        let (read, written) = (Storage { read_only: true }, Storage { read_only: false });
        let group = |label, bindings: &[wgpu::BufferBindingType]| {
            let entry = |(binding, ty): (u32, &wgpu::BufferBindingType)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: *ty,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            };
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &(0..).zip(bindings).map(entry).collect::<Vec<_>>(),
            })
        };
        let groups = [
            group("tissue", &[Uniform, read, read, read, read, written, written, written]),
            group("places", &[read, written]),
            group("kicks", &[read]),
        ];
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("substep"),
            bind_group_layouts: &groups.each_ref().map(Some),
            immediate_size: 0,
        });
        let module = device.create_shader_module(wgpu::include_wgsl!("substep.wgsl"));
        let pipeline = |entry_point| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        Program {
            substep: pipeline("substep"),
            finish: pipeline("finish"),
            groups,
        }
    }
}
