//! Input as it comes in: files up to a size, RON with the place and the field of what is wrong.

use super::error::SceneError;
use super::line::{listed, named, one_line, short};
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The bytes of the file at `path`, a `kind`, which has at most `most` of them: what does not end is refused
/// as well.
pub(super) fn read_bytes(path: &Path, most: u64, kind: &'static str) -> Result<Vec<u8>, SceneError> {
    let fault = |error| SceneError::Read { file: named(path), error };
    let file = File::open(path).map_err(fault)?;
    let too_large = || SceneError::TooLarge { file: named(path), kind, most };
    // Of a pipe or a device the length is 0.
    if file.metadata().map_err(fault)?.len() > most {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes).map_err(fault)?;
    if bytes.len() as u64 > most { Err(too_large()) } else { Ok(bytes) }
}

/// The text of the file at `path`; see [`read_bytes`].
pub(super) fn read_text(path: &Path, most: u64, kind: &'static str) -> Result<String, SceneError> {
    String::from_utf8(read_bytes(path, most, kind)?).map_err(|_| SceneError::Read {
        file: named(path),
        error: io::Error::new(io::ErrorKind::InvalidData, "is no text (not UTF-8)"),
    })
}

/// Reads the RON text of `file`; an error names the place and the field.
pub(super) fn from_ron<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, SceneError> {
    let options = ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
    let mut deserializer = ron::de::Deserializer::from_str_with_options(text, &options).map_err(|e| fault(file, &e, ""))?;
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        fault(file, &deserializer.span_error(error.into_inner()), &path)
    })?;
    deserializer.end().map_err(|error| fault(file, &deserializer.span_error(error), ""))?;
    Ok(value)
}

/// What is wrong in `file`, where, and in which field: `path` as `tools[0].contact`, or nothing.
pub(super) fn fault(file: &str, error: &ron::error::SpannedError, path: &str) -> SceneError {
    let message = message(&error.code);
    let path = short(path);
    // Values that are out of their range name their field themselves.
    let leaf = path.rsplit('.').next().unwrap_or_default();
    let is_named = leaf.is_empty() || message.starts_with(&format!("{leaf} =")) || path.contains('?');
    SceneError::Parse {
        file: file.to_string(),
        line: error.span.start.line,
        column: error.span.start.col,
        message: if is_named { message } else { format!("{path}: {message}") },
    }
}

/// What is wrong, in words of the file.
fn message(error: &ron::Error) -> String {
    let of = |outer: &Option<String>| outer.as_ref().map(|name| format!(" in `{}`", short(name))).unwrap_or_default();
    let one_of = |names: &[&str]| names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    match error {
        ron::Error::NoSuchStructField { expected, found, outer } => {
            format!("unknown field `{}`{}; known are {}", short(found), of(outer), one_of(expected))
        }
        ron::Error::NoSuchEnumVariant { expected, found, outer } => {
            format!("unknown `{}`{}; known are {}", short(found), of(outer), one_of(expected))
        }
        ron::Error::MissingStructField { field, outer } => format!("missing field `{field}`{}", of(outer)),
        // Of this crate's own checks.
        ron::Error::Message(text) => listed(text),
        other => one_line(&other.to_string()),
    }
}
