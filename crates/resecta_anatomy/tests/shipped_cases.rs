//! The cases in `assets/cases` are what `generate` writes. With `RESECTA_WRITE_CASES` set, they are written anew.

use std::path::{Path, PathBuf};

use resecta_anatomy::Case;
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::import::{MaskOptions, import};

/// Name and specification of each case that ships.
const SHIPPED: [(&str, GlandSpec); 3] = [
    (
        "small",
        GlandSpec {
            volume_ml: 30.0,
            median_lobe_mm: 0.0,
            seed: 7,
        },
    ),
    (
        "medium",
        GlandSpec {
            volume_ml: 60.0,
            median_lobe_mm: 8.0,
            seed: 7,
        },
    ),
    (
        "large",
        GlandSpec {
            volume_ml: 90.0,
            median_lobe_mm: 10.0,
            seed: 7,
        },
    ),
];

#[test]
fn shipped_cases_are_what_the_generator_writes() {
    for (name, spec) in SHIPPED {
        let case = generate(&spec).unwrap();
        let path = PathBuf::from(format!("../../assets/cases/{name}.case.ron"));
        if std::env::var_os("RESECTA_WRITE_CASES").is_some() {
            case.save(&path).unwrap();
        }
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            case.to_ron(),
            "{}",
            path.display()
        );
        assert_eq!(Case::load(&path).unwrap(), case);
    }
}

/// The case of "An imported gland", and the contours that it came from.
#[test]
fn the_imported_case_is_what_import_makes_of_its_contours() {
    let contours = Path::new("../../assets/contours/larger_left_lobe.contours.json");
    let path = Path::new("../../assets/cases/larger_left_lobe.case.ron");
    let case = import(contours, &MaskOptions::default()).unwrap();
    if std::env::var_os("RESECTA_WRITE_CASES").is_some() {
        case.save(path).unwrap();
    }
    assert_eq!(Case::load(path).unwrap(), case);
}
