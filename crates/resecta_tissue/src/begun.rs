//! A tissue on which work has begun: what is gone before its first step.

use resecta_field::{FieldError, Tool};
use resecta_solver::CollapseLaw;

use crate::{components::Tissue, fine::Fine, settings::CutDetail};

/// Distance between the points by which a tissue that is cut by whole pentahedra is looked at, mm.
const LOOK_MM: f32 = 1.0;
/// A whole pentahedron is gone if less than this share of it would be left.
const LEFT_SHARE: f64 = 0.5;

impl Tissue {
    /// Makes ready what cuts as fine as that need, mm; nothing if it is. The plugin does so in the first step with a loop, which then takes a
    /// quarter of a second for a gland.
    ///
    /// # Errors
    /// [`FieldError`]: a tissue that cannot be cut so finely.
    pub fn refine(&mut self, spacing_mm: f32) -> Result<(), FieldError> {
        if self.fine.is_none() {
            self.fine = Some(Fine::new(&self.solver, spacing_mm)?);
        }
        Ok(())
    }

    /// Takes away what is inside of some volumes, and what then hangs by nothing, as if that had gone long ago: no message
    /// tells of it, no tool has done it and no chip is left of it. For a tissue that is not in an app yet; `detail` and `law`
    /// are to be those of its [`TissueSettings`](crate::TissueSettings).
    ///
    /// Returns what each pentahedron lost: volume at rest, mm³; ascending.
    ///
    /// # Errors
    /// [`FieldError`]: a volume that is none, or a tissue that cannot be cut so finely. Some of it may be cut then: it is not to be used.
    pub fn begin(
        &mut self,
        cuts: &[Tool],
        detail: CutDetail,
        law: Option<CollapseLaw>,
    ) -> Result<Vec<(u32, f64)>, FieldError> {
        let spacing_mm = match detail {
            CutDetail::Elements => LOOK_MM,
            CutDetail::Field { spacing_mm } => spacing_mm,
        };
        let mut fine = match self.fine.take() {
            Some(fine) => fine,
            None => Fine::new(&self.solver, spacing_mm)?,
        };
        let taken = fine.begin(&self.solver, cuts)?;
        let mut left: Vec<(u32, f64)> = taken.into_iter().flat_map(|taken| taken.left).collect();
        left.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // Of several cuts the last left least.
        left.dedup_by_key(|(pentahedron, _)| *pentahedron);
        let resection = match detail {
            CutDetail::Elements => {
                left.retain(|(_, share)| *share < LEFT_SHARE);
                let mut gone: Vec<u32> = left.into_iter().map(|(pentahedron, _)| pentahedron).collect();
                let pieces = self.solver.pieces_cut_free(&gone);
                gone.extend(pieces);
                self.solver.resect(&gone, law)
            }
            CutDetail::Field { .. } => {
                self.fine = Some(fine);
                self.solver.thin(&left, law)
            }
        };
        self.lightened.extend(resection.lightened);
        self.weakened.extend(resection.weakened);
        Ok(resection.taken_mm3)
    }
}
