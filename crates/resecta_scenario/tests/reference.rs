//! The reference and the schema say what is read, and are current in `docs/`.

use std::path::Path;

use resecta_scenario::{Exercise, Library, new_exercise, reference};
use serde_json::{Value, json};

/// What an exercise written as JSON breaks of the schema: enough of JSON Schema for ours.
fn breaks(schema: &Value, root: &Value, value: &Value, at: &str) -> Option<String> {
    let broken = |what: &str| Some(format!("{at}: {what}: {value}"));
    if let Some(path) = schema["$ref"].as_str() {
        let part = root
            .pointer(path.trim_start_matches('#'))
            .expect("a reference leads somewhere");
        return breaks(part, root, value, at);
    }
    for (name, is_exact) in [("oneOf", true), ("anyOf", false)] {
        if let Some(all) = schema[name].as_array() {
            let kept = all.iter().filter(|one| breaks(one, root, value, at).is_none()).count();
            if kept == 0 || (is_exact && kept > 1) {
                return broken(&format!("{kept} of {name}"));
            }
        }
    }
    let is_type = |name: &str| match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{other}"),
    };
    let is_typed = match &schema["type"] {
        Value::Array(names) => names.iter().filter_map(Value::as_str).any(is_type),
        Value::String(name) => is_type(name),
        _ => true,
    };
    if !is_typed || schema.get("const").is_some_and(|only| only != value) {
        return broken("another type or value");
    }
    if schema["enum"].as_array().is_some_and(|all| !all.contains(value)) {
        return broken("none of the values");
    }
    if let Some(number) = value.as_f64() {
        let is_in = schema["minimum"].as_f64().is_none_or(|least| number >= least)
            && schema["exclusiveMinimum"].as_f64().is_none_or(|above| number > above)
            && schema["maximum"].as_f64().is_none_or(|most| number <= most);
        if !is_in {
            return broken("out of its range");
        }
    }
    if let Some(elements) = value.as_array() {
        let count = elements.len() as u64;
        if schema["minItems"].as_u64().is_some_and(|least| count < least)
            || schema["maxItems"].as_u64().is_some_and(|most| count > most)
        {
            return broken("too few or too many");
        }
        let mut elements = elements.iter().enumerate();
        return elements.find_map(|(index, value)| breaks(&schema["items"], root, value, &format!("{at}/{index}")));
    }
    let fields = value.as_object()?;
    let required = schema["required"].as_array().into_iter().flatten();
    if let Some(missing) = required
        .filter_map(Value::as_str)
        .find(|name| !fields.contains_key(*name))
    {
        return broken(&format!("{missing} is missing"));
    }
    fields
        .iter()
        .find_map(|(name, value)| match schema["properties"].get(name) {
            Some(field) => breaks(field, root, value, &format!("{at}/{name}")),
            None if schema["additionalProperties"] == false => broken(&format!("{name} is unknown")),
            None => None,
        })
}

fn schema() -> Value {
    serde_json::from_str(&reference::schema()).unwrap()
}

fn as_json(exercise: &Exercise) -> Value {
    serde_json::to_value(exercise).unwrap()
}

#[test]
fn what_stands_in_docs_is_current() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    for (file, now) in [
        (reference::REFERENCE_FILE, reference::reference()),
        (reference::SCHEMA_FILE, reference::schema()),
    ] {
        let written = std::fs::read_to_string(docs.join(file)).unwrap_or_default();
        assert!(
            written == now,
            "docs/{file} is out of date: write it anew with `resecta reference --out docs`"
        );
    }
}

#[test]
fn every_shipped_exercise_keeps_the_schema_and_slips_do_not() {
    let library = Library::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets"));
    let schema = schema();
    for name in library.exercise_names() {
        let exercise = as_json(&library.load(&name).unwrap().exercise);
        assert_eq!(breaks(&schema, &schema, &exercise, &name), None);
        for (pointer, slip) in [
            ("/title", json!(7)),
            ("/goals", json!([])),
            ("/marked/zones/0", json!("MidleLobe")),
            ("/models/collision", json!("on")),
            ("/goals/0", json!({"RemoveMarked": {"part": 1}})),
            ("/limits/time_s", json!(0)),
        ] {
            let mut exercise = exercise.clone();
            *exercise.pointer_mut(pointer).unwrap() = slip;
            assert!(breaks(&schema, &schema, &exercise, &name).is_some(), "{name}{pointer}");
        }
    }
}

