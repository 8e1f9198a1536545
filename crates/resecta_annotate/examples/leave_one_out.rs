//! Leave one case out.
use std::path::Path;
use glam::DVec2;
use nifti::{IntoNdArray, NiftiObject, ReaderOptions};
use rayon::prelude::*;
use resecta_anatomy::import::{MaskOptions, nifti_mask};
use resecta_annotate::compare::{Overlap, mean_distance_mm};
use resecta_annotate::experiment;
use resecta_annotate::gland::Gland;
use resecta_annotate::{Image, ImageSlice, Stack};
use resecta_annotate::model::{Model, TrainingCase};

fn load(dir: &Path, name: &str) -> TrainingCase {
    let object = ReaderOptions::new().read_file(dir.join("images").join(name)).expect("image");
    let voxels = object.into_volume().into_ndarray::<f32>().expect("voxels");
    let size = voxels.shape().to_vec();
    let slices = (0..size[2])
        .map(|z| {
            let mut grey = Vec::new();
            for y in 0..size[0] {
                for x in 0..size[1] {
                    grey.push(voxels[[y, x, z].as_ref()] / 255.0);
                }
            }
            ImageSlice {
                z_mm: z as f64 * 1.6,
                image: Image::new([size[1], size[0]], [1.6; 2], [0.0; 2], grey).expect("image"),
            }
        })
        .collect();
    let options = MaskOptions { spacing_mm: Some([1.6; 3]), ..MaskOptions::default() };
    let case = nifti_mask(&dir.join("labels").join(name), &options).expect("label");
    TrainingCase {
        name: case.name.clone(),
        stack: Stack::new(slices).expect("stack"),
        outlines: case.slices.into_iter().map(|slice| (slice.z, slice.capsule)).collect(),
    }
}

#[derive(Default, Clone, Debug)]
struct Score { all: f64, middle: f64, apex: f64, base: f64, mean_mm: f64, volume: f64, ends: [f64; 2] }

fn score(stack: &Stack, truth: &[(f64, Vec<DVec2>)], found: &Gland) -> Score {
    let (low, high) = (truth[0].0 - 0.8, truth[truth.len() - 1].0 + 0.8);
    let mut zones = [Overlap::default(); 4];
    let mut distances = Vec::new();
    for slice in stack.slices() {
        let none = Vec::new();
        let outline = truth.iter().find(|(z, _)| (z - slice.z_mm).abs() < 0.01).map_or(&none, |(_, outline)| outline);
        let section = found.section(slice.z_mm).unwrap_or_default();
        let overlap = Overlap::of(outline, &section);
        zones[3] += overlap;
        let share = (slice.z_mm - low) / (high - low);
        if (0.0..=1.0).contains(&share) {
            let zone = if share < 1.0 / 6.0 { 0 } else if share > 5.0 / 6.0 { 2 } else { 1 };
            zones[zone] += overlap;
            if zone == 1 && !section.is_empty() { distances.push(mean_distance_mm(outline, &section)); }
        }
    }
    Score {
        all: zones[3].dice(), middle: zones[1].dice(), apex: zones[0].dice(), base: zones[2].dice(),
        mean_mm: distances.iter().sum::<f64>() / distances.len() as f64,
        volume: zones[3].second_mm2 / zones[3].first_mm2 - 1.0,
        ends: [found.ends[0] - truth[0].0, found.ends[1] - truth[truth.len() - 1].0],
    }
}

fn median(mut values: Vec<f64>) -> f64 { values.sort_by(f64::total_cmp); values[values.len() / 2] }

fn table(title: &str, scores: &[Score], verbose: bool) {
    let m = |f: &dyn Fn(&Score) -> f64| median(scores.iter().map(f).collect());
    println!("{title}: all {:.3} middle {:.3} ({:.2} mm) apex {:.3} base {:.3} volume {:.3} ends {:.1} {:.1}", m(&|s| s.all), m(&|s| s.middle), m(&|s| s.mean_mm),
        m(&|s| s.apex), m(&|s| s.base), m(&|s| s.volume.abs()), m(&|s| s.ends[0].abs()), m(&|s| s.ends[1].abs()));
    if verbose { for s in scores { println!("   {:.2} {:.2} {:.2} mm {:.2} {:.2} {:+.2} {:+.1} {:+.1}", s.all, s.middle, s.mean_mm, s.apex, s.base, s.volume, s.ends[0], s.ends[1]); } }
}

fn main() {
    let dir = std::env::args().nth(1).expect("folder");
    let dir = Path::new(&dir);
    let mut names: Vec<String> = std::fs::read_dir(dir.join("images")).expect("images").map(|entry| entry.expect("entry").file_name().into_string().expect("name")).collect();
    names.sort();
    let cases: Vec<TrainingCase> = names.iter().map(|name| load(dir, name)).collect();
    let start = std::time::Instant::now();
    let results: Vec<[Score; 3]> = (0..cases.len()).into_par_iter().map(|left| {
        let others: Vec<TrainingCase> = cases.iter().enumerate().filter(|(index, _)| *index != left).map(|(_, case)| case.clone()).collect();
        let model = Model::train(&others);
        let case = &cases[left];
        let (gland, found, _) = experiment::fit(&model, &case.stack, 1);
        let truth = Gland::of_outlines(&case.outlines).unwrap();
        let (best, error) = experiment::best(&model, &case.stack, &truth);
        if std::env::var("V").is_ok() { println!("{} {} found {:.2} true {:.2} evals {} dims {}", left, case.name, found.error, error, found.evaluations, model.gland.dimensions()); }
        [score(&case.stack, &case.outlines, &experiment::mean(&model, &case.stack)), score(&case.stack, &case.outlines, &best), score(&case.stack, &case.outlines, &gland)]
    }).collect();
    for (i, title) in ["mean", "best", "found"].iter().enumerate() {
        table(title, &results.iter().map(|r| r[i].clone()).collect::<Vec<_>>(), i == 2 && std::env::var("V").is_ok());
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
}
