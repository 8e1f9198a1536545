//! Whether this machine can draw at all, asked before anything is built on it.

use bevy::tasks::block_on;
use thiserror::Error;

/// No graphics adapter: nothing can be drawn here. A run without pictures works all the same.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
#[error(
    "no graphics adapter was found (on Linux install a Vulkan driver; Mesa's lavapipe, in package mesa-vulkan-drivers, \
     needs no graphics card): {reason}"
)]
pub struct NoAdapter {
    /// What the search said.
    pub reason: String,
}

/// The name of the adapter that would draw.
///
/// Bevy ends the process where there is none, so whoever opens a window or wants pictures asks here first.
///
/// # Errors
/// [`NoAdapter`] where there is none.
pub fn adapter_available() -> Result<String, NoAdapter> {
    let backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::all());
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
    match adapter {
        Ok(adapter) => Ok(adapter.get_info().name),
        Err(error) => Err(NoAdapter {
            reason: error.to_string(),
        }),
    }
}
