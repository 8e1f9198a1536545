//! Training and annotation on synthetic ultrasound, whose outlines are known exactly.

use std::path::Path;
use std::sync::OnceLock;

use glam::DVec2;
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::{Case, CaseSource, contour};
use resecta_annotate::compare::mean_distance_mm;
use resecta_annotate::{
    AnnotateError, Annotation, Flag, Image, ImageSlice, Model, ModelError, Outlines, Stack, SyntheticOptions,
    TrainError, TrainingCase, Zone, annotate, annotate_slice, synthesize,
};

fn case(seed: u64) -> Case {
    let volume_ml = 40.0 + 4.0 * (seed % 4) as f64;
    generate(&GlandSpec {
        volume_ml,
        median_lobe_mm: 0.0,
        seed,
    })
    .expect("a usual gland")
}

fn stack(case: &Case, seed: u64) -> Stack {
    let options = SyntheticOptions {
        spacing_mm: 0.8,
        ..SyntheticOptions::LIGHT
    };
    synthesize(case, &options, seed).expect("images")
}

fn training(seed: u64) -> TrainingCase {
    let case = case(seed);
    TrainingCase {
        name: format!("synthetic {seed}"),
        stack: stack(&case, seed),
        outlines: case
            .slices
            .iter()
            .map(|slice| (slice.z, slice.capsule.clone()))
            .collect(),
    }
}

fn model() -> &'static Model {
    static MODEL: OnceLock<Model> = OnceLock::new();
    MODEL.get_or_init(|| {
        let cases: Vec<TrainingCase> = (1..=5).map(training).collect();
        Model::train(&cases, "synthetic glands", 1, |_, _| {}).expect("a model")
    })
}

fn annotated(threads: usize) -> Annotation {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    let stack = stack(&case(9), 9);
    pool.install(|| annotate(&stack, model(), 4, |_, _| {}).expect("a gland"))
}

#[test]
fn an_unseen_gland_is_found_and_becomes_a_case() {
    let found = annotated(2);
    let truth = case(9);
    let distances: Vec<f64> = found
        .slices
        .iter()
        .filter_map(|slice| {
            let drawn = truth.slices.iter().find(|drawn| (drawn.z - slice.z_mm).abs() < 1e-6)?;
            Some(mean_distance_mm(&drawn.capsule, &slice.capsule))
        })
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(distances.len() + 2 >= truth.slices.len(), "{distances:?}");
    assert!(mean < 2.5, "{distances:?}");
    let source = CaseSource {
        description: "synthetic".into(),
        licence: "MIT".into(),
    };
    let stack = stack(&truth, 9);
    let place = found.slices.len() / 2;
    let (middle, image) = (found.slices[place].capsule.clone(), found.slices[place].image);
    let known = middle.iter().sum::<DVec2>() / middle.len() as f64;
    let mut outlines = Outlines::found(&stack, found);
    assert!(outlines.mark_urethra(image, Some(known)));
    let case = outlines.to_case(&stack, "found", source).expect("a case");
    let urethra = case.slices[place].urethra.as_ref().expect("a urethra");
    assert!(contour::centroid(urethra).distance(known) < 0.01);
    assert!(case.slices.iter().all(|slice| slice.urethra.is_some()));
    assert!(case.approximated.iter().any(|note| note.what == "slices[0].capsule"));
}

#[test]
fn a_seed_gives_the_same_bits_with_one_thread_and_with_two() {
    assert_eq!(annotated(1), annotated(2));
}

#[test]
fn a_slice_found_anew_from_a_start_stays_near_it() {
    let found = annotated(2);
    let slice = &found.slices[found.slices.len() / 2];
    let stack = stack(&case(9), 9);
    let again = annotate_slice(&stack, slice.image, slice.zone, Some(&slice.capsule), model(), 1).expect("a slice");
    assert!(mean_distance_mm(&slice.capsule, &again.capsule) < 3.0);
    let none = annotate_slice(&stack, 99, Zone::Middle, None, model(), 1);
    assert!(matches!(none, Err(AnnotateError::NoImage { index: 99, .. })));
}

