//! What a DICOM file must be like before it is parsed: lengths that lie within it, and sequences that do not nest without
//! end. The parser takes memory as lengths say and calls itself as sequences nest; a damaged file would take all of both.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Deepest nesting of sequences; ultrasound needs two.
const MAX_DEPTH: usize = 16;
/// Bytes before the mark of a DICOM file.
const PREAMBLE: usize = 128;
const MARK: &[u8] = b"DICM";
/// Length of what ends by a delimiter.
const UNDEFINED: usize = u32::MAX as usize;
const PIXEL_DATA: (u16, u16) = (0x7fe0, 0x0010);
const TRANSFER_SYNTAX: (u16, u16) = (0x0002, 0x0010);
const ITEM: (u16, u16) = (0xfffe, 0xe000);
const ITEM_END: (u16, u16) = (0xfffe, 0xe00d);
const SEQUENCE_END: (u16, u16) = (0xfffe, 0xe0dd);
const IMPLICIT_LITTLE_ENDIAN: &str = "1.2.840.10008.1.2";
const EXPLICIT_BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

/// Whether a file can be read and begins as a DICOM file does; scanners often give them no ending.
pub(super) fn begins_as_dicom(path: &Path) -> bool {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take((PREAMBLE + MARK.len()) as u64).read_to_end(&mut bytes));
    read.is_ok() && is_dicom(&bytes)
}

fn is_dicom(bytes: &[u8]) -> bool {
    bytes.get(PREAMBLE..PREAMBLE + MARK.len()) == Some(MARK)
}

/// The transfer syntax of a file that a parser may be given, or what is wrong.
pub(super) fn check(bytes: &[u8]) -> Result<String, String> {
    if !is_dicom(bytes) {
        return Err("it lacks the mark DICM after 128 bytes".into());
    }
    let mut walk = Walk {
        bytes,
        at: PREAMBLE + MARK.len(),
        open: Vec::new(),
        is_implicit: false,
    };
    let mut syntax = None;
    while walk.at < bytes.len() && walk.group()? == 2 {
        let (tag, value) = walk.element()?;
        if tag == TRANSFER_SYNTAX {
            let text = String::from_utf8_lossy(&bytes[value]);
            syntax = Some(text.trim_end_matches(['\0', ' ']).to_owned());
        }
    }
    let syntax = syntax.ok_or("its transfer syntax (0002,0010) is missing")?;
    match syntax.as_str() {
        EXPLICIT_BIG_ENDIAN => return Err("its bytes are in the retired big-endian order".into()),
        DEFLATED => return Err("its data set is deflated".into()),
        IMPLICIT_LITTLE_ENDIAN => walk.is_implicit = true,
        _ => {}
    }
    while walk.at < bytes.len() {
        walk.element()?;
    }
    Ok(syntax)
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Open sequences and items, from the outermost.
    open: Vec<Open>,
    is_implicit: bool,
}

struct Open {
    /// Where it ends, if its length is told.
    end: Option<usize>,
    /// Items of pixel data hold fragments, not elements.
    is_pixel_data: bool,
    /// What follows the sequence is read as what came before it.
    was_implicit: bool,
}

impl Walk<'_> {
    fn group(&self) -> Result<u16, String> {
        self.number(self.at)
    }

    fn number(&self, at: usize) -> Result<u16, String> {
        let bytes = self.bytes.get(at..at + 2).ok_or_else(|| self.cut())?;
        Ok(u16::from_le_bytes([bytes[0], bytes[1]]))
    }

    fn length(&self, at: usize) -> Result<usize, String> {
        Ok(usize::from(self.number(at)?) | usize::from(self.number(at + 2)?) << 16)
    }

    fn cut(&self) -> String {
        format!("it ends within an element that begins at byte {}", self.at)
    }

    /// Passes one element, or goes into it; its tag and the place of its value.
    fn element(&mut self) -> Result<((u16, u16), std::ops::Range<usize>), String> {
        let tag = (self.number(self.at)?, self.number(self.at + 2)?);
        let (length, header, is_sequence, is_unknown) = if tag.0 == ITEM.0 || self.is_implicit {
            (self.length(self.at + 4)?, 8, self.is_implicit, false)
        } else {
            let kind = self.bytes.get(self.at + 4..self.at + 6).ok_or_else(|| self.cut())?;
            if SHORT.contains(&[kind[0], kind[1]]) {
                (usize::from(self.number(self.at + 6)?), 8, false, false)
            } else {
                (
                    self.length(self.at + 8)?,
                    12,
                    kind == b"SQ",
                    kind != b"SQ" && kind != b"OB" && kind != b"OW",
                )
            }
        };
        let value = self.at + header;
        let told = (length != UNDEFINED).then_some(length);
        if told.is_some_and(|length| length > self.bytes.len() - value.min(self.bytes.len())) {
            return Err(self.cut());
        }
        let end = told.map_or(value, |length| value + length);
        let in_fragments = self.open.last().is_some_and(|open| open.is_pixel_data);
        let holds_items = || self.bytes[value..end].starts_with(&[0xfe, 0xff, 0x00, 0xe0]);
        match tag {
            ITEM_END | SEQUENCE_END => {
                self.at = value;
                self.close();
            }
            ITEM if !in_fragments => self.enter(value, told, false, self.is_implicit)?,
            ITEM => self.at = end,
            PIXEL_DATA if told.is_none() => self.enter(value, None, true, self.is_implicit)?,
            // An unknown element of undefined length holds implicit ones (PS3.5, 6.2.2, note 2).
            _ if told.is_none() => self.enter(value, None, false, self.is_implicit || is_unknown)?,
            _ if tag != PIXEL_DATA && (is_sequence || is_unknown) && holds_items() => {
                self.enter(value, told, false, self.is_implicit)?;
            }
            _ => self.at = end,
        }
        while self
            .open
            .last()
            .is_some_and(|open| open.end.is_some_and(|end| self.at >= end))
        {
            self.close();
        }
        Ok((tag, value..end))
    }

    fn enter(
        &mut self,
        value: usize,
        length: Option<usize>,
        is_pixel_data: bool,
        is_implicit: bool,
    ) -> Result<(), String> {
        // A sequence and its item are two.
        if self.open.len() >= 2 * MAX_DEPTH {
            return Err(format!("its sequences are nested deeper than {MAX_DEPTH}"));
        }
        self.open.push(Open {
            end: length.map(|length| value + length),
            is_pixel_data,
            was_implicit: self.is_implicit,
        });
        self.is_implicit = is_implicit;
        self.at = value;
        Ok(())
    }

    fn close(&mut self) {
        if let Some(closed) = self.open.pop() {
            self.is_implicit = closed.was_implicit;
        }
    }
}

/// Kinds of values whose length takes two bytes (PS3.5, 7.1.2).
const SHORT: [[u8; 2]; 21] = [
    *b"AE", *b"AS", *b"AT", *b"CS", *b"DA", *b"DS", *b"DT", *b"FL", *b"FD", *b"IS", *b"LO", *b"LT", *b"PN", *b"SH",
    *b"SL", *b"SS", *b"ST", *b"TM", *b"UI", *b"UL", *b"US",
];