/// An exercise in which as much as can be is said.
fn full() -> Value {
    let exercise = Exercise::from_ron(&new_exercise("full"), Path::new("full.exercise.ron")).unwrap();
    let mut full = as_json(&exercise);
    full["models"]["water"] = json!({"bleeding": {}, "turbidity": {}, "absorption": {}});
    full["models"]["chips"] = json!({});
    full["models"]["poisson_ratio"] = json!(0.4);
    full["models"]["shear"] = json!("Diagonals");
    full["limits"] = json!({"time_s": 300.0, "capsule_cut_share": 0.3, "sphincter_injuries": 3, "blood_lost_ml": 100.0,
                            "absorbed_ml": 1000.0});
    // What is left out is filled in by its defaults.
    as_json(&serde_json::from_value(full).unwrap())
}

/// Every number of an exercise that the schema gives a range, by its path.
fn ranged<'a>(schema: &'a Value, root: &'a Value, value: &Value, at: &str, found: &mut Vec<(String, &'a Value)>) {
    if let Some(path) = schema["$ref"].as_str() {
        return ranged(
            root.pointer(path.trim_start_matches('#')).unwrap(),
            root,
            value,
            at,
            found,
        );
    }
    for one in ["oneOf", "anyOf"]
        .iter()
        .filter_map(|name| schema[*name].as_array())
        .flatten()
    {
        if breaks(one, root, value, at).is_none() {
            ranged(one, root, value, at, found);
        }
    }
    match value {
        Value::Number(_)
            if ["minimum", "exclusiveMinimum", "maximum"]
                .iter()
                .any(|name| schema.get(name).is_some()) =>
        {
            found.push((at.into(), schema));
        }
        Value::Array(elements) => {
            for (index, value) in elements.iter().enumerate() {
                ranged(&schema["items"], root, value, &format!("{at}/{index}"), found);
            }
        }
        Value::Object(fields) => {
            for (name, value) in fields {
                ranged(&schema["properties"][name], root, value, &format!("{at}/{name}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn a_number_out_of_the_range_that_is_told_breaks_a_rule_of_its_field() {
    let (schema, full) = (schema(), full());
    let mut found = Vec::new();
    ranged(&schema, &schema, &full, "", &mut found);
    // Vessels are checked with the gland that they lie in, and seeds may be any.
    found.retain(|(path, _)| !path.contains("/vessels/") && !path.ends_with("/seed"));
    assert!(found.len() > 35, "{found:?}");
    let refused = |path: &str, number: f64| {
        let mut exercise = full.clone();
        let value = exercise.pointer_mut(path).unwrap();
        *value = if value.is_u64() {
            json!(number as u64)
        } else {
            json!(number)
        };
        let faults = serde_json::from_value::<Exercise>(exercise).unwrap().faults();
        let field = path.rsplit('/').next().unwrap();
        faults.iter().any(|fault| fault.field.ends_with(field))
    };
    for (path, range) in &found {
        let [least, above, most] = ["minimum", "exclusiveMinimum", "maximum"].map(|name| range[name].as_f64());
        let is_count = full.pointer(path).unwrap().is_u64();
        let beside = |number: f64| if is_count { 1.0 } else { 1e-3 + number.abs() * 1e-3 };
        if let Some(least) = least.filter(|least| !is_count || *least > 0.0) {
            assert!(refused(path, least - beside(least)), "{path} below {least}");
        }
        if let Some(above) = above {
            assert!(refused(path, above), "{path} at {above}");
            assert!(!refused(path, above + 1e-2), "{path} just above {above}");
        }
        if let Some(most) = most {
            assert!(refused(path, most + beside(most)), "{path} above {most}");
        }
    }
}

#[test]
fn every_number_has_a_unit_or_is_a_mere_number() {
    // Values of a metric have its unit; points and medals have none.
    let bare = [
        "at_least",
        "bronze",
        "drag_of_sphere",
        "exercises",
        "from",
        "gold",
        "most",
        "points",
        "poisson_ratio",
        "pulsatility",
        "seed",
    ];
    let bare = [
        &bare[..],
        &[
            "blood_in_water",
            "silver",
            "sphincter_injuries",
            "to",
            "heart_rate_per_min",
            "axis",
            "resistance",
        ],
    ]
    .concat();
    let page = reference::reference();
    let numbers = page
        .lines()
        .filter(|line| line.contains("| number |") || line.contains("whole number"));
    for line in numbers {
        let cells: Vec<&str> = line.split(" | ").collect();
        let name = cells[0]
            .trim_start_matches("| ")
            .trim_start_matches("… ")
            .trim_matches('`');
        assert!(
            !cells[2].trim().is_empty() || bare.contains(&name) || name == "PreTension(..)",
            "{line}"
        );
    }
    assert!(
        page.contains("| `time_s` | number | s | above 0 | required | Simulated time, s, above 0. |"),
        "{page}"
    );
}
