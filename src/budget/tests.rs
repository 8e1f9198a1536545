//! Laws of scenes, settings and comparisons.

use resecta_scenario::assets;
use resecta_solver::Effort;
use resecta_tissue::CutDetail;

use super::*;

/// A lattice that is coarse enough to play every scene in seconds.
const COARSE: Setting = Setting::Alpha(32.0);

fn library() -> Library {
    Library::new(assets::find().expect("the assets are beside the sources"))
}

/// How far the surface is from where it was at the first moment.
fn moved(played: &Played, look: usize) -> Apart {
    let (first, then) = (&played.shots[0], &played.shots[look]);
    let distances = Distances::between(&first.surface, &then.surface, &then.region);
    distances.summary().expect("there is tissue about the instrument")
}

#[test]
fn every_script_keeps_to_the_instruments_limits_and_every_moment_lies_in_it() {
    for scene in scenes() {
        let script = scene.script().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(script.duration_s(), scene.duration_s(), "{}", scene.key);
        let times: Vec<f64> = scene.looks.iter().map(|look| look.time_s).collect();
        assert!(
            times.is_sorted() && times[times.len() - 1] < scene.duration_s(),
            "{}",
            scene.key
        );
        assert!(
            (3.0..40.0).contains(&scene.duration_s()),
            "{}: {} s",
            scene.key,
            scene.duration_s()
        );
    }
}

#[test]
fn every_scene_pushes_tissue_and_every_stroke_leaves_a_trough() {
    for scene in scenes() {
        let played = play(&scene, COARSE, &library(), false).unwrap_or_else(|error| panic!("{error}"));
        let last = played.shots.len() - 1;
        let (with_sheath, after) = (moved(&played, last - 1), moved(&played, last));
        assert!(with_sheath.largest_mm > 1.0, "{}: {with_sheath:?}", scene.key);
        match scene.strokes() {
            0 => assert_eq!(played.removed_mm3, 0.0, "{}", scene.key),
            strokes => {
                // A pull of the loop through tissue takes some 15 mm of way and 20 mm² across.
                assert!(
                    played.removed_mm3 > 50.0 * strokes as f64,
                    "{}: {}",
                    scene.key,
                    played.removed_mm3
                );
                assert!(after.largest_mm > 1.5, "{}: {after:?}", scene.key);
            }
        }
    }
}

#[test]
fn a_scene_is_nowhere_apart_from_itself_and_a_finer_step_is() {
    let scene = &scenes()[1];
    let played = |setting| play(scene, setting, &library(), false).unwrap_or_else(|error| panic!("{error}"));
    let [one, again] = [COARSE, COARSE].map(played);
    let same = RunResult::of(COARSE, &one, Some(&again));
    let apart = same.apart.expect("there is tissue about the instrument");
    assert!(apart.largest_mm < 1e-5 && same.tips_mm == 0.0, "{apart:?}");
    assert_eq!(one.removed_mm3, again.removed_mm3);
    let other = RunResult::of(COARSE, &one, Some(&played(Setting::Alpha(28.0))));
    assert!(other.apart.expect("as above").rms_mm > 0.01);
}

#[test]
fn the_settings_called_shipped_are_those_that_ship() {
    for scene in scenes() {
        let exercise = scene.exercise(&library()).expect("it is made from a shipped one");
        let loaded = library().load_value(scene.key, exercise).expect("it is sound");
        let prepared = loaded.clone().prepare().expect("its gland can be built");
        for part in parts::all(false) {
            match part.shipped {
                Setting::Alpha(deg) => assert_eq!(loaded.exercise.alpha_deg, deg),
                Setting::Poisson(ratio) => assert_eq!(prepared.material.poisson_ratio, Some(ratio)),
                Setting::Spacing(spacing_mm) => {
                    assert_eq!(loaded.exercise.models.detail, CutDetail::Field { spacing_mm });
                }
                Setting::Substeps(substeps) => assert_eq!(prepared.tissue.solver().effort().substeps, substeps),
                Setting::Fastest(times) => {
                    let effort = prepared.tissue.solver().effort();
                    assert_eq!((times, effort), (1.0, Effort::fast(prepared.material.modulus_pa)));
                }
                Setting::StepHz(hz) => assert_eq!(hz, Setting::Shipped.step_hz()),
                other => panic!("{other:?} is no setting of a part"),
            }
        }
    }
}

#[test]
fn settings_go_from_coarse_to_fine_with_the_shipped_one_second() {
    for part in [parts::all(false), parts::all(true)].concat() {
        let mut numbers: Vec<f64> = part.others.iter().filter_map(|setting| setting.number()).collect();
        assert_eq!(numbers.len(), part.others.len(), "{}", part.key);
        numbers.insert(1, part.shipped.number().expect("a part is set by a number"));
        let descends = numbers.windows(2).all(|pair| pair[0] > pair[1]);
        assert!(numbers.is_sorted() || descends, "{}: {numbers:?}", part.key);
    }
}
