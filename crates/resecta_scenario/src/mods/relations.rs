//! How mods stand to each other: ids given twice, conflicts, needs that are not met, circles of needs.

use std::{collections::BTreeMap, sync::Arc};

use super::{MANIFEST, Mod, ModAside, ModError, Mods, manifest::broken};
use crate::errors::RuleError;

/// Puts aside every mod that cannot be used beside the others.
pub(super) fn settle(mods: &mut Mods) {
    put_aside(mods, of_one_id);
    put_aside(mods, conflicts);
    put_aside(mods, circles);
    // One that is put aside may leave others without what they need.
    while put_aside(mods, unmet) {}
}

/// Puts aside the mods in which a rule finds faults. Whether there were any.
fn put_aside(mods: &mut Mods, rule: impl Fn(&Mods, &Mod) -> Vec<RuleError>) -> bool {
    let found: Vec<Vec<RuleError>> = mods.good.iter().map(|one| rule(mods, one)).collect();
    let mut is_any = false;
    let mut good = Vec::new();
    for (one, rules) in std::mem::take(&mut mods.good).into_iter().zip(found) {
        if rules.is_empty() {
            good.push(one);
            continue;
        }
        is_any = true;
        let file = one.folder().join(MANIFEST);
        let faults = rules
            .into_iter()
            .map(|rule| Arc::new(ModError::from(broken(file.clone(), &one.text, rule))));
        mods.aside.push(ModAside {
            faults: faults.collect(),
            folder: one.folder().into(),
            id: one.manifest.id,
        });
    }
    mods.good = good;
    is_any
}

/// Two mods of one id cannot be told apart: neither can be used.
fn of_one_id(mods: &Mods, one: &Mod) -> Vec<RuleError> {
    let id = &one.manifest.id;
    let others = mods
        .good
        .iter()
        .filter(|other| other.manifest.id == *id && !std::ptr::eq(*other, one));
    let rule = |other: &Mod| {
        let expected = format!(
            "an id that no other mod has, but {} has it, too",
            other.folder().join(MANIFEST).display()
        );
        RuleError::new("id", format_args!("\"{id}\""), expected)
    };
    others.map(rule).collect()
}

/// The mod that names another as a conflict steps back.
fn conflicts(mods: &Mods, one: &Mod) -> Vec<RuleError> {
    let named = one.manifest.conflicts.iter().enumerate();
    let rule = |(number, id): (usize, &String)| {
        let other = mods.get(id)?;
        let expected = format!("that it is not there, but it is: {}", other.folder().display());
        Some(RuleError::new(
            format!("conflicts[{number}]"),
            format_args!("\"{id}\""),
            expected,
        ))
    };
    named.filter_map(rule).collect()
}

/// Mods that need each other in a circle.
fn circles(mods: &Mods, one: &Mod) -> Vec<RuleError> {
    let id = one.manifest.id.as_str();
    let needs = one.manifest.needs.iter().enumerate();
    let rule = |(number, (need, _)): (usize, &(String, _))| {
        let way = way_between(mods, need, id)?;
        let circle = format!("no circle, but {id} needs {}", way.join(" needs "));
        Some(RuleError::new(
            format!("needs[{number}].id"),
            format_args!("\"{need}\""),
            circle,
        ))
    };
    needs.filter_map(rule).collect()
}

/// The shortest chain of needs from one mod to another, both included.
fn way_between<'a>(mods: &'a Mods, from: &'a str, to: &str) -> Option<Vec<&'a str>> {
    let mut before: BTreeMap<&str, Option<&str>> = BTreeMap::from([(from, None)]);
    let mut next = vec![from];
    while !next.is_empty() {
        if next.contains(&to) {
            let mut way = vec![*before.get_key_value(to)?.0];
            while let Some(&Some(earlier)) = way.last().and_then(|last| before.get(last)) {
                way.push(earlier);
            }
            way.reverse();
            return Some(way);
        }
        let mut further = Vec::new();
        for id in next {
            for (need, _) in mods.get(id).iter().flat_map(|one| &one.manifest.needs) {
                if !before.contains_key(need.as_str()) {
                    before.insert(need, Some(id));
                    further.push(need.as_str());
                }
            }
        }
        next = further;
    }
    None
}

/// Needs of a mod that is not there, cannot be used or has another version.
fn unmet(mods: &Mods, one: &Mod) -> Vec<RuleError> {
    let needs = one.manifest.needs.iter().enumerate();
    let rule = |(number, (id, versions)): (usize, &(String, semver::VersionReq))| {
        let field = format!("needs[{number}].id");
        match mods.get(id) {
            Some(other) if versions.matches(&other.manifest.version) => None,
            Some(other) => {
                let expected = format!(
                    "versions with {} among them, which `{id}` has here",
                    other.manifest.version
                );
                let field = format!("needs[{number}].version");
                Some(RuleError::new(field, format_args!("\"{versions}\""), expected))
            }
            None if mods.aside.iter().any(|aside| aside.id == *id) => {
                let expected = "a mod that can be used: this one is put aside, too";
                Some(RuleError::new(field, format_args!("\"{id}\""), expected))
            }
            None => {
                let others = mods.good.iter().map(|other| other.manifest.id.as_str());
                let others = others.filter(|other| *other != one.manifest.id);
                Some(RuleError::unknown_name(field, id, "a mod that is there", others))
            }
        }
    };
    needs.filter_map(rule).collect()
}
