//! Order, repetition, steps of no length, and settings that make no sense.

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
    time::TimeUpdateStrategy,
};
use resecta_fluid::prelude::*;
use resecta_tissue::TissuePlugin;

use crate::scenes::{AT_60_HZ, app, assert_near, messages, run, spawn_cut, step, vessels};

#[test]
fn no_two_systems_of_the_step_are_ambiguous() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::default(), FluidPlugins::default()))
        .init_resource::<Bladder>()
        .init_resource::<Irrigation>()
        .init_resource::<Circulation>()
        .init_resource::<Turbidity>()
        .init_resource::<Absorption>();
    app.edit_schedule(FixedPostUpdate, |schedule| {
        schedule.set_build_settings(ScheduleBuildSettings {
            ambiguity_detection: LogLevel::Error,
            ..default()
        });
    });
    spawn_cut(&mut app, vessels(&[(VesselKind::Arterial, 0.1)]));
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.update();
    app.update();
    assert!(app.world().resource::<Bladder>().volume_ml() > 0.0);
}

/// The bits of all that the models have.
fn bits(app: &App) -> Vec<u64> {
    let world = app.world();
    let bladder = world.resource::<Bladder>();
    let totals = bladder.totals();
    let circulation = world.resource::<Circulation>();
    let turbidity = world.resource::<Turbidity>();
    [
        bladder.volume_ml(),
        bladder.inflow_ml_per_s(),
        bladder.outflow_ml_per_s(),
        totals.irrigated_ml,
        totals.blood_ml,
        totals.drained_ml,
        totals.absorbed_ml,
        circulation.beat(),
        circulation.lost_ml(VesselKind::Arterial),
        circulation.lost_ml(VesselKind::Venous),
        turbidity.concentration(),
        turbidity.washed_out_ml(),
        world.resource::<Absorption>().absorbed_ml(),
    ]
    .map(f64::to_bits)
    .to_vec()
}

fn operation() -> App {
    let mut app = app();
    let kinds = [
        (VesselKind::Arterial, 0.1),
        (VesselKind::Venous, 0.3),
        (VesselKind::Venous, 0.2),
    ];
    let mut of = vessels(&kinds);
    of.iter_mut().for_each(|vessel| vessel.clotting_s = 40.0);
    spawn_cut(&mut app, of.clone());
    spawn_cut(&mut app, of);
    for (outflow_tap, emptying) in [(0.2, false), (1.0, false), (1.0, true)] {
        let mut irrigation = app.world_mut().resource_mut::<Irrigation>();
        (irrigation.outflow_tap, irrigation.emptying) = (outflow_tap, emptying);
        run(&mut app, 30.0, AT_60_HZ);
    }
    app
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let first = bits(&operation());
    assert_eq!(bits(&operation()), first);
    assert_eq!(bits(&operation()), first);
}

#[test]
fn a_step_of_no_length_changes_nothing() {
    let mut app = operation();
    let lens = Lens {
        tip: Vec3::ZERO,
        direction: Vec3::Z,
    };
    let lens = app.world_mut().spawn((lens, RedOut { covered: 0.5 })).id();
    let before = bits(&app);
    for _ in 0..3 {
        step(&mut app, 0);
    }
    assert_eq!(bits(&app), before);
    assert_eq!(app.world().get::<RedOut>(lens).unwrap().covered, 0.5);
}

#[test]
fn each_plugin_works_alone_and_without_its_resources() {
    use resecta_fluid::{AbsorptionPlugin, BleedingPlugin, IrrigationPlugin, TurbidityPlugin};
    for alone in 0..4 {
        let mut app = App::new();
        app.add_plugins(MinimalPlugins)
            .insert_resource(TimeUpdateStrategy::ManualDuration(std::time::Duration::from_millis(20)));
        match alone {
            0 => app.add_plugins(IrrigationPlugin::new(Update)),
            1 => app.add_plugins(BleedingPlugin::new(Update)),
            2 => app.add_plugins(TurbidityPlugin::new(Update)),
            _ => app.add_plugins(AbsorptionPlugin::new(Update)),
        };
        app.update();
        app.update();
        app.init_resource::<Bladder>()
            .init_resource::<Irrigation>()
            .init_resource::<Circulation>()
            .init_resource::<Turbidity>()
            .init_resource::<Absorption>();
        app.update();
        let irrigated = app.world().resource::<Bladder>().totals().irrigated_ml;
        assert_eq!(irrigated > 0.0, alone == 0);
    }
}

