//! The lattice on whole cases: the papers' size, zones, and every real gland of the shared data.

use std::path::{Path, PathBuf};

use glam::DVec2;
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::reference::paper_case;
use resecta_anatomy::{Case, Lattice, LatticeError, LatticeOptions, Zone, contour, import, wedge};

fn volume_of(lattice: &Lattice, zone: Zone) -> f64 {
    (lattice.pentahedra.iter().zip(&lattice.zones))
        .filter(|&(_, &other)| other == zone)
        .map(|(nodes, _)| wedge::volume(nodes, |node| lattice.positions[node as usize]))
        .sum()
}

#[test]
fn the_reference_case_has_the_papers_ten_thousand_eight_hundred_nodes() {
    let lattice = Lattice::build(&paper_case(), &LatticeOptions::default()).unwrap();
    assert_eq!(lattice.node_count(), 10_800);
    assert_eq!(lattice.axis_spring_count(), 30_960);
    assert_eq!((lattice.narrowed_rays, lattice.smoothed_sections), (0, 0));
}

#[test]
fn a_case_without_urethra_is_named_and_one_without_transition_zone_is_some_other_organ() {
    let mut bare = paper_case();
    for slice in &mut bare.slices {
        slice.transition_zone = None;
    }
    let lattice = Lattice::build(&bare, &LatticeOptions::default()).unwrap();
    assert!(lattice.zones.iter().all(|&zone| zone == Zone::Other));
    bare.slices[4].urethra = None;
    let error = Lattice::build(&bare, &LatticeOptions::default());
    assert_eq!(error, Err(LatticeError::MissingUrethra { slice: 4 }));
}

#[test]
fn zones_fill_their_contours_and_the_middle_lobe_lies_behind_and_above() {
    let case = paper_case();
    let lattice = Lattice::build(
        &case,
        &LatticeOptions {
            alpha_deg: 4.0,
            ..Default::default()
        },
    )
    .unwrap();
    let verumontanum = case.landmarks.verumontanum.unwrap();
    for (nodes, &zone) in lattice.pentahedra.iter().zip(&lattice.zones) {
        let place = wedge::centroid(nodes, |node| lattice.positions[node as usize]);
        if zone == Zone::MiddleLobe {
            assert!(
                place.z > verumontanum.z && place.y > -3.0 && place.x.abs() < place.y + 6.0,
                "{place}"
            );
        }
    }
    // The transition zone is the capsule at 0.7 above 10 mm: there its area with the lumen is 0.49 of the capsule's.
    let above: Vec<usize> = (0..lattice.pentahedra.len())
        .filter(|&index| {
            lattice.pentahedra[index]
                .iter()
                .all(|&node| lattice.positions[node as usize].z > 15.0)
        })
        .collect();
    let volume = |adenoma_only: bool| -> f64 {
        (above
            .iter()
            .filter(|&&index| !adenoma_only || lattice.zones[index].is_adenoma()))
        .map(|&index| wedge::volume(&lattice.pentahedra[index], |node| lattice.positions[node as usize]))
        .sum()
    };
    let lumen: f64 = 0.02;
    let expected = (0.49 - lumen) / (1.0 - lumen);
    let share = volume(true) / volume(false);
    assert!((share - expected).abs() < 0.04, "{share} instead of {expected}");
    let middle = volume_of(&lattice, Zone::MiddleLobe) / volume_of(&lattice, Zone::LateralLobe);
    assert!((0.05..0.3).contains(&middle), "{middle}");
}

/// The shipped file holds the reference case. With `RESECTA_WRITE_CASES` set, it is written anew.
#[test]
fn the_shipped_paper_case_is_the_reference_case() {
    let path = Path::new("../../assets/cases/paper.case.ron");
    if std::env::var_os("RESECTA_WRITE_CASES").is_some() {
        paper_case().save(path).unwrap();
    }
    assert_eq!(Case::load(path).unwrap(), paper_case());
}

