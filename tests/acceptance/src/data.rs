//! Results on record, docs/data/*.json: a list with an item a line, so that a change of one is a change of
//! one line.

use crate::lab::{EngineKind, Size};
use crate::report::Row;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a figure was measured with. What is not known of an old one is null.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// How large the case was; of other commands, whether it was their whole run.
    pub size: Size,
    /// The engine; none where no clay was stepped.
    pub engine: Option<EngineKind>,
    /// The processor or, for the GPU engine, what its passes ran on.
    pub adapter: Option<String>,
    /// The day, UTC.
    pub date: String,
    /// The commit of the source, `-dirty` behind it where the source was not as in that commit.
    pub commit: Option<String>,
}

impl Run {
    /// In a few words: size, engine, adapter, day, commit.
    pub fn words(&self) -> String {
        let engine = self.engine.map(EngineKind::name);
        let known = [Some(self.size.name()), engine, self.adapter.as_deref(), Some(&self.date), self.commit.as_deref()];
        known.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

/// A row of an acceptance case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The name of the case that the row is of.
    pub group: String,
    /// The row.
    #[serde(flatten)]
    pub row: Row,
    /// How it was measured.
    #[serde(flatten)]
    pub run: Run,
}

/// A row of a table of results of another command, written down by hand: each figure with what it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// The name of the table.
    pub table: String,
    /// Columns and what stands in them, units in the columns' names.
    pub cells: Vec<(String, String)>,
    /// How it was measured.
    #[serde(flatten)]
    pub run: Run,
}

/// The file of the results of other commands in the folder of the documents.
pub fn outcomes(docs: &Path) -> PathBuf {
    docs.join("data/commands.json")
}

/// The file of the acceptance cases' rows in the folder of the documents.
pub fn acceptance(docs: &Path) -> PathBuf {
    docs.join("data/acceptance.json")
}

/// `old` with the rows of `new` in place of those of the same cases, sizes and engines; cases in the `order`
/// of their names.
pub fn merged(old: Vec<Record>, new: Vec<Record>, order: &[&str]) -> Vec<Record> {
    let is_same = |a: &Record, b: &Record| a.group == b.group && a.run.size == b.run.size && a.run.engine == b.run.engine;
    let mut all: Vec<Record> = old.into_iter().filter(|o| !new.iter().any(|n| is_same(o, n))).collect();
    all.extend(new);
    // Stable: the rows of a case stay in their order.
    all.sort_by_key(|r| order.iter().position(|name| *name == r.group).unwrap_or(order.len()));
    all
}

/// The items of a file.
///
/// # Errors
/// A file that cannot be read, or that is no such list, with its name and line.
pub fn read<T: DeserializeOwned>(file: &Path) -> Result<Vec<T>, String> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    serde_json::from_str(&text).map_err(|e| format!("{}: {e}", file.display()))
}

/// The text of a file of `items`.
///
/// # Errors
/// An item that JSON cannot hold.
pub fn text<T: Serialize>(items: &[T]) -> Result<String, String> {
    let lines: Result<Vec<String>, _> = items.iter().map(serde_json::to_string).collect();
    Ok(format!("[\n{}\n]\n", lines.map_err(|e| e.to_string())?.join(",\n")))
}

/// Writes the whole file or none: beside it first, then renamed; makes its folder.
///
/// # Errors
/// A file that cannot be written.
pub fn write(file: &Path, contents: impl AsRef<[u8]>) -> std::io::Result<()> {
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut beside = tempfile::Builder::new();
    // Temporary files are their owner's alone by default.
    #[cfg(unix)]
    beside.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut beside = beside.tempfile_in(folder)?;
    // Of the file itself, so that an error names no file that is gone.
    beside.as_file_mut().write_all(contents.as_ref())?;
    beside.persist(file).map_err(|e| e.error)?;
    Ok(())
}