#[test]
fn settings_that_make_no_sense_are_put_back_and_told() {
    let mut app = app();
    app.world_mut().resource_mut::<Irrigation>().bag_height_cmh2o = 80.0;
    app.world_mut().resource_mut::<Turbidity>().settings.extinction_per_mm = 2.0;
    step(&mut app, AT_60_HZ);
    assert!(messages::<FluidRefused>(&app).is_empty());
    let world = app.world_mut();
    world.resource_mut::<Irrigation>().bag_height_cmh2o = f64::NAN;
    world.resource_mut::<Bladder>().settings.compliance_ml_per_cmh2o = 0.0;
    world.resource_mut::<Circulation>().settings.heart_rate_per_min = f64::INFINITY;
    world.resource_mut::<Turbidity>().settings.extinction_per_mm = -1.0;
    world.resource_mut::<Absorption>().settings.threshold_pa = f64::NAN;
    step(&mut app, AT_60_HZ);
    let told: Vec<_> = messages::<FluidRefused>(&app)
        .into_iter()
        .map(|refused| (refused.what, refused.error.field))
        .collect();
    let expected = [
        ("Bladder", "compliance_ml_per_cmh2o"),
        ("Irrigation", "bag_height_cmh2o"),
        ("Circulation", "heart_rate_per_min"),
        ("Turbidity", "extinction_per_mm"),
        ("Absorption", "threshold_pa"),
    ];
    assert_eq!(told, expected);
    let world = app.world();
    assert_eq!(world.resource::<Irrigation>().bag_height_cmh2o, 80.0);
    assert_eq!(world.resource::<Turbidity>().settings.extinction_per_mm, 2.0);
    assert_eq!(world.resource::<Bladder>().settings.compliance_ml_per_cmh2o, 20.0);
    assert!(world.resource::<Bladder>().volume_ml().is_finite());
    assert_near(world.resource::<Bladder>().inflow_ml_per_s(), 80.0 / 12.0, 1e-12);
}

#[test]
fn constructors_refuse_by_name() {
    use resecta_fluid::{AbsorptionSettings, BladderSettings, CirculationSettings, TurbiditySettings};
    let bladder = BladderSettings {
        capacity_ml: 50.0,
        ..default()
    };
    assert_eq!(Bladder::new(bladder, 0.0).unwrap_err().field, "capacity_ml");
    assert_eq!(Bladder::new(default(), f64::NAN).unwrap_err().field, "volume_ml");
    let circulation = CirculationSettings {
        pulsatility: 1.5,
        ..default()
    };
    assert_eq!(Circulation::new(circulation).unwrap_err().field, "pulsatility");
    let turbidity = TurbiditySettings {
        fossa_ml: 0.0,
        ..default()
    };
    assert_eq!(
        Turbidity::new(turbidity).unwrap_err().to_string(),
        "fossa_ml is 0, expected 0.1 to 1,000 ml"
    );
    let absorption = AbsorptionSettings {
        threshold_pa: -1.0,
        ..default()
    };
    assert_eq!(Absorption::new(absorption).unwrap_err().field, "threshold_pa");
}

#[test]
fn the_public_types_are_registered_for_reflection() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    for name in [
        "Absorption",
        "Bladder",
        "Circulation",
        "Irrigation",
        "Lens",
        "RedOut",
        "Turbidity",
        "Vessel",
        "Vessels",
    ] {
        assert!(registry.get_with_short_type_path(name).is_some(), "{name}");
    }
}
