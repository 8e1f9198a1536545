//! Which exercises are open to a trainee: a level of the curriculum opens by medals earned in the level before it.
//!
//! What is opened by name (`resecta --exercise NAME`) is never locked, nor is anything once the settings say so.

use std::{fmt, ptr};

use resecta_records::progress::PastRun;
use resecta_scenario::{Curriculum, EndReason, Medal, Needs};

use super::{
    catalogue::{Catalogue, Entry},
    history::History,
};

/// What opens an exercise.
#[derive(Debug, Clone, PartialEq)]
pub struct Opens {
    needs: Needs,
    /// Title of the level in which it is to be earned.
    level: String,
    /// The exercises of that level, by their names in the library.
    exercises: Vec<String>,
}

/// What is missing to open an exercise.
#[derive(Debug, Clone, PartialEq)]
pub struct Lock {
    opens: Opens,
    /// Exercises in which it is earned by now.
    earned: usize,
}

impl Opens {
    /// What opens a level, by its number; none for one that is open to everybody. `full` turns the name of an exercise in the
    /// curriculum into its name in the library.
    pub fn of(curriculum: &Curriculum, level: usize, full: impl Fn(&str) -> String) -> Option<Self> {
        let needs = curriculum.levels.get(level)?.needs?;
        let before = curriculum.levels.get(level.checked_sub(1)?)?;
        Some(Self {
            needs,
            level: before.title.clone(),
            exercises: before.exercises.iter().map(|name| full(name)).collect(),
        })
    }

    /// In how many exercises it is earned, by the best medal in each.
    fn earned(&self, medal: impl Fn(&str) -> Option<Medal>) -> usize {
        let is_earned = |name: &&String| medal(name) >= Some(self.needs.medal);
        self.exercises.iter().filter(is_earned).count()
    }
}

impl Catalogue {
    /// What the trainee lacks to open an exercise; nothing if it is open, as it is to whoever has set that all are.
    pub fn lock(&self, entry: &Entry, history: &History, all_open: bool) -> Option<Lock> {
        let opens = entry.opens.as_ref().filter(|_| !all_open)?;
        let earned = opens.earned(|name| self.medal(name, history));
        (earned < opens.needs.exercises as usize).then(|| Lock {
            opens: opens.clone(),
            earned,
        })
    }

    /// Titles of the levels that the trainee's last run opened: those that would be closed without it.
    pub fn opened_by_last<'a>(&'a self, exercise: &str, history: &History, all_open: bool) -> Vec<&'a str> {
        let Some(last) = history.of_exercise(exercise).next_back().filter(|_| !all_open) else {
            return Vec::new();
        };
        let mut titles = Vec::new();
        for entry in &self.entries {
            let (Some(opens), Some(title)) = (&entry.opens, &entry.level) else {
                continue;
            };
            let needed = opens.needs.exercises as usize;
            let before = opens.earned(|name| {
                let others = history.of_exercise(name).filter(|run| !ptr::eq(*run, last));
                self.medal_of(name, others)
            });
            let is_opened = before < needed && opens.earned(|name| self.medal(name, history)) >= needed;
            if is_opened && !titles.contains(&title.as_str()) {
                titles.push(title);
            }
        }
        titles
    }

    /// Which level medals in this exercise help to open, and what it still lacks; none once it is open.
    pub fn still_closed(&self, exercise: &str, history: &History, all_open: bool) -> Option<(&str, Lock)> {
        let mut locked = self.entries.iter().filter_map(|entry| {
            let lock = self.lock(entry, history, all_open)?;
            Some((entry.level.as_deref()?, lock))
        });
        locked.find(|(_, lock)| lock.opens.exercises.iter().any(|name| name == exercise))
    }

    /// The best medal that the trainee has for an exercise: what a run earned when it was played, or earns by today's pars.
    pub fn medal(&self, exercise: &str, history: &History) -> Option<Medal> {
        self.medal_of(exercise, history.of_exercise(exercise))
    }

    /// The best of these runs of an exercise.
    fn medal_of<'a>(&self, exercise: &str, runs: impl Iterator<Item = &'a PastRun>) -> Option<Medal> {
        let entry = self.get(exercise);
        let pars = entry.and_then(|entry| entry.loaded.exercise.total_pars.as_ref());
        let medals = runs.filter_map(|run| {
            let was_harm = run.ended.is_some_and(EndReason::is_harm);
            let by_today = pars.filter(|_| !was_harm).and_then(|pars| pars.medal(run.score));
            run.medal.max(by_today)
        });
        medals.max()
    }
}

