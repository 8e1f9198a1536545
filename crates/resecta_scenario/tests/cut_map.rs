//! The map of what was cut, on a shipped gland.

use std::path::Path;

use resecta_anatomy::Zone;
use resecta_scenario::{CutMap, Library, PreparedExercise};

fn prepared() -> PreparedExercise {
    let library = Library::new(Path::new("../../assets"));
    library.load("first_cuts").unwrap().prepare().unwrap()
}

fn map(prepared: &PreparedExercise, row_mm: f64, columns: usize) -> CutMap {
    CutMap::new(
        prepared.tissue.solver(),
        &prepared.walls,
        &prepared.marked,
        &prepared.gone_mm3,
        row_mm,
        columns,
    )
}

#[test]
fn the_cells_hold_the_gland_and_lose_what_it_lost_however_fine_they_are() {
    let mut prepared = prepared();
    let left: Vec<(u32, f64)> = (0..prepared.tissue.solver().pentahedron_count() as u32)
        .step_by(7)
        .map(|index| (index, f64::from(index % 5) / 5.0))
        .collect();
    prepared.tissue.solver_mut().thin(&left, None);
    let removed = prepared.tissue.solver().removed_volume_mm3();
    assert!(removed > 1000.0);
    for (row_mm, columns) in [(2.5, 24), (1.0, 48), (7.0, 5), (0.0, 0)] {
        let map = map(&prepared, row_mm, columns);
        let whole: f64 = map.cells.iter().map(|cell| cell.whole_mm3).sum();
        let by_zone: f64 = map.cells.iter().flat_map(|cell| cell.removed_by_zone_mm3).sum();
        assert!(
            (map.removed_mm3() / removed - 1.0).abs() < 1e-9,
            "{} {removed}",
            map.removed_mm3()
        );
        let whole_by_zone: f64 = map.cells.iter().flat_map(|cell| cell.whole_by_zone_mm3).sum();
        assert!((whole_by_zone / whole - 1.0).abs() < 1e-9);
        assert!((by_zone / removed - 1.0).abs() < 1e-9);
        assert!((whole / prepared.tissue.solver().initial_volume_mm3() - 1.0).abs() < 1e-9);
        assert!(
            map.cells
                .iter()
                .all(|cell| cell.marked_removed_mm3 <= cell.removed_mm3 + 1e-9)
        );
    }
}

#[test]
fn nothing_cut_leaves_an_empty_map() {
    let map = map(&prepared(), 2.5, 24);
    assert_eq!(map.removed_mm3(), 0.0);
    assert!(
        map.cells
            .iter()
            .all(|cell| cell.depth_mm.is_none() && cell.capsule_mm.is_none())
    );
}

#[test]
fn the_marked_part_lies_where_its_exercise_says() {
    let mut prepared = prepared();
    let marked: Vec<u32> = prepared.marked.pentahedra().collect();
    prepared.tissue.solver_mut().resect(&marked, None);
    let map = map(&prepared, 2.5, 24);
    assert!((map.removed_mm3() / prepared.marked.total_mm3() - 1.0).abs() < 1e-5);
    for row in 0..map.rows {
        for column in 0..map.columns {
            let cell = map.cell(row, column).unwrap();
            // 5 to 7 o'clock, at most 12 mm deep, off the capsule.
            let is_inside = (10..14).contains(&column);
            assert!(is_inside || cell.removed_mm3 == 0.0, "{row} {column}");
            assert!(
                cell.removed_mm3 == 0.0 || cell.zone() != Some(Zone::LateralLobe),
                "{row} {column}"
            );
            assert!(cell.depth_mm.is_none_or(|depth| depth < 12.0));
            assert!(cell.capsule_mm.is_none_or(|distance| distance > 0.0));
        }
    }
    assert!(map.cell(map.rows, 0).is_none() && map.cell(0, map.columns).is_none());
}

#[test]
fn an_element_of_the_capsule_that_is_gone_has_no_distance_to_it() {
    let mut prepared = prepared();
    let on_capsule = (0..prepared.tissue.solver().pentahedron_count() as u32)
        .find(|&index| prepared.tissue.solver().capsule_area_mm2(index) > 0.0)
        .unwrap();
    prepared.tissue.solver_mut().resect(&[on_capsule], None);
    let map = map(&prepared, 2.5, 24);
    let touched: Vec<_> = map.cells.iter().filter_map(|cell| cell.capsule_mm).collect();
    assert_eq!(touched, [0.0]);
}
