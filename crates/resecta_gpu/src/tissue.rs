//! A tissue that moves on a graphics processor.

use glam::DVec3;
use resecta_solver::{StepReport, Tissue};

use crate::motion::Motion;
use crate::{Gpu, GpuError};

/// A tissue that moves on a graphics processor.
///
/// It keeps a [`Tissue`] of its own, which divides time, judges the stability bound and takes over a stretch of substeps
/// whose motion outran it or stopped being sound; that one puts nodes aside and reports them as ever.
#[derive(Debug)]
pub struct GpuTissue {
    gpu: Gpu,
    /// All but the motion.
    tissue: Tissue,
    motion: Motion,
    /// A solution with less error, to tell that of this one by.
    finer: Option<Box<GpuTissue>>,
}

impl GpuTissue {
    /// Copies a tissue as it lies; the one given stays as it is, to go on with should the graphics processor fail.
    ///
    /// # Errors
    ///
    /// [`GpuError::Limit`] when it is too large for the adapter, [`GpuError::Failed`] when its memory does not hold it,
    /// [`GpuError::HoldsVolume`] for a material with a Poisson's ratio of its own.
    pub fn new(gpu: &Gpu, tissue: &Tissue) -> Result<GpuTissue, GpuError> {
        if tissue.holds_volume() {
            return Err(GpuError::HoldsVolume);
        }
        let mut tissue = tissue.clone();
        tissue.settle();
        Ok(GpuTissue {
            motion: Motion::new(gpu, &tissue)?,
            gpu: gpu.clone(),
            tissue,
            finer: None,
        })
    }

    /// Makes `steps` steps of `step_s` each, s, divided and checked as [`Tissue::advance_steps`] does; the report means the
    /// same.
    ///
    /// # Errors
    ///
    /// [`GpuError::Step`] when the step is refused, [`GpuError::Failed`] when the device fails; the stretches before are
    /// made.
    pub fn advance_steps(&mut self, step_s: f64, steps: u64) -> Result<StepReport, GpuError> {
        let report = self.tissue.advance_steps_on(&mut self.motion, step_s, steps)?;
        let finer = self.finer.as_mut();
        if let Some(Err(_)) = finer.map(|finer| finer.advance_steps(step_s, steps)) {
            self.finer = None;
        }
        Ok(report)
    }

    /// Begins to watch the error as [`Tissue::begin_watch`] does, with a second solution on the same graphics processor. An
    /// edit ends the watch.
    ///
    /// # Errors
    ///
    /// As [`GpuTissue::new`] and [`GpuTissue::tissue`].
    pub fn begin_watch(&mut self) -> Result<(), GpuError> {
        let finer = GpuTissue::new(&self.gpu, &self.tissue()?.finer())?;
        self.finer = Some(Box::new(finer));
        Ok(())
    }

    /// The error that has come about since the watch began, root mean square over the living nodes, mm; None where there is
    /// no watch.
    ///
    /// # Errors
    ///
    /// As [`GpuTissue::tissue`].
    pub fn watched_error_mm(&self) -> Result<Option<f64>, GpuError> {
        let Some(finer) = &self.finer else { return Ok(None) };
        Ok(Some(self.tissue()?.apart_mm(&finer.tissue()?)))
    }

    /// Ends the watch, puts more or less effort in if the error asks for it, and goes on from the finer solution if it is
    /// above the aim, as [`Tissue::end_watch`] does.
    ///
    /// # Errors
    ///
    /// As [`GpuTissue::edit`].
    pub fn end_watch(&mut self) -> Result<Option<f64>, GpuError> {
        let error = self.watched_error_mm()?;
        if let Some((error, finer)) = error.zip(self.finer.take()) {
            let finer = finer.tissue()?;
            self.edit(|tissue| {
                if tissue.heed_error(error) {
                    tissue.go_on_from(&finer);
                }
            })?;
        }
        Ok(error)
    }

    /// Where the nodes are, with what single precision cannot hold of it, mm.
    ///
    /// # Errors
    ///
    /// [`GpuError::Failed`] when the device has failed.
    pub fn positions(&self) -> Result<Vec<DVec3>, GpuError> {
        Ok(self.motion.state()?.positions)
    }

    /// The tissue with its motion read back. To look changes nothing in what follows.
    ///
    /// # Errors
    ///
    /// [`GpuError::Failed`] when the device has failed, [`GpuError::Motion`] when what it gave back is no motion.
    pub fn tissue(&self) -> Result<Tissue, GpuError> {
        let mut tissue = self.tissue.clone();
        self.motion.state()?.write_to(&mut tissue)?;
        Ok(tissue)
    }

    /// Reads the tissue back, lets it be edited or cut, and copies it anew. What the edit refuses is the edit's to tell. A
    /// watch ends.
    ///
    /// # Errors
    ///
    /// As [`GpuTissue::new`] and [`GpuTissue::tissue`]; the tissue is then as before.
    pub fn edit<T>(&mut self, edit: impl FnOnce(&mut Tissue) -> T) -> Result<T, GpuError> {
        let mut tissue = self.tissue()?;
        let result = edit(&mut tissue);
        *self = GpuTissue::new(&self.gpu, &tissue)?;
        Ok(result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_solver::Network;

    #[test]
    fn a_lost_device_is_an_error_and_no_panic() {
        let Ok(gpu) = Gpu::open() else {
            eprintln!("SKIPPED: no adapter to lose");
            return;
        };
        let network = Network {
            positions: vec![DVec3::ZERO, DVec3::X],
            velocities: vec![DVec3::ZERO; 2],
            masses: vec![1.0; 2],
            damping: vec![0.0; 2],
            loads: vec![DVec3::ZERO; 2],
            fixed: vec![false; 2],
            springs: vec![[0, 1]],
            stiffness: vec![1.0],
            rest_lengths: vec![1.0],
        };
        let tissue = Tissue::from_network(&network).expect("a network");
        let mut moving = GpuTissue::new(&gpu, &tissue).expect("a small tissue");
        moving.advance_steps(1e-3, 10).expect("plain steps");
        gpu.device.destroy();
        let failed = moving.advance_steps(1e-3, 10);
        assert!(matches!(failed, Err(GpuError::Failed(_))), "{failed:?}");
        assert!(matches!(moving.positions(), Err(GpuError::Failed(_))));
        assert!(matches!(GpuTissue::new(&gpu, &tissue), Err(GpuError::Failed(_))));
    }
}
