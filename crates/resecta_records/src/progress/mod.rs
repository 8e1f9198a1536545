//! What trainees' runs came to, in a database that survives a kill at any moment.
//!
//! One SQLite file: write-ahead log, every commit handed to the disk before it is told. A run is known by the hash of its record,
//! so that what is imported twice is there once.

mod curves;
mod error;
mod exchange;
mod history;
mod run;
mod schema;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use rusqlite::{Connection, OptionalExtension, Row, params};

pub use curves::{Curve, curves, table};
pub use error::ProgressError;
pub use exchange::{EXPORT_FORMAT, Export, to_csv};
pub use run::PastRun;

use crate::{
    folder,
    record::{RECORD_SUFFIX, RunRecord},
};

/// Name of the database in the user's folder.
pub const DATABASE: &str = "progress.sqlite";
/// Who plays before anybody was named.
pub const FIRST_TRAINEE: &str = "Trainee";
/// Longest name of a trainee, letters.
pub const MAX_NAME: usize = 40;
/// How long another program may hold the database before we give up.
const PATIENCE: Duration = Duration::from_secs(10);

/// The database, open.
#[derive(Debug)]
pub struct Progress {
    connection: Connection,
    file: PathBuf,
}

impl Progress {
    /// Opens the user's own, and makes it at first. Also what there is to tell: an old history that was taken in, records that
    /// were not known or cannot be read.
    ///
    /// # Errors
    /// [`ProgressError`]: no folder for it is known here, or as of [`Progress::open`].
    pub fn of_user() -> Result<(Self, Vec<String>), ProgressError> {
        Self::of_folder(&folder::of_user().ok_or(ProgressError::NoFolder)?)
    }

    /// As [`Progress::of_user`], in this folder.
    ///
    /// # Errors
    /// As of [`Progress::open`].
    pub fn of_folder(folder: &Path) -> Result<(Self, Vec<String>), ProgressError> {
        let mut progress = Self::open(&folder.join(DATABASE))?;
        let mut notes = Vec::new();
        let trainee = progress.present_trainee()?.unwrap_or(FIRST_TRAINEE.into());
        if let Some((runs, broken)) = progress.import_history(folder, &trainee)? {
            let broken = match broken {
                0 => String::new(),
                lines => format!("; {lines} lines of it could not be read"),
            };
            notes.push(format!(
                "{runs} scores of an earlier version are now {trainee}'s{broken}"
            ));
        }
        let (adopted, refused) = progress.adopt(&folder.join(folder::RECORDS))?;
        if adopted > 0 {
            notes.push(format!("{adopted} records were found that were not noted yet"));
        }
        notes.extend(refused);
        Ok((progress, notes))
    }

