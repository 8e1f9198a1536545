//! The tables, and how a database of an earlier program gets them.

use std::time::Duration;

use rusqlite::{Connection, TransactionBehavior};

/// What leads from each version to the next; a database tells its own as `user_version`.
const MIGRATIONS: [&str; 1] = ["
    CREATE TABLE trainees (
        id INTEGER PRIMARY KEY,
        name TEXT NOT NULL UNIQUE COLLATE NOCASE
    );
    CREATE TABLE runs (
        id INTEGER PRIMARY KEY,
        identity TEXT NOT NULL UNIQUE,
        trainee INTEGER NOT NULL REFERENCES trainees (id),
        exercise TEXT NOT NULL,
        title TEXT NOT NULL,
        exercise_hash TEXT NOT NULL,
        case_name TEXT NOT NULL,
        version TEXT NOT NULL,
        ended TEXT,
        ended_unix_s INTEGER NOT NULL,
        steps INTEGER NOT NULL,
        elapsed_s REAL NOT NULL,
        score REAL NOT NULL,
        out_of REAL NOT NULL,
        medal TEXT,
        record TEXT
    );
    CREATE INDEX runs_of_trainee ON runs (trainee, ended_unix_s);
    CREATE TABLE metrics (
        run INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
        metric TEXT NOT NULL,
        value REAL NOT NULL,
        PRIMARY KEY (run, metric)
    ) WITHOUT ROWID;
    CREATE TABLE state (
        key TEXT PRIMARY KEY,
        value TEXT NOT NULL
    ) WITHOUT ROWID;
"];

/// The version that this program knows.
pub const VERSION: u32 = MIGRATIONS.len() as u32;

/// Sets the database up as every connection needs it, and brings it up to date. Returns its version; one that is later than
/// [`VERSION`] is left as it is.
pub fn prepare(connection: &mut Connection, patience: Duration) -> rusqlite::Result<u32> {
    connection.busy_timeout(patience)?;
    if version(connection)? > VERSION {
        return version(connection);
    }
    // A commit returns when it is on the disk.
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    // Another program may do the same at the same time: who comes second finds it done.
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let known = version(&transaction)?;
    for migration in MIGRATIONS.iter().skip(known as usize) {
        transaction.execute_batch(migration)?;
    }
    if known < VERSION {
        transaction.pragma_update(None, "user_version", VERSION)?;
    }
    transaction.commit()?;
    Ok(known.max(VERSION))
}

fn version(connection: &Connection) -> rusqlite::Result<u32> {
    connection.query_row("PRAGMA user_version", [], |row| row.get(0))
}