#[test]
fn a_gland_cut_by_the_edge_of_the_image_is_flagged() {
    let whole = stack(&case(9), 9);
    let middle = whole
        .slices()
        .iter()
        .map(|slice| slice.image.place(slice.image.width() / 2, 0).x);
    let middle = middle.sum::<f64>() / whole.slices().len() as f64;
    let cut = whole.slices().iter().map(|slice| {
        let image = &slice.image;
        let shown = (0..image.width() * image.height())
            .map(|pixel| {
                let (x, y) = (pixel % image.width(), pixel / image.width());
                image.is_shown(x, y) && image.place(x, y).x < middle + 8.0
            })
            .collect();
        ImageSlice {
            z_mm: slice.z_mm,
            image: image.clone().with_shown(shown).expect("half an image"),
        }
    });
    let cut = Stack::new(cut.collect()).expect("a stack");
    let found = annotate(&cut, model(), 4, |_, _| {}).expect("a gland");
    let flagged = found.slices.iter().filter(|slice| !slice.flags.is_empty()).count();
    assert!(
        2 * flagged > found.slices.len(),
        "{:?}",
        found.slices.iter().map(|slice| &slice.flags).collect::<Vec<_>>()
    );
}

#[test]
fn a_wrong_spacing_is_flagged() {
    let right = stack(&case(9), 9);
    let wrong = right.slices().iter().map(|slice| {
        let image = &slice.image;
        let size = [image.width(), image.height()];
        let spacing = image.spacing_mm().map(|spacing| 0.25 * spacing);
        let image = Image::new(size, spacing, [0.0; 2], image.grey().to_vec()).expect("an image");
        ImageSlice {
            z_mm: slice.z_mm,
            image,
        }
    });
    let wrong = Stack::new(wrong.collect()).expect("a stack");
    let found = annotate(&wrong, model(), 4, |_, _| {}).expect("something");
    let flagged = |flag: &Flag| matches!(flag, Flag::LeavesImage { .. } | Flag::Unusual | Flag::PoorFit);
    assert!(found.slices.iter().any(|slice| slice.flags.iter().any(flagged)));
}

#[test]
fn a_model_reads_back_as_it_was_and_a_damaged_one_is_refused_by_name() {
    let file = Path::new("prostate.pdm");
    let text = model().to_json();
    let back = Model::from_json(&text, file).expect("a model");
    // A model is longer than anybody reads.
    assert!(back == *model());
    let damaged = text.replacen("\"offsets\":[", "\"offsets\":[0,", 1);
    assert!(matches!(
        Model::from_json(&damaged, file),
        Err(ModelError::Damaged { .. })
    ));
    let cut = Model::from_json(&text[..text.len() / 2], file).expect_err("half a model");
    assert!(cut.to_string().contains("prostate.pdm"), "{cut}");
    let newer = text.replacen("\"version\":1", "\"version\":2", 1);
    assert!(matches!(Model::from_json(&newer, file), Err(ModelError::Format { .. })));
}

#[test]
fn what_cannot_be_learned_from_or_looked_at_is_refused_by_name() {
    let few = Model::train(&[training(1)], "", 1, |_, _| {});
    assert!(matches!(few, Err(TrainError::TooFew { found: 1 })));
    let mut apart = training(2);
    apart.outlines.iter_mut().for_each(|(z, _)| *z += 500.0);
    let apart = Model::train(&[training(1), apart, training(3)], "", 1, |_, _| {});
    assert!(matches!(apart, Err(TrainError::Apart { case }) if case == "synthetic 2"));
    let two = stack(&case(9), 9).slices()[..2].to_vec();
    let two = annotate(&Stack::new(two).expect("a stack"), model(), 1, |_, _| {});
    assert!(matches!(two, Err(AnnotateError::TooFewImages { found: 2 })));
}
