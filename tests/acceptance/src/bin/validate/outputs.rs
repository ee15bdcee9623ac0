//! Where the results go: every place is tried before a case is run, and each is written for itself after it.

use super::{Args, cut_methods, document, dump};
use bevy_clay::scene::export::whole::check_writable;
use clay_acceptance::cases::{CASES, Suite};
use clay_acceptance::data::{self, Record, Run};
use clay_acceptance::lab::{self, EngineKind};
use clay_acceptance::report::{KnownMiss, Row};
use clay_acceptance::{machine, say};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The rows of each case, by its name.
pub(crate) type Found = [(&'static str, Vec<Row>)];

/// What the JSON file holds.
#[derive(Serialize)]
struct Output<'a> {
    suite: Suite,
    quick: bool,
    engine: EngineKind,
    adapter: String,
    driver: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    commit: Option<String>,
    rows: Vec<&'a Row>,
}

/// Finds out whether every result could be written, and makes the folder of `--dump`.
///
/// # Errors
/// A file or folder that cannot be written, or documents that the rows cannot be put into, by name.
pub(crate) fn check(args: &Args, known: &[KnownMiss]) -> Result<(), String> {
    if let Some(file) = &args.json {
        check_writable(file).map_err(|e| format!("--json {e}"))?;
    }
    if let Some(docs) = &args.docs {
        // The documents as they are on record tell whether they can be made with rows in place of some.
        for (file, _) in documents(docs, vec![], known).map_err(|e| format!("--docs {e}"))? {
            check_writable(&file).map_err(|e| format!("--docs {e}"))?;
        }
    }
    if let Some(folder) = &args.dump {
        std::fs::create_dir_all(folder).map_err(|e| format!("--dump {}: {e}", folder.display()))?;
        check_writable(&folder.join(dump::OURS)).map_err(|e| format!("--dump {e}"))?;
    }
    Ok(())
}

/// Writes what was asked for, the rows first; says on standard error what could not be written, and whether
/// nothing was amiss.
pub(crate) fn write(args: &Args, found: &Found, known: &[KnownMiss]) -> bool {
    let mut faults = vec![];
    if let Some(file) = &args.json {
        match json(args, found) {
            Ok(text) => faults.extend(data::write_each("--json", &[(file.clone(), text.into_bytes())])),
            Err(error) => faults.push(format!("--json {}: {error}", file.display())),
        }
    }
    if let Some(docs) = &args.docs {
        match documents(docs, records(args, found), known) {
            Ok(files) => faults.extend(data::write_each("--docs", &files)),
            Err(error) => faults.push(format!("--docs {error}")),
        }
    }
    if let Some(folder) = &args.dump {
        faults.extend(dump::write(folder, args.size()).err());
    }
    faults.iter().for_each(|fault| say::error(fault));
    faults.is_empty()
}

fn json(args: &Args, found: &Found) -> Result<String, serde_json::Error> {
    let output = Output {
        suite: args.suite,
        quick: args.quick,
        engine: args.engine,
        adapter: machine::processor(),
        driver: lab::engine(0).describe(),
        commit: machine::commit(),
        rows: found.iter().flat_map(|f| &f.1).collect(),
    };
    Ok(serde_json::to_string_pretty(&output)? + "\n")
}

/// The rows with what they were measured with.
fn records(args: &Args, found: &Found) -> Vec<Record> {
    let run = Run {
        size: args.size(),
        engine: Some(args.engine),
        adapter: Some(args.engine.adapter()),
        date: machine::today(),
        commit: machine::commit(),
    };
    let record = |case: &str, row: &Row| Record { group: case.to_owned(), row: row.clone(), run: run.clone() };
    found.iter().flat_map(|(case, rows)| rows.iter().map(|row| record(case, row))).collect()
}

/// The documents in the folder `docs` with the rows of `new` on record: the record, and what shows it.
///
/// # Errors
/// What of the present documents cannot be read or has no room for the rows, by its file.
fn documents(docs: &Path, new: Vec<Record>, known: &[KnownMiss]) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
    let file = data::acceptance(docs);
    let records = data::merged(data::read(&file)?, new, &CASES.iter().map(|case| case.name).collect::<Vec<_>>());
    let results = data::read(&data::outcomes(docs))?;
    let record = data::text(&records).map_err(|e| format!("{}: {e}", file.display()))?;
    let picture = docs.join("images").join(cut_methods::NAME).with_extension("png");
    let png = cut_methods::draw(&records).map_err(|e| format!("{}: {e}", picture.display()))?;
    let page = docs.join("EVIDENCE.md");
    let text = std::fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    let text = document::page(&text, &records, known, &results).map_err(|e| format!("{}: {e}", page.display()))?;
    Ok(vec![(file, record.into_bytes()), (picture, png), (page, text.into_bytes())])
}
