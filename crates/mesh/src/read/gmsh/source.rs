//! Numbers of a Gmsh file, as text or as binary data, under one interface.

use std::borrow::Cow;

use super::super::text::{Word, Words, quoted, unicode};
use crate::MeshError;

/// Position in a file, which knows the number read last for error messages.
#[derive(Clone)]
pub enum Source<'a> {
    Text { words: Words<'a>, last: Word<'a> },
    Binary(Binary<'a>),
}

/// Width of an integer in a binary file; text has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// `int`: four bytes.
    Int,
    /// `size_t`: as many bytes as the head of the file says.
    Size,
}

impl<'a> Source<'a> {
    pub fn text(file: &'a str, words: Words<'a>) -> Self {
        let last = Word {
            file,
            line: 1,
            text: None,
        };
        Self::Text { words, last }
    }

    /// Error at the number or the word that was read last.
    pub fn wrong(&self, expected: impl Into<String>) -> MeshError {
        match self {
            Self::Text { last, .. } => last.wrong(expected),
            Self::Binary(binary) => binary.wrong(&expected.into()),
        }
    }

    /// Next word of text, which begins or ends a section; in a binary file, data follow its line.
    pub fn section(&mut self) -> Option<&'a str> {
        match self {
            Self::Text { words, last } => {
                *last = words.next();
                last.text
            }
            Self::Binary(binary) => {
                let word = binary.word();
                binary.skip_line_end();
                word
            }
        }
    }

    /// Next integer from 0, which is text on a line of its own in a binary file too.
    pub fn written(&mut self, expected: &str) -> Result<u64, MeshError> {
        let number = self.section().and_then(|text| text.parse().ok());
        number.ok_or_else(|| self.wrong(format!("{expected}, a whole number from 0")))
    }

    /// Next integer on a line of text, in a binary file too.
    pub fn written_int(&mut self, expected: &str) -> Result<i64, MeshError> {
        match self {
            Self::Text { .. } => self.int(expected),
            Self::Binary(binary) => {
                let number = binary.word().and_then(|text| text.parse().ok());
                number.ok_or_else(|| binary.wrong(&format!("{expected}, a whole number")))
            }
        }
    }

    /// What stands in quotation marks on the line of the number that was read last, which is text in
    /// a binary file too; skips the line.
    pub fn quoted(&mut self, expected: &str) -> Result<Cow<'a, str>, MeshError> {
        let name = match self {
            Self::Text { words, .. } => words.quoted().map(Cow::Borrowed),
            Self::Binary(binary) => match binary.rest_of_line() {
                Cow::Borrowed(line) => quoted(line).map(Cow::Borrowed),
                Cow::Owned(line) => quoted(&line).map(|name| Cow::Owned(name.into())),
            },
        };
        name.ok_or_else(|| self.wrong(expected))
    }

    /// Next integer from 0.
    pub fn whole(&mut self, width: Width, expected: &str) -> Result<u64, MeshError> {
        match self {
            Self::Text { words, last } => {
                *last = words.next();
                last.whole(expected)
            }
            Self::Binary(binary) => binary.whole(width, expected),
        }
    }

    /// Next `int`, which may be negative.
    pub fn int(&mut self, expected: &str) -> Result<i64, MeshError> {
        match self {
            Self::Text { words, last } => {
                *last = words.next();
                let number = last.text.and_then(|text| text.parse().ok());
                number.ok_or_else(|| last.wrong(format!("{expected}, a whole number")))
            }
            Self::Binary(binary) => binary.int(Width::Int, expected),
        }
    }

    /// Next finite `double`.
    pub fn real(&mut self, expected: &str) -> Result<f64, MeshError> {
        match self {
            Self::Text { words, last } => {
                *last = words.next();
                last.number(expected)
            }
            Self::Binary(binary) => binary.real(expected),
        }
    }

    /// Skips several `double`s.
    pub fn skip_reals(&mut self, count: u64, expected: &str) -> Result<(), MeshError> {
        match self {
            Self::Text { words, last } => {
                for _ in 0..count {
                    *last = words.next();
                    last.get(expected)?;
                }
            }
            Self::Binary(binary) => {
                binary.take(8 * count, expected)?;
            }
        }
        Ok(())
    }

    /// Skips what a record contains beyond the numbers that were read: the rest of the line, or
    /// this many bytes of a binary file.
    pub fn skip_rest(&mut self, bytes: u64, expected: &str) -> Result<(), MeshError> {
        match self {
            Self::Text { words, .. } => words.skip_line(),
            Self::Binary(binary) => {
                binary.take(bytes, expected)?;
            }
        }
        Ok(())
    }

    /// Bytes of an integer of a binary file.
    pub fn bytes_of(&self, width: Width) -> u64 {
        match self {
            Self::Text { .. } => 0,
            Self::Binary(binary) => binary.bytes_of(width),
        }
    }

    pub fn is_binary(&self) -> bool {
        matches!(self, Self::Binary(_))
    }

    /// Skips to the given word and past it.
    pub fn pass(&mut self, end: &str) -> Result<(), MeshError> {
        if let Self::Binary(binary) = self {
            return binary.pass(end);
        }
        loop {
            match self.section() {
                Some(word) if word == end => return Ok(()),
                Some(_) => {}
                None => return Err(self.wrong(end)),
            }
        }
    }
}