    /// Opens a database, makes it and its folder where there is none, and brings one of an earlier program up to date.
    ///
    /// # Errors
    /// [`ProgressError`] names the file: it is no database, one of a later program, or cannot be opened.
    pub fn open(file: &Path) -> Result<Self, ProgressError> {
        if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|source| ProgressError::Folder {
                folder: folder.into(),
                source,
            })?;
        }
        let mut connection = Connection::open(file).map_err(|source| ProgressError::database(file, source))?;
        let prepared = schema::prepare(&mut connection, PATIENCE);
        match prepared.map_err(|source| ProgressError::database(file, source))? {
            version if version > schema::VERSION => Err(ProgressError::LaterVersion {
                file: file.into(),
                version,
                known: schema::VERSION,
            }),
            _ => Ok(Self {
                connection,
                file: file.into(),
            }),
        }
    }

    /// The file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    fn failed(&self, source: rusqlite::Error) -> ProgressError {
        ProgressError::database(&self.file, source)
    }

    /// The trainees, by name.
    ///
    /// # Errors
    /// [`ProgressError::Database`].
    pub fn trainees(&self) -> Result<Vec<String>, ProgressError> {
        let read = || -> rusqlite::Result<Vec<String>> {
            let mut rows = self.connection.prepare("SELECT name FROM trainees ORDER BY name")?;
            rows.query_map([], |row| row.get(0))?.collect()
        };
        read().map_err(|source| self.failed(source))
    }

    /// Adds a trainee; one who is there stays. Returns the name as it is kept.
    ///
    /// # Errors
    /// [`ProgressError::Name`] of one that cannot be a name.
    pub fn add_trainee(&mut self, name: &str) -> Result<String, ProgressError> {
        let name = checked_name(name)?;
        let added = self
            .connection
            .execute("INSERT OR IGNORE INTO trainees (name) VALUES (?1)", [&name]);
        added.map_err(|source| self.failed(source))?;
        // The same name in other letters is the same trainee.
        let kept = self
            .connection
            .query_row("SELECT name FROM trainees WHERE name = ?1", [&name], |row| row.get(0));
        kept.map_err(|source| self.failed(source))
    }

    /// Who played last; none before anybody did.
    ///
    /// # Errors
    /// [`ProgressError::Database`].
    pub fn present_trainee(&self) -> Result<Option<String>, ProgressError> {
        let sql = "SELECT value FROM state WHERE key = 'trainee'";
        let read = self.connection.query_row(sql, [], |row| row.get(0)).optional();
        read.map_err(|source| self.failed(source))
    }

    /// Keeps who plays, until another does.
    ///
    /// # Errors
    /// [`ProgressError`], as of [`Progress::add_trainee`].
    pub fn set_present_trainee(&mut self, name: &str) -> Result<String, ProgressError> {
        let name = self.add_trainee(name)?;
        let sql = "INSERT INTO state (key, value) VALUES ('trainee', ?1) ON CONFLICT (key) DO UPDATE SET value = ?1";
        self.connection
            .execute(sql, [&name])
            .map_err(|source| self.failed(source))?;
        Ok(name)
    }

    /// Adds runs, all or none. Those that are there already stay as they are. Returns how many were new; when it returns they are
    /// on the disk.
    ///
    /// # Errors
    /// [`ProgressError`]: a trainee's name cannot be one, or the database failed.
    pub fn add(&mut self, runs: &[PastRun]) -> Result<usize, ProgressError> {
        for run in runs {
            checked_name(&run.trainee)?;
            run.check().map_err(|what| ProgressError::Run {
                identity: run.identity.clone(),
                what,
            })?;
        }
        insert(&mut self.connection, runs).map_err(|source| ProgressError::database(&self.file, source))
    }

    /// The runs of a trainee, or of all, in the order in which they ended.
    ///
    /// # Errors
    /// [`ProgressError::Database`].
    pub fn runs(&self, trainee: Option<&str>) -> Result<Vec<PastRun>, ProgressError> {
        read_runs(&self.connection, trainee).map_err(|source| self.failed(source))
    }

    /// Adds the runs of records in a folder that are not known yet: those of a program that was killed between writing a record
    /// and noting it. Returns how many there were, and what is wrong with records that could not be read.
    ///
    /// # Errors
    /// [`ProgressError::Database`].
    pub fn adopt(&mut self, records: &Path) -> Result<(usize, Vec<String>), ProgressError> {
        let known: Vec<String> = self.runs(None)?.into_iter().filter_map(|run| run.record).collect();
        let Ok(entries) = fs::read_dir(records) else {
            return Ok((0, Vec::new()));
        };
        let mut names: Vec<String> = (entries.flatten())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.retain(|name| name.ends_with(RECORD_SUFFIX) && !name.starts_with('.') && !known.contains(name));
        names.sort();
        let (mut runs, mut refused) = (Vec::new(), Vec::new());
        for name in names {
            match RunRecord::load(&records.join(&name)) {
                Ok((record, identity)) => runs.push(PastRun {
                    record: Some(name.clone()),
                    ..PastRun::of_record(&record, &identity, run::ended_at(&records.join(&name)))
                }),
                Err(error) => refused.push(error.to_string()),
            }
        }
        Ok((self.add(&runs)?, refused))
    }
}

