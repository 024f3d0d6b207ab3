//! How a field is computed, and on which device.

use candle_core::{Device, Result};

use super::kernels::Dispatch;

/// A way to compute a field. All give the same numbers up to rounding.
#[derive(Clone, Debug)]
pub enum Backend {
    /// The fused kernels, on this vector unit of the CPU. The processor must have it.
    Fused(Dispatch),
    /// Plain candle ops, on any device.
    Plain(Device),
}

impl Backend {
    /// The fastest: plain ops on the best device, or the fused kernels where that is the CPU.
    ///
    /// # Errors
    /// A build with the feature `cuda` or `metal` on a machine without a usable GPU.
    pub fn best() -> Result<Self> {
        Ok(match best_device()? {
            Device::Cpu => Self::Fused(Dispatch::detect()),
            device => Self::Plain(device),
        })
    }

    /// The device of the parameters.
    pub fn device(&self) -> Device {
        match self {
            Self::Fused(_) => Device::Cpu,
            Self::Plain(device) => device.clone(),
        }
    }
}

/// The first GPU in a build with the feature `cuda` or `metal`, else the CPU.
fn best_device() -> Result<Device> {
    if cfg!(feature = "metal") {
        Device::metal_if_available(0)
    } else {
        Device::cuda_if_available(0)
    }
}
