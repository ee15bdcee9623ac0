//! A unit of a binary file: a head by serde, as RON, which knows every number that Rust has (JSON knows no
//! infinity), and a plain body.
//!
//! | bytes | what                                              |
//! |-------|---------------------------------------------------|
//! | 4     | length of the head \[bytes\]                        |
//! | 8     | length of the body \[bytes\]                        |
//! | 4     | CRC-32 of head and body                           |
//! | 4     | CRC-32 of the 16 bytes before: lengths can be trusted |
//! | ...   | head, body                                        |
//!
//! Numbers are little-endian.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Read, Write};

/// Bytes before the head.
const PREFIX: usize = 20;

/// Why a packet cannot be read.
#[derive(Debug)]
pub(crate) enum PacketError {
    /// What the system says.
    Io(io::Error),
    /// The input ends within the packet.
    CutShort,
    /// It is not what was written, or not what a packet of this kind holds.
    Damaged(String),
}

/// The CRC-32 of a packet of this head and body.
pub(crate) fn checksum(head: &impl Serialize, body: &[u8]) -> u32 {
    // A head is made of numbers and names, which RON always has a text for.
    sum(&ron::to_string(head).unwrap_or_default(), body)
}

fn sum(head: &str, body: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head.as_bytes());
    hasher.update(body);
    hasher.finalize()
}

/// Writes a packet.
///
/// # Errors
/// What the system says, or a head that is beyond 4 GiB or has no text.
pub(crate) fn write(out: &mut impl Write, head: &impl Serialize, body: &[u8]) -> io::Result<()> {
    let head = ron::to_string(head).map_err(io::Error::other)?;
    let mut prefix = Vec::with_capacity(PREFIX);
    prefix.extend(u32::try_from(head.len()).map_err(io::Error::other)?.to_le_bytes());
    prefix.extend((body.len() as u64).to_le_bytes());
    prefix.extend(sum(&head, body).to_le_bytes());
    prefix.extend(crc32fast::hash(&prefix).to_le_bytes());
    out.write_all(&prefix)?;
    out.write_all(head.as_bytes())?;
    out.write_all(body)
}

/// Reads a packet; nothing where the input ends before it. Allocates no more than there is to read.
///
/// # Errors
/// Input that ends within the packet, is damaged, or has another kind of head.
pub(crate) fn read<T: DeserializeOwned>(input: &mut impl Read) -> Result<Option<(T, Vec<u8>)>, PacketError> {
    let mut prefix = vec![];
    input.take(PREFIX as u64).read_to_end(&mut prefix).map_err(PacketError::Io)?;
    if prefix.is_empty() {
        return Ok(None);
    }
    let prefix = <[u8; PREFIX]>::try_from(prefix).map_err(|_| PacketError::CutShort)?;
    let word = |at: usize| u32::from_le_bytes([prefix[at], prefix[at + 1], prefix[at + 2], prefix[at + 3]]);
    if crc32fast::hash(&prefix[..16]) != word(16) {
        return Err(PacketError::Damaged("the checksum of its lengths does not fit them".into()));
    }
    let head = exactly(input, word(0).into())?;
    let body = exactly(input, u64::from(word(8)) << 32 | u64::from(word(4)))?;
    let head = String::from_utf8(head).map_err(|_| PacketError::Damaged("its head is no text".into()))?;
    if sum(&head, &body) != word(12) {
        return Err(PacketError::Damaged("its checksum does not fit its content".into()));
    }
    let head = ron::from_str(&head).map_err(|error| PacketError::Damaged(format!("its head cannot be read: {error}")))?;
    Ok(Some((head, body)))
}

/// The next `length` bytes.
fn exactly(input: &mut impl Read, length: u64) -> Result<Vec<u8>, PacketError> {
    let mut bytes = vec![];
    input.take(length).read_to_end(&mut bytes).map_err(PacketError::Io)?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(PacketError::CutShort) }
}
