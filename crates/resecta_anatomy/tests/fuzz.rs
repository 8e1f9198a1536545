//! Whatever bytes come in, the readers answer: no panic, no hang, and what they accept is a sound case.

use std::io::Write;
use std::path::Path;
use std::sync::LazyLock;

use proptest::prelude::*;
use resecta_anatomy::Case;
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::import::{MaskOptions, contours_json_str, nifti_mask_bytes};

/// A small case as RON, as JSON contours and as a NIfTI mask, plain and compressed.
static VALID: LazyLock<[Vec<u8>; 4]> = LazyLock::new(|| {
    let mut case = generate(&GlandSpec {
        volume_ml: 20.0,
        median_lobe_mm: 4.0,
        seed: 5,
    })
    .unwrap();
    case.slices.truncate(4);
    for slice in &mut case.slices {
        slice.capsule = slice.capsule.iter().step_by(3).copied().collect();
        slice.transition_zone = None;
    }
    case.slices[1].urethra = None;
    let mut json = serde_json::to_value(&case).unwrap();
    json["source"] = "generated".into();
    let json = serde_json::to_vec(&json).unwrap();
    let mut mask = vec![0; 352];
    for (at, value) in [(0, 348_u16), (40, 3), (42, 9), (44, 8), (46, 5), (70, 2), (72, 8)] {
        mask[at..at + 2].copy_from_slice(&value.to_le_bytes());
    }
    for at in [80, 84, 88] {
        mask[at..at + 4].copy_from_slice(&2_f32.to_le_bytes());
    }
    mask[108..112].copy_from_slice(&352_f32.to_le_bytes());
    mask[344..348].copy_from_slice(b"n+1\0");
    mask.extend(
        (0..9 * 8 * 5).map(|voxel| u8::from((2..7).contains(&(voxel % 9)) && (1..7).contains(&(voxel / 9 % 8)))),
    );
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&mask).unwrap();
    [case.to_ron().into_bytes(), json, mask, packed.finish().unwrap()]
});

fn read(kind: usize, bytes: &[u8]) -> Option<Case> {
    let file = Path::new("fuzz");
    let text = String::from_utf8_lossy(bytes);
    match kind {
        0 => Case::from_ron(&text, file).map_err(|error| error.to_string()).ok(),
        1 => contours_json_str(&text, file).map_err(|error| error.to_string()).ok(),
        _ => nifti_mask_bytes(
            bytes,
            file,
            &MaskOptions {
                endpoint_channels: Some([0, 1]),
                ..MaskOptions::default()
            },
        )
        .map_err(|error| error.to_string())
        .ok(),
    }
}

/// What is accepted keeps the rules, and reads back as it was written.
fn check(kind: usize, bytes: &[u8]) -> Result<(), TestCaseError> {
    if let Some(case) = read(kind, bytes) {
        prop_assert_eq!(case.validate(), Ok(()));
        prop_assert_eq!(Case::from_ron(&case.to_ron(), Path::new("again")).unwrap(), case);
    }
    Ok(())
}

#[test]
fn the_seeds_are_accepted() {
    for (kind, bytes) in VALID.iter().enumerate() {
        assert!(read(kind, bytes).is_some(), "kind {kind}");
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(kind in 0_usize..4, bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        check(kind, &bytes)?;
        // Behind a sound header, too.
        let mut headed = VALID[kind][..VALID[kind].len().min(352)].to_vec();
        headed.extend(&bytes);
        check(kind, &headed)?;
    }

    #[test]
    fn mutations_of_valid_files_never_panic(
        kind in 0_usize..4,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        text_changes in prop::collection::vec((any::<prop::sample::Index>(), "[-0-9.eE,()\\[\\]{}:a-zN]"), 0..3),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut bytes = VALID[kind].clone();
        for (place, value) in &changes {
            // Text is spoilt by text most of the time: random bytes hardly get past the parser.
            if kind > 1 || text_changes.is_empty() {
                // Headers are short beside the voxels; aim at them half of the time.
                let length = if kind == 2 && value % 2 == 0 { 352 } else { bytes.len() };
                bytes[place.index(length)] = *value;
            }
        }
        if kind < 2 {
            for (place, value) in &text_changes {
                let place = place.index(bytes.len());
                bytes[place] = value.as_bytes()[0];
            }
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        check(kind, &bytes)?;
    }
}
