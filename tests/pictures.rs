//! Pictures without a window, on whatever adapter there is (Mesa's lavapipe will do). One test a process draws.

mod common;

use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};
use resecta::{
    assets, headless,
    instrument::{InstrumentLimits, InstrumentScript, InstrumentSource},
    scenario::{Library, Metrics},
    view::{PICTURE_SIZE, Pictures, PicturesPlugin, finish_pictures},
};

/// In through the urethra to the middle lobe; a look with the loop out at 4.5 s, when the tissue has come to rest around the
/// sheath; one cut; a look from the same place.
const SCRIPT: &str = "(
    keys: [
        (time_s: 0, insertion_mm: 0, pitch_deg: -18, stroke_mm: 0),
        (time_s: 1, insertion_mm: 16, pitch_deg: -18),
        (time_s: 2, insertion_mm: 34, pitch_deg: -6),
        (time_s: 2.3, pitch_deg: -4.5, stroke_mm: 0),
        (time_s: 2.7, stroke_mm: 16),
        (time_s: 4.5, pitch_deg: -4.5, stroke_mm: 16, cut: true),
        (time_s: 4.7, pitch_deg: -5),
        (time_s: 5.4, pitch_deg: -5, stroke_mm: 2, cut: false),
        (time_s: 5.6, pitch_deg: -4.5, stroke_mm: 2),
        (time_s: 9, stroke_mm: 16, pitch_deg: -4.5),
    ],
)";

/// When the loop is 6 mm out: nothing lies between the lens and its arms yet.
const LOOP_OUT_STEP: u64 = 147;

#[test]
fn both_views_show_the_gland_and_what_a_cut_changes() {
    if common::no_driver() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let script = InstrumentScript::from_ron(SCRIPT, Path::new("cut.ron"), &InstrumentLimits::default()).unwrap();
    let prepared = Library::new(assets::find().unwrap())
        .load("first_cuts")
        .unwrap()
        .prepare()
        .unwrap();
    let mut app = headless::app(None);
    app.add_plugins(PicturesPlugin {
        folder: folder.path().join("frames"),
        count: 3,
        steps: 540,
        moments: vec![
            ("first_cut".into(), 200),
            ("bleeding".into(), 200),
            ("loop_out".into(), LOOP_OUT_STEP),
        ],
    });
    headless::start(&mut app, prepared, InstrumentSource::Script(script));
    Pictures::warm_up(&mut app).unwrap();
    assert_eq!(app.world().resource::<Metrics>().steps, 0, "warming up takes no step");
    headless::play(&mut app, |_| {});
    assert!(
        app.world().resource::<Metrics>().removal.volume_mm3 > 50.0,
        "the script cuts"
    );
    let steps = app.world().resource::<Metrics>().steps;
    let files = finish_pictures(&mut app).unwrap();
    assert_eq!(
        app.world().resource::<Metrics>().steps,
        steps,
        "the last picture takes no step"
    );

    let names = [
        "bleeding",
        "endoscope_000",
        "endoscope_001",
        "endoscope_002",
        "first_cut",
        "loop_out",
        "outside_000",
        "outside_001",
        "outside_002",
    ];
    let expected: Vec<PathBuf> = names
        .iter()
        .map(|name| folder.path().join("frames").join(format!("{name}.png")))
        .collect();
    assert_eq!(files, expected);
    let pictures: Vec<RgbImage> = files.iter().map(|file| image::open(file).unwrap().to_rgb8()).collect();
    for picture in &pictures {
        assert_eq!(picture.dimensions(), (PICTURE_SIZE.x, PICTURE_SIZE.y));
    }
    let [
        bleeding,
        _,
        before,
        after,
        first_cut,
        loop_out,
        _,
        outside_before,
        outside_after,
    ] = &pictures[..]
    else {
        panic!("{files:?}")
    };
    assert!(first_cut == bleeding, "two moments of one step are one picture");

    for picture in [before, after] {
        for (x, y) in [(0, 0), (959, 0), (0, 719), (959, 719), (100, 60), (860, 660)] {
            assert_eq!(
                picture.get_pixel(x, y),
                &Rgb([0, 0, 0]),
                "outside the round field at {x}, {y}"
            );
        }
        let share = share_of(picture, in_field, is_tissue);
        assert!(share > 0.6, "{share} of the field is tissue");
    }
    for picture in [outside_before, outside_after] {
        let share = share_of(picture, |_, _| true, is_tissue);
        assert!((0.08..0.8).contains(&share), "{share} of the outside view is tissue");
    }

    // Tissue that is drawn in front of what presses it aside would cover one of them here and not there.
    let arms = |from: u32, to: u32| share_of(loop_out, |x, _| (from..to).contains(&x), is_insulation);
    let [left, right] = [arms(120, 480), arms(480, 840)];
    assert!(
        left > 0.005 && (left / right - 1.0).abs() < 0.02,
        "{left} of the left half is arm, {right} of the right half"
    );

    // The cut runs below the middle of the field, where the loop hangs, and shows what is under the mucosa.
    let below = |x: u32, y: u32| (150..800).contains(&x) && (300..680).contains(&y);
    let [bare_before, bare_after] = [before, after].map(|picture| share_of(picture, below, is_cut));
    assert!(
        bare_after > bare_before + 0.3,
        "{bare_before} of the place shows cut tissue before, {bare_after} after"
    );
    assert!(
        mean_change(outside_before, outside_after, |_, _| true) > 0.05,
        "the section shows the cut"
    );
}

/// Well inside the round field.
fn in_field(x: u32, y: u32) -> bool {
    let (x, y) = (f64::from(x) - 479.5, f64::from(y) - 359.5);
    x.hypot(y) < 330.0
}

/// The colours of cut adenoma, dyed or not: paler than mucosa.
fn is_cut(Rgb([red, green, _]): &Rgb<u8>) -> bool {
    let [red, green] = [red, green].map(|value| f64::from(*value));
    red > 60.0 && green > 0.65 * red && green < 0.95 * red
}

/// The olive of the loop's arms: no tissue is as green.
fn is_insulation(Rgb([red, green, blue]): &Rgb<u8>) -> bool {
    let [red, green, blue] = [red, green, blue].map(|value| f64::from(*value));
    green > 50.0 && green > 0.87 * red && green > 1.3 * blue
}

/// Red before green and blue, and neither black nor white.
fn is_tissue(Rgb([red, green, blue]): &Rgb<u8>) -> bool {
    *red > 40 && *red > *green && *red > *blue
}

fn share_of(picture: &RgbImage, area: impl Fn(u32, u32) -> bool, is_it: impl Fn(&Rgb<u8>) -> bool) -> f64 {
    let inside: Vec<&Rgb<u8>> = picture
        .enumerate_pixels()
        .filter(|&(x, y, _)| area(x, y))
        .map(|(_, _, pixel)| pixel)
        .collect();
    inside.iter().filter(|pixel| is_it(pixel)).count() as f64 / inside.len() as f64
}

/// Mean difference of the channels, of 255.
fn mean_change(first: &RgbImage, second: &RgbImage, area: impl Fn(u32, u32) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for ((x, y, a), b) in first.enumerate_pixels().zip(second.pixels()) {
        if area(x, y) {
            sum += a.0.iter().zip(b.0).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>();
            count += 3.0;
        }
    }
    sum / count
}
