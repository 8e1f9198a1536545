//! The bytes of a record's file.
//!
//! All numbers are little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `resecta run`, CR, LF, 26, LF, 0: what no text begins with, and what a transfer as text would break |
//! | 4 | version of the format, [`FORMAT`] |
//! | 8 | length of the body, bytes |
//! | 8 | length of the packed body, bytes |
//! | 32 | BLAKE3 of version, lengths and packed body: the checksum, and the run's identity |
//! | .. | the body, packed as zlib (RFC 1950) |
//!
//! The body is the length of the header (4 bytes), the header as JSON (`record.rs`), the states of the instrument (`inputs.rs`) and
//! the hashes of the gland, 8 bytes each.

use std::io::{Read, Write};

use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};

use crate::error::Damage;

/// Version of the format. A later one is refused by name.
pub const FORMAT: u32 = 1;
/// Largest file that is read, bytes: a run of six hours whose every bit is noise fits.
pub const MAX_FILE_BYTES: u64 = 64 << 20;
/// Largest body, bytes: what a small file unpacks to is bounded before it is unpacked.
pub const MAX_BODY_BYTES: u64 = 192 << 20;

const MAGIC: &[u8; 16] = b"resecta run\r\n\x1a\n\0";
/// Bytes before the packed body.
pub(crate) const PREFIX_BYTES: usize = 16 + 4 + 8 + 8 + 32;

/// The file's bytes, and the checksum in them. Equal bodies give equal files.
pub(crate) fn pack(body: &[u8]) -> (Vec<u8>, [u8; 32]) {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
    // Into memory: cannot fail.
    packer.write_all(body).expect("written into memory");
    let packed = packer.finish().expect("written into memory");
    let lengths = [body.len() as u64, packed.len() as u64];
    let sum = checksum(FORMAT, lengths, &packed);
    let mut file = Vec::with_capacity(PREFIX_BYTES + packed.len());
    file.extend_from_slice(MAGIC);
    file.extend_from_slice(&FORMAT.to_le_bytes());
    lengths
        .iter()
        .for_each(|length| file.extend_from_slice(&length.to_le_bytes()));
    file.extend_from_slice(&sum);
    file.extend_from_slice(&packed);
    (file, sum)
}

/// The body of a file's bytes, and its checksum.
pub(crate) fn unpack(file: &[u8]) -> Result<(Vec<u8>, [u8; 32]), Damage> {
    if file.len() as u64 > MAX_FILE_BYTES {
        return Err(Damage::TooLarge);
    }
    let begins = &file[..file.len().min(MAGIC.len())];
    if begins.is_empty() || !MAGIC.starts_with(begins) {
        return Err(Damage::Foreign);
    }
    let mut rest = file.get(MAGIC.len()..).unwrap_or_default();
    let cut_short = Damage::Length {
        bytes: file.len() as u64,
        expected: PREFIX_BYTES as u64,
    };
    let version = u32::from_le_bytes(take(&mut rest).ok_or_else(|| cut_short.clone())?);
    if version != FORMAT {
        return Err(Damage::Version { version });
    }
    let mut length = || take(&mut rest).map(u64::from_le_bytes).ok_or_else(|| cut_short.clone());
    let lengths = [length()?, length()?];
    let sum: [u8; 32] = take(&mut rest).ok_or(cut_short)?;
    if rest.len() as u64 != lengths[1] {
        return Err(Damage::Length {
            bytes: file.len() as u64,
            expected: lengths[1].saturating_add(PREFIX_BYTES as u64),
        });
    }
    if checksum(version, lengths, rest) != sum {
        return Err(Damage::Checksum);
    }
    let contents = |what: String| Damage::Contents { what };
    if lengths[0] > MAX_BODY_BYTES {
        return Err(contents(format!(
            "{} bytes, at most {MAX_BODY_BYTES} are read",
            lengths[0]
        )));
    }
    let mut body = Vec::new();
    let mut unpacker = ZlibDecoder::new(rest).take(lengths[0] + 1);
    (unpacker.read_to_end(&mut body)).map_err(|error| contents(format!("cannot be unpacked: {error}")))?;
    if body.len() as u64 != lengths[0] {
        return Err(contents(format!(
            "{} bytes where {} were packed",
            body.len(),
            lengths[0]
        )));
    }
    Ok((body, sum))
}

/// The first bytes of what is left.
pub(crate) fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (first, others) = rest.split_first_chunk()?;
    *rest = others;
    Some(*first)
}

fn checksum(version: u32, lengths: [u64; 2], packed: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&version.to_le_bytes());
    lengths.iter().for_each(|length| {
        hasher.update(&length.to_le_bytes());
    });
    *hasher.update(packed).finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_damage_is_named() {
        let (file, _) = pack(b"body");
        assert_eq!(unpack(&file).unwrap().0, b"body");
        let cut = |length: usize| unpack(&file[..length]).unwrap_err();
        assert_eq!(unpack(b"").unwrap_err(), Damage::Foreign);
        assert_eq!(unpack(b"PNG").unwrap_err(), Damage::Foreign);
        assert!(matches!(cut(5), Damage::Length { bytes: 5, .. }));
        assert!(matches!(cut(60), Damage::Length { bytes: 60, .. }));
        assert!(matches!(cut(file.len() - 1), Damage::Length { .. }));
        let changed = |at: usize| {
            let mut file = file.clone();
            file[at] ^= 1;
            unpack(&file).unwrap_err()
        };
        assert_eq!(changed(3), Damage::Foreign);
        assert_eq!(changed(16), Damage::Version { version: FORMAT ^ 1 });
        assert_eq!(changed(20), Damage::Checksum);
        assert!(matches!(changed(28), Damage::Length { .. }));
        assert_eq!(changed(40), Damage::Checksum);
        assert_eq!(changed(PREFIX_BYTES), Damage::Checksum);
    }

    #[test]
    fn what_unpacks_to_more_than_it_says_is_refused_before_it_fills_the_memory() {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::best());
        packer.write_all(&vec![0; 10 << 20]).unwrap();
        let packed = packer.finish().unwrap();
        for body in [4, MAX_BODY_BYTES + 1] {
            let lengths = [body, packed.len() as u64];
            let mut file = MAGIC.to_vec();
            file.extend_from_slice(&FORMAT.to_le_bytes());
            lengths
                .iter()
                .for_each(|length| file.extend_from_slice(&length.to_le_bytes()));
            file.extend_from_slice(&checksum(FORMAT, lengths, &packed));
            file.extend_from_slice(&packed);
            assert!(matches!(unpack(&file).unwrap_err(), Damage::Contents { .. }));
        }
    }
}
