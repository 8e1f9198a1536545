//! The report of a run as a page of its own, saved beside the record of the run.

use std::path::PathBuf;

use bevy::prelude::*;
use resecta_scenario::Report;
use resecta_text::write_whole;

use super::Debriefing;
use crate::{
    game::{history::History, moments::Moments},
    key_pictures::KeyPicture,
    page,
    view::png_of,
};

/// Writes the report where it was asked for.
pub fn save(world: &mut World) {
    let saved = write(world);
    let mut debriefing = world.resource_mut::<Debriefing>();
    debriefing.wants_report = false;
    debriefing.report = Some(saved);
}

/// Whether the player asked for the report.
pub fn is_wanted(debriefing: Res<Debriefing>) -> bool {
    debriefing.wants_report
}

/// The file, or why there is none.
fn write(world: &World) -> Result<PathBuf, String> {
    let record = world.resource::<History>().record.as_ref();
    let file = record.ok_or("this run was not kept, so there is no place for its report")?;
    let file = file.with_extension("html");
    let images = world.resource::<Assets<Image>>();
    let pictures = world.resource::<Moments>().kept().filter_map(|kept| {
        // A picture that is none is left out: the rest of the report stands.
        let png = png_of(images.get(&kept.image)?).ok()?;
        Some(KeyPicture {
            words: kept.words.clone(),
            time_s: kept.time_s,
            png,
        })
    });
    let pictures: Vec<KeyPicture> = pictures.collect();
    let report = Report::of_world(world).ok_or("no exercise is open")?;
    let page = page::page_of(world, &report, &pictures).ok_or("the exercise has no tissue")?;
    write_whole(&file, page.as_bytes()).map_err(|error| format!("{}: cannot be written: {error}", file.display()))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{scenario::RunLog, testing::Trial};

    #[test]
    fn it_is_saved_beside_the_record_or_it_is_told_why_not() {
        let folder = tempfile::tempdir().unwrap();
        let record = folder.path().join("20261123-first_cuts.resecta-run");
        let mut trial = Trial::new(());
        let world = trial.app.world_mut();
        world.init_resource::<RunLog>();
        world.init_resource::<Debriefing>();
        world.init_resource::<History>();
        world.init_resource::<Moments>();
        world.init_resource::<Assets<Image>>();
        trial.start("first_cuts").unwrap();
        trial.steps(2);

        let ask = |world: &mut World| {
            world.resource_mut::<Debriefing>().wants_report = true;
            save(world);
            let debriefing = world.resource::<Debriefing>();
            assert!(!debriefing.wants_report);
            debriefing.report.clone().unwrap()
        };
        let world = trial.app.world_mut();
        assert!(ask(world).unwrap_err().contains("was not kept"));
        world.resource_mut::<History>().record = Some(record);
        let file = ask(world).unwrap();
        assert_eq!(file, folder.path().join("20261123-first_cuts.html"));
        let page = std::fs::read_to_string(&file).unwrap();
        assert!(page.contains("<h1>First cuts</h1>"), "{}", &page[..400]);
    }
}