/// Position in a binary file.
#[derive(Clone)]
pub struct Binary<'a> {
    file: &'a str,
    bytes: &'a [u8],
    /// Next byte.
    at: usize,
    /// Bytes of a `size_t`, 4 or 8.
    size: u64,
    big_endian: bool,
    /// First byte of what was read last, and what it says.
    last_at: usize,
    last: String,
}

impl<'a> Binary<'a> {
    /// Starts at byte `at`, where an `int` of value 1 tells the order of bytes.
    pub fn new(file: &'a str, bytes: &'a [u8], at: usize, size: u64) -> Result<Self, MeshError> {
        let mut binary = Self {
            file,
            bytes,
            at,
            size,
            big_endian: false,
            last_at: at,
            last: String::new(),
        };
        let expected = "the number 1 as four bytes";
        binary.big_endian = match binary.take(4, expected)? {
            [1, 0, 0, 0] => false,
            [0, 0, 0, 1] => true,
            other => {
                binary.last = format!("the bytes {other:02x?}");
                return Err(binary.wrong(expected));
            }
        };
        Ok(binary)
    }

    fn wrong(&self, expected: &str) -> MeshError {
        MeshError::Content {
            file: self.file.into(),
            place: format!("byte {}", self.last_at),
            problem: format!("found {}, expected {expected}", self.last),
        }
    }

    fn bytes_of(&self, width: Width) -> u64 {
        match width {
            Width::Int => 4,
            Width::Size => self.size,
        }
    }

    fn take(&mut self, count: u64, expected: &str) -> Result<&'a [u8], MeshError> {
        self.last_at = self.at;
        let rest = &self.bytes[self.at..];
        let taken = usize::try_from(count).ok().and_then(|n| rest.get(..n));
        if let Some(taken) = taken {
            self.at += taken.len();
            return Ok(taken);
        }
        self.last = format!("the end of the file after {} bytes", rest.len());
        Err(self.wrong(expected))
    }

    fn array<const N: usize>(&mut self, expected: &str) -> Result<[u8; N], MeshError> {
        let taken = self.take(N as u64, expected)?;
        let mut array = std::array::from_fn(|i| taken[i]);
        if self.big_endian {
            array.reverse();
        }
        Ok(array)
    }

    fn int(&mut self, width: Width, expected: &str) -> Result<i64, MeshError> {
        let number = match self.bytes_of(width) {
            4 => i64::from(i32::from_le_bytes(self.array(expected)?)),
            _ => i64::from_le_bytes(self.array(expected)?),
        };
        self.last = format!("{number}");
        Ok(number)
    }

    fn whole(&mut self, width: Width, expected: &str) -> Result<u64, MeshError> {
        let number = self.int(width, expected)?;
        u64::try_from(number).map_err(|_| self.wrong(&format!("{expected}, a whole number from 0")))
    }

    fn real(&mut self, expected: &str) -> Result<f64, MeshError> {
        let number = f64::from_le_bytes(self.array(expected)?);
        self.last = format!("{number}");
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.wrong(&format!("{expected}, a finite number")))
        }
    }

    /// Next word of a line of text among the data. What is no text is a word of no file.
    fn word(&mut self) -> Option<&'a str> {
        let rest = &self.bytes[self.at..];
        let white = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let word = &rest[white..];
        let length = word.iter().take_while(|b| b.is_ascii_graphic()).count();
        self.last_at = self.at + white;
        self.at = self.last_at + length;
        let word = str::from_utf8(&word[..length])
            .ok()
            .filter(|_| !word.is_empty());
        self.last = match (word, rest.get(white)) {
            (Some(""), Some(byte)) => format!("the byte 0x{byte:02x}"),
            (Some(word), _) => format!("'{}'", word.chars().take(40).collect::<String>()),
            (None, _) => "the end of the file".into(),
        };
        word
    }

    fn skip_line_end(&mut self) {
        self.rest_of_line_bytes();
    }

    fn rest_of_line_bytes(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let line = rest.iter().position(|byte| *byte == b'\n');
        let line = line.map_or(rest.len(), |line| line + 1);
        self.at += line;
        &rest[..line]
    }

    fn rest_of_line(&mut self) -> Cow<'a, str> {
        unicode(self.rest_of_line_bytes())
    }

    fn pass(&mut self, end: &str) -> Result<(), MeshError> {
        let rest = &self.bytes[self.at..];
        let found = rest
            .windows(end.len())
            .position(|part| part == end.as_bytes());
        self.last_at = self.at;
        let Some(found) = found else {
            self.last_at = self.bytes.len();
            self.last = "the end of the file".into();
            return Err(self.wrong(end));
        };
        self.at += found + end.len();
        Ok(())
    }
}