impl fmt::Display for Lock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Opens { needs, level, .. } = &self.opens;
        let exercises = match needs.exercises {
            1 => "one exercise".into(),
            count => format!("{count} exercises"),
        };
        write!(
            f,
            "Opens with {} in {exercises} of “{level}” ({} so far)",
            needs.medal.name(),
            self.earned
        )
    }
}

#[cfg(test)]
mod tests {
    use resecta_scenario::Library;

    use super::*;
    use crate::game::catalogue::Sources;

    fn shipped() -> Catalogue {
        let library = Library::new("assets");
        Sources {
            library,
            mods: None,
            own: None,
        }
        .read()
    }

    fn locked(catalogue: &Catalogue, history: &History, exercise: &str) -> Option<Lock> {
        catalogue.lock(catalogue.get(exercise).unwrap(), history, false)
    }

    #[test]
    fn levels_open_one_after_the_other_as_medals_come() {
        let catalogue = shipped();
        let mut history = History::default();
        let mut opened = 0;
        // Whoever earns what a level asks for opens the next one, and no other before that.
        for (number, entry) in catalogue.entries.iter().enumerate() {
            if locked(&catalogue, &history, &entry.loaded.name).is_some() {
                opened += 1;
                let before = entry.opens.as_ref().unwrap();
                let needed = before.needs.exercises as usize;
                let with_pars: Vec<&String> = (before.exercises.iter())
                    .filter(|name| catalogue.get(name).unwrap().loaded.exercise.total_pars.is_some())
                    .collect();
                assert!(with_pars.len() >= needed, "{} can never be opened", entry.loaded.name);
                for name in &with_pars[..needed] {
                    assert!(locked(&catalogue, &history, &entry.loaded.name).is_some());
                    let pars = catalogue.get(name).unwrap().loaded.exercise.total_pars.clone().unwrap();
                    history.add_played(name, pars.of(before.needs.medal));
                }
            }
            let is_open = |entry: &Entry| locked(&catalogue, &history, &entry.loaded.name).is_none();
            assert!(
                catalogue.entries[..=number].iter().all(is_open),
                "{}",
                entry.loaded.name
            );
        }
        assert_eq!(opened, 2, "two levels are closed at first");
    }

    #[test]
    fn the_run_that_earns_the_last_medal_opens_the_level_and_no_other_does() {
        let catalogue = shipped();
        let mut history = History::default();
        let opened = |history: &History, exercise: &str| catalogue.opened_by_last(exercise, history, false);
        assert!(opened(&history, "orientation").is_empty());
        history.add_medal("orientation", Medal::Gold);
        assert!(opened(&history, "orientation").is_empty(), "one of two");
        history.add_played("tutorial", 0.0);
        assert!(opened(&history, "tutorial").is_empty(), "no medal");
        let closed = |history: &History| {
            let closed = catalogue.still_closed("tutorial", history, false);
            closed.map(|(level, lock)| format!("{level}: {lock}"))
        };
        let words = "Parts of an operation: Opens with bronze in 2 exercises of “First steps” (1 so far)";
        assert_eq!(closed(&history).as_deref(), Some(words));
        history.add_medal("tutorial", Medal::Bronze);
        assert_eq!(closed(&history), None);
        assert_eq!(opened(&history, "tutorial"), ["Parts of an operation"]);
        assert!(catalogue.opened_by_last("tutorial", &history, true).is_empty());
        history.add_medal("tutorial", Medal::Gold);
        assert!(opened(&history, "tutorial").is_empty(), "it was open before");
        history.add_medal("irrigation", Medal::Gold);
        assert!(opened(&history, "irrigation").is_empty(), "three of two");
    }

    #[test]
    fn a_lock_says_what_opens_it_and_a_medal_once_earned_counts_whatever_the_pars_are_now() {
        let catalogue = shipped();
        let mut history = History::default();
        let told = |history: &History| locked(&catalogue, history, "apex").unwrap().to_string();
        assert_eq!(
            told(&history),
            "Opens with bronze in 2 exercises of “First steps” (0 so far)"
        );
        history.add_played("orientation", 1.0);
        assert!(told(&history).ends_with("(0 so far)"));
        history.add_medal("orientation", Medal::Bronze);
        history.add_medal("orientation", Medal::Gold);
        assert!(told(&history).ends_with("(1 so far)"));
    }
}