/// A name as it is kept.
fn checked_name(name: &str) -> Result<String, ProgressError> {
    let name = name.trim();
    let is_name = !name.is_empty() && name.chars().count() <= MAX_NAME && !name.chars().any(char::is_control);
    if is_name {
        Ok(name.to_owned())
    } else {
        Err(ProgressError::Name { name: name.into() })
    }
}

fn insert(connection: &mut Connection, runs: &[PastRun]) -> rusqlite::Result<usize> {
    let transaction = connection.transaction()?;
    let mut added = 0;
    for run in runs {
        transaction.execute(
            "INSERT OR IGNORE INTO trainees (name) VALUES (?1)",
            [run.trainee.trim()],
        )?;
        let sql = "INSERT OR IGNORE INTO runs (identity, trainee, exercise, title, exercise_hash, case_name, version, ended, \
            ended_unix_s, steps, elapsed_s, score, out_of, medal, record) VALUES (?1, (SELECT id FROM trainees WHERE name = ?2), \
            ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15)";
        let is_new = transaction.execute(
            sql,
            params![
                run.identity,
                run.trainee.trim(),
                run.exercise,
                run.title,
                run.exercise_hash,
                run.case,
                run.version,
                run.ended.map(run::word),
                run.ended_unix_s as i64,
                run.steps as i64,
                run.elapsed_s,
                run.score,
                run.out_of,
                run.medal.map(run::word),
                run.record,
            ],
        )?;
        if is_new == 0 {
            continue;
        }
        added += 1;
        let id = transaction.last_insert_rowid();
        let mut insert = transaction.prepare("INSERT INTO metrics (run, metric, value) VALUES (?1, ?2, ?3)")?;
        for (metric, value) in &run.metrics {
            insert.execute(params![id, metric, value])?;
        }
    }
    transaction.commit()?;
    Ok(added)
}

fn read_runs(connection: &Connection, trainee: Option<&str>) -> rusqlite::Result<Vec<PastRun>> {
    let sql = "SELECT identity, name, exercise, title, exercise_hash, case_name, version, ended, ended_unix_s, steps, elapsed_s, \
        score, out_of, medal, record, runs.id FROM runs JOIN trainees ON trainees.id = runs.trainee \
        WHERE ?1 IS NULL OR name = ?1 ORDER BY ended_unix_s, runs.id";
    let mut rows = connection.prepare(sql)?;
    let runs = rows.query_map([trainee], |row| Ok((read_run(row)?, row.get::<_, i64>(15)?)))?;
    let mut runs: Vec<(PastRun, i64)> = runs.collect::<rusqlite::Result<_>>()?;
    let mut metrics = connection.prepare("SELECT metric, value FROM metrics WHERE run = ?1")?;
    for (run, id) in &mut runs {
        let rows = metrics.query_map([*id], |row| Ok((row.get(0)?, row.get(1)?)))?;
        run.metrics = rows.collect::<rusqlite::Result<_>>()?;
    }
    Ok(runs.into_iter().map(|(run, _)| run).collect())
}

fn read_run(row: &Row) -> rusqlite::Result<PastRun> {
    let whole = |column| row.get::<_, i64>(column).map(|number| number.max(0) as u64);
    let word = |column| row.get::<_, Option<String>>(column);
    Ok(PastRun {
        identity: row.get(0)?,
        trainee: row.get(1)?,
        exercise: row.get(2)?,
        title: row.get(3)?,
        exercise_hash: row.get(4)?,
        case: row.get(5)?,
        version: row.get(6)?,
        ended: word(7)?.and_then(run::of_word),
        ended_unix_s: whole(8)?,
        steps: whole(9)?,
        elapsed_s: row.get(10)?,
        score: row.get(11)?,
        out_of: row.get(12)?,
        medal: word(13)?.and_then(run::of_word),
        record: row.get(14)?,
        metrics: Default::default(),
    })
}
