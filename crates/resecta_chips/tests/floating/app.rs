//! The plugin in an app.

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
    time::TimeUpdateStrategy,
};
use resecta_chips::{ChipSettings, Chips, ChipsPlugin, FloatingChip};
use resecta_fluid::FluidPlugins;
use resecta_tissue::{TissueChip, TissuePlugin};

use crate::scenes::{DENSITY, bladder, of_heap};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TissuePlugin::default(),
        FluidPlugins::default(),
        ChipsPlugin::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
    .edit_schedule(FixedPostUpdate, |schedule| {
        schedule.set_build_settings(ScheduleBuildSettings {
            ambiguity_detection: LogLevel::Error,
            ..default()
        });
    });
    app
}

fn tell(app: &mut App, tissue: Entity, index: usize) {
    app.world_mut().write_message(TissueChip {
        tissue,
        tool: None,
        chip: of_heap(index),
    });
}

#[test]
fn chips_of_its_tissue_become_entities_that_move() {
    let mut app = app();
    let tissue = app.world_mut().spawn_empty().id();
    let other = app.world_mut().spawn_empty().id();
    let chips = Chips::new(ChipSettings::default(), bladder(), DENSITY, tissue, other).unwrap();
    app.insert_resource(chips);
    app.update();
    tell(&mut app, tissue, 0);
    tell(&mut app, other, 1);
    for _ in 0..30 {
        app.update();
    }
    let mut query = app.world_mut().query::<&FloatingChip>();
    let shown: Vec<&FloatingChip> = query.iter(app.world()).collect();
    let [chip] = shown[..] else {
        panic!("{} chips", shown.len())
    };
    assert!(chip.now.translation.y > chip.before.translation.y, "it sinks");
    let totals = app.world().resource::<Chips>().totals();
    assert!((totals.told_g - of_heap(0).rest_volume_mm3 * DENSITY).abs() < 1e-12);
    assert!((totals.in_body_g - chip.mass_g).abs() < 1e-12);
}

#[test]
fn without_the_resource_nothing_floats() {
    let mut app = app();
    let tissue = app.world_mut().spawn_empty().id();
    app.update();
    tell(&mut app, tissue, 0);
    app.update();
    assert_eq!(app.world_mut().query::<&FloatingChip>().iter(app.world()).count(), 0);
}