/// Writes each file for itself; what could not be written, after the `option` that asked for it.
pub fn write_each(option: &str, files: &[(PathBuf, Vec<u8>)]) -> Vec<String> {
    let fault = |file: &Path, e: std::io::Error| format!("{option} {}: cannot be written: {e}", file.display());
    files.iter().filter_map(|(file, contents)| write(file, contents).err().map(|e| fault(file, e))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(group: &str, case: &str, size: Size, engine: EngineKind) -> Record {
        let run = Run { size, engine: Some(engine), adapter: None, date: "2026-01-02".into(), commit: Some("abc".into()) };
        Record { group: group.into(), row: Row::at_most(case.to_owned(), 0.5, "%", 1.0), run }
    }

    /// A run of a part replaces its own rows, those that it no longer makes too, and leaves other cases,
    /// sizes and engines alone.
    #[test]
    fn run_of_a_part_replaces_its_own_rows() {
        let full = |group, case| record(group, case, Size::Full, EngineKind::Native);
        let quick = record("bar", "b", Size::Quick, EngineKind::Native);
        let gpu = record("bar", "b", Size::Full, EngineKind::Gpu);
        let old = vec![full("bar", "b"), full("bar", "gone"), quick.clone(), gpu.clone(), full("cone", "c")];
        let mut again = full("bar", "b");
        again.row.value = 0.25;
        let all = merged(old, vec![full("fall", "f"), again.clone()], &["fall", "bar", "cone"]);
        assert_eq!(all, [full("fall", "f"), quick, gpu, again, full("cone", "c")]);
    }

    /// What is written is read again, not finite values too; a line an item.
    #[test]
    fn records_survive_their_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("rows.json");
        let mut figure = record("cut methods", "ours", Size::Quick, EngineKind::Gpu);
        figure.row = Row::figure("ours", f64::INFINITY, "-");
        let all = [record("bar", "b", Size::Full, EngineKind::Native), figure];
        let text = text(&all).expect("JSON");
        assert_eq!(text.lines().count(), 4, "{text}");
        write(&file, &text).expect("written");
        let back: Vec<Record> = read(&file).expect("read");
        assert_eq!(back[0], all[0]);
        assert!(back[1].row.value.is_nan() && back[1].run == all[1].run && text.contains(r#""value":null"#), "{text}");
        write(&file, "[\n{}\n]").expect("written");
        let error = read::<Record>(&file).expect_err("no record");
        assert!(error.contains("rows.json") && error.contains("line 2"), "{error}");
    }

    /// A file that is read and written again is the same: figures keep their last bit.
    #[test]
    fn figures_survive_their_file_to_the_last_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("rows.json");
        let mut all = vec![record("bar", "b", Size::Full, EngineKind::Native); 1000];
        all.iter_mut().zip(1..).for_each(|(r, i)| r.row.value = 1e-6 * f64::from(i).sqrt());
        let text = text(&all).expect("JSON");
        write(&file, &text).expect("written");
        let back: Vec<Record> = read(&file).expect("read");
        assert_eq!(all.iter().zip(&back).filter(|(a, b)| a.row.value != b.row.value).count(), 0);
        assert!(super::text(&back).as_deref() == Ok(&text), "other bytes");
    }

    /// A file whose folder is missing is written, one in whose folder's place a file stands is named, and
    /// takes no other with it.
    #[test]
    fn each_file_is_written_for_itself() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "").expect("written");
        let files = ["file/chart.svg", "made/on the way/chart.png"].map(|name| (at(name), vec![7]));
        let faults = write_each("--out", &files);
        assert!(
            faults.len() == 1 && faults[0].starts_with(&format!("--out {}: cannot be written: ", files[0].0.display())),
            "{faults:?}"
        );
        assert_eq!(std::fs::read(&files[1].0).expect("written"), [7]);
        let mode = |file: &Path| std::fs::metadata(file).expect("a file").permissions();
        assert_eq!(mode(&files[1].0), mode(&at("file")));
    }
}
