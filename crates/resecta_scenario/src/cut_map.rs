//! What was cut, unrolled: rows by height along the urethra, columns by hour on the clock face about it.
//!
//! A volume element counts for the cell that its centroid at rest lies in, whole: places are true to half an element (about
//! 1 mm), volumes are exact.

use std::collections::BTreeMap;

use resecta_anatomy::Zone;
use resecta_solver::Tissue;

use crate::{active::ActiveExercise, region::MarkedRegion, walls::Walls};

/// A map of the tissue that is missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CutMap {
    /// Height of the lower edge of the first row, mm in the case's coordinates; rows rise towards the bladder.
    pub from_mm: f64,
    /// Height of a row, mm.
    pub row_mm: f64,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns: the first begins at 12 o'clock, they go clockwise as seen from the apex.
    pub columns: usize,
    /// Row after row.
    pub cells: Vec<CutCell>,
}

/// What one cell of a [`CutMap`] has lost. Volumes are at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CutCell {
    /// What it held at the start, mm³.
    pub whole_mm3: f64,
    /// Of it, by zone, indexed by [`Zone::index`].
    pub whole_by_zone_mm3: [f64; Zone::COUNT],
    /// What is gone, mm³.
    pub removed_mm3: f64,
    /// Of it, by zone, indexed by [`Zone::index`].
    pub removed_by_zone_mm3: [f64; Zone::COUNT],
    /// Of what it held, what is marked, mm³.
    pub marked_mm3: f64,
    /// Of what is gone, what was marked, mm³.
    pub marked_removed_mm3: f64,
    /// How far from the wall of the urethra tissue is gone: the deepest centroid of elements that lost half or more, mm.
    pub depth_mm: Option<f64>,
    /// The least distance to the capsule of the centroid of an element that lost half or more, mm; 0 where capsule is gone.
    pub capsule_mm: Option<f64>,
}

impl CutCell {
    /// The zone that holds most of it at rest; none for a cell without tissue.
    pub fn zone(&self) -> Option<Zone> {
        let volume = |zone: &Zone| self.whole_by_zone_mm3[zone.index()];
        (Zone::ALL.into_iter().filter(|zone| volume(zone) > 0.0)).max_by(|a, b| volume(a).total_cmp(&volume(b)))
    }
}

impl CutMap {
    /// The map of an exercise in play, whose tissue this is: what went since its start.
    pub fn of_exercise(active: &ActiveExercise, tissue: &Tissue, row_mm: f64, columns: usize) -> Self {
        let ActiveExercise {
            walls,
            marked,
            gone_mm3,
            ..
        } = active;
        Self::new(tissue, walls, marked, gone_mm3, row_mm, columns)
    }

    /// Maps what a tissue has lost, but for what pentahedra had lost before (mm³ at rest), which counts as never there. `row_mm` above
    /// 0 and `columns` at least 1; others are raised to 0.1 mm and 1.
    pub fn new(
        tissue: &Tissue,
        walls: &Walls,
        marked: &MarkedRegion,
        before_mm3: &BTreeMap<u32, f64>,
        row_mm: f64,
        columns: usize,
    ) -> Self {
        let row_mm = row_mm.max(0.1);
        let columns = columns.max(1);
        let (from_mm, to_mm) = walls.heights_mm().unwrap_or_default();
        let rows = (((to_mm - from_mm) / row_mm).ceil() as usize).max(1);
        let mut map = Self {
            from_mm,
            row_mm,
            rows,
            columns,
            cells: vec![CutCell::default(); rows * columns],
        };
        for pentahedron in 0..tissue.pentahedron_count() as u32 {
            let place = tissue.rest_centroid(pentahedron).as_dvec3();
            let rest_mm3 = tissue.rest_volume_mm3(pentahedron);
            let lost = 1.0 - tissue.fill(pentahedron);
            let before_mm3 = before_mm3.get(&pentahedron).copied().unwrap_or(0.0);
            let whole_mm3 = rest_mm3 - before_mm3;
            // What it had lost before was reckoned in another order.
            let removed_mm3 = (rest_mm3 * lost - before_mm3).clamp(0.0, whole_mm3.max(0.0));
            let cell = map.cell_of(place.z, walls.hour(place));
            let cell = &mut map.cells[cell];
            let zone = tissue.pentahedron_zone(pentahedron).index();
            cell.whole_mm3 += whole_mm3;
            cell.whole_by_zone_mm3[zone] += whole_mm3;
            cell.removed_mm3 += removed_mm3;
            cell.removed_by_zone_mm3[zone] += removed_mm3;
            if marked.contains(pentahedron) {
                cell.marked_mm3 += whole_mm3;
                cell.marked_removed_mm3 += removed_mm3;
            }
            // How deep is a matter of what was cut since.
            if lost < 0.5 || removed_mm3 <= 0.0 {
                continue;
            }
            let depth_mm = walls.depth_mm(place);
            let is_capsule = tissue.capsule_area_mm2(pentahedron) > 0.0 && lost >= 1.0;
            let capsule_mm = if is_capsule { 0.0 } else { walls.capsule_mm(place) };
            cell.depth_mm = Some(cell.depth_mm.map_or(depth_mm, |deepest| deepest.max(depth_mm)));
            cell.capsule_mm = Some(cell.capsule_mm.map_or(capsule_mm, |least| least.min(capsule_mm)));
        }
        map
    }

    /// The cell of a row and a column; none outside.
    pub fn cell(&self, row: usize, column: usize) -> Option<&CutCell> {
        (row < self.rows && column < self.columns).then(|| &self.cells[row * self.columns + column])
    }

    /// All that is gone, mm³.
    pub fn removed_mm3(&self) -> f64 {
        self.cells.iter().map(|cell| cell.removed_mm3).sum()
    }

    fn cell_of(&self, z_mm: f64, hour: f64) -> usize {
        // A cast of a negative number is 0.
        let row = ((z_mm - self.from_mm) / self.row_mm) as usize;
        let column = (hour / 12.0 * self.columns as f64) as usize;
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }
}