/// Builds at 8 degrees and holds the lattice against the contours it comes from; returns a line of a table.
fn check(name: &str, case: &Case) -> String {
    let lattice = Lattice::build(case, &LatticeOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    let place = |node: u32| lattice.positions[node as usize];
    let smallest = (lattice.pentahedra.iter())
        .map(|nodes| wedge::volume(nodes, place))
        .fold(f64::INFINITY, f64::min);
    let quality = lattice.quality();
    let error = lattice.volume_mm3() / lattice.contour_volume_mm3 - 1.0;
    let distance = root_mean_square_distance_mm(case, &lattice);
    assert!(smallest > 0.0, "{name}: a pentahedron of {smallest} mm³");
    assert!(quality.min > 0.0, "{name}: {quality:?}");
    assert!(error.abs() < 0.015, "{name}: volume off by {error}");
    assert!(distance < 0.6, "{name}: capsule off by {distance} mm");
    assert!(Zone::ALL[..3].contains(&lattice.zones[0]), "{name}: no zones");
    format!(
        "{name:34} nodes {:6} volume {:+.2} % smallest {smallest:.4} mm³ quality {:.3} {:.2} capsule {distance:.2} mm \
         narrowed {} smoothed {}",
        lattice.node_count(),
        100.0 * error,
        quality.min,
        quality.mean,
        lattice.narrowed_rays,
        lattice.smoothed_sections
    )
}

/// Root mean square distance from the corners of all capsules to the lattice's outer surface at their height.
fn root_mean_square_distance_mm(case: &Case, lattice: &Lattice) -> f64 {
    let shape = lattice.shape;
    let first = lattice.centres[0].z;
    let spacing = lattice.centres[1].z - first;
    let (mut squares, mut count) = (0.0, 0);
    for slice in &case.slices {
        let level = ((slice.z - first) / spacing).clamp(0.0, f64::from(shape.slices - 1));
        let below = (level as u32).min(shape.slices - 2);
        let capsule = |i, j| lattice.positions[shape.index(i, j, shape.layers - 1) as usize].truncate();
        let section: Vec<DVec2> = (0..shape.angles)
            .map(|j| capsule(below, j).lerp(capsule(below + 1, j), level - f64::from(below)))
            .collect();
        for &corner in &slice.capsule {
            squares += contour::clearance(&section, corner).powi(2);
            count += 1;
        }
    }
    (squares / f64::from(count)).sqrt()
}

#[test]
fn generated_glands_keep_their_volume_and_shape_at_eight_degrees() {
    for volume_ml in [15.0, 30.0, 60.0, 90.0, 150.0] {
        for median_lobe_mm in [0.0, 8.0, 15.0] {
            let spec = GlandSpec {
                volume_ml,
                median_lobe_mm,
                seed: 3,
            };
            println!(
                "{}",
                check(
                    &format!("{volume_ml} ml, lobe {median_lobe_mm} mm"),
                    &generate(&spec).unwrap()
                )
            );
        }
    }
}

#[test]
fn real_glands_keep_their_volume_and_shape_at_eight_degrees() {
    let Some(folder) = shared_cases() else { return };
    let mut files = Vec::new();
    contour_files(&folder, &mut files);
    files.sort();
    assert!(!files.is_empty(), "no contours under {}", folder.display());
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let case = import::contours_json(&file).unwrap_or_else(|error| panic!("{error}"));
        println!(
            "{}",
            check(
                &name,
                &case.complete().unwrap_or_else(|error| panic!("{name}: {error}"))
            )
        );
    }
}

fn contour_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            contour_files(&path, files);
        } else if path.to_string_lossy().ends_with(".contours.json") {
            files.push(path);
        }
    }
}

/// The folder of real cases beside the repository, or that of `RESECTA_SHARED`.
fn shared_cases() -> Option<PathBuf> {
    // Cargo runs tests in the folder of their package.
    let beside = || PathBuf::from("../../../shared");
    let folder = std::env::var_os("RESECTA_SHARED")
        .map_or_else(beside, PathBuf::from)
        .join("cases");
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is absent", folder.display());
    eprintln!("SKIPPED: real glands, {} is absent", folder.display());
    None
}
