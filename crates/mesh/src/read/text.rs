//! Tokens of a text file with their line numbers, for error messages.

use std::borrow::Cow;

use glam::DVec3;

use crate::MeshError;

/// Decodes a file as text: UTF-8, or Latin-1 where that fails, in which older programs write names
/// and comments.
///
/// # Errors
/// [`MeshError::Text`] at the first byte that is in no text, or at line 1 if the file is empty.
pub fn decode<'a>(file: &str, bytes: &'a [u8]) -> Result<Cow<'a, str>, MeshError> {
    let error = |line, found: String, expected: &str| MeshError::Text {
        file: file.into(),
        line,
        found,
        expected: expected.into(),
    };
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(error(1, "text in UTF-16".into(), "text in UTF-8"));
    }
    if let Some(place) = bytes.iter().position(|byte| *byte == 0) {
        let before = bytes[..place].iter();
        let line = 1 + before.filter(|byte| **byte == b'\n').count();
        return Err(error(line, "the byte 0x00".into(), "text in UTF-8"));
    }
    // Some editors write a byte order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = unicode(bytes);
    if text.trim().is_empty() {
        return Err(error(1, "an empty file".into(), "a mesh"));
    }
    Ok(text)
}

/// Text in UTF-8, or in Latin-1 where it is not.
pub fn unicode(bytes: &[u8]) -> Cow<'_, str> {
    match str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        // The bytes of Latin-1 are the first 256 characters of Unicode.
        Err(_) => Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect()),
    }
}

/// What stands between the first two quotation marks of a line.
pub fn quoted(line: &str) -> Option<&str> {
    let (_, after) = line.split_once('"')?;
    after.split_once('"').map(|(name, _)| name)
}

/// A word, or the end of the file.
#[derive(Debug, Clone, Copy)]
pub struct Word<'a> {
    pub file: &'a str,
    pub line: usize,
    /// `None` at the end of the file.
    pub text: Option<&'a str>,
}

impl<'a> Word<'a> {
    /// Error for an unexpected word.
    pub fn wrong(&self, expected: impl Into<String>) -> MeshError {
        MeshError::Text {
            file: self.file.into(),
            line: self.line,
            found: match self.text {
                Some(text) => format!("'{}'", abridged(text)),
                None => "the end of the file".into(),
            },
            expected: expected.into(),
        }
    }

    /// The word, or an error at the end of the file.
    pub fn get(&self, expected: &str) -> Result<&'a str, MeshError> {
        self.text.ok_or_else(|| self.wrong(expected))
    }

    /// Parses a finite number.
    pub fn number(&self, expected: &str) -> Result<f64, MeshError> {
        let number = self.text.and_then(|text| text.parse::<f64>().ok());
        number
            .filter(|number| number.is_finite())
            .ok_or_else(|| self.wrong(format!("{expected}, a finite number")))
    }

    /// Parses an integer from 0.
    pub fn whole(&self, expected: &str) -> Result<u64, MeshError> {
        let number = self.text.and_then(|text| text.parse().ok());
        number.ok_or_else(|| self.wrong(format!("{expected}, a whole number from 0")))
    }

    /// Parses the index of one of `count` items that the file numbers from `base`.
    pub fn index(&self, what: &str, base: u64, count: usize) -> Result<u32, MeshError> {
        let index = self.text.and_then(|text| text.parse::<u64>().ok());
        index
            .and_then(|index| index.checked_sub(base))
            .filter(|index| *index < count as u64)
            .and_then(|index| u32::try_from(index).ok())
            .ok_or_else(|| match count as u64 {
                0 => self.wrong(format!("no {what}, as there is none yet")),
                count => self.wrong(format!("a {what} from {base} to {}", base + count - 1)),
            })
    }
}

/// Shortens a word for an error message.
fn abridged(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST {
        return text.into();
    }
    text.chars().take(LONGEST).chain(['…']).collect()
}

/// Words of a file; comments from `#` to the end of a line are skipped.
#[derive(Clone)]
pub struct Words<'a> {
    file: &'a str,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
    /// The line, with its comment.
    text: &'a str,
    rest: std::str::SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self {
            file,
            lines: text.lines().enumerate(),
            line: 1,
            text: "",
            rest: "".split_whitespace(),
        }
    }

    /// Next word, on this line or a later one.
    pub fn next(&mut self) -> Word<'a> {
        loop {
            if let Some(text) = self.rest.next() {
                return self.word(Some(text));
            }
            let Some((index, line)) = self.lines.next() else {
                return self.word(None);
            };
            self.line = index + 1;
            self.text = line;
            let before_comment = line.split_once('#').map_or(line, |(before, _)| before);
            self.rest = before_comment.split_whitespace();
        }
    }

    /// Next word on the same line.
    pub fn next_in_line(&mut self) -> Option<Word<'a>> {
        let text = self.rest.next()?;
        Some(self.word(Some(text)))
    }

    /// The line after its first word, as a name: with spaces within, and with a `#` that is not the
    /// start of a word. Does not advance.
    pub fn rest_of_line(&self) -> &'a str {
        let text = self.text.trim_start();
        let after_keyword = text.find(char::is_whitespace).unwrap_or(text.len());
        let rest = &text[after_keyword..];
        let mut starts_word = false;
        let end = rest.find(|c: char| {
            let is_comment = c == '#' && starts_word;
            starts_word = c.is_whitespace();
            is_comment
        });
        let name = rest[..end.unwrap_or(rest.len())].trim();
        // The line goes on in the next one.
        let continued = name.strip_suffix('\\');
        let whole = |name: &&str| name.is_empty() || name.ends_with(char::is_whitespace);
        continued.filter(whole).unwrap_or(name).trim_end()
    }

    /// What stands in quotation marks on the line, also if it contains a `#`. Skips the line.
    pub fn quoted(&mut self) -> Option<&'a str> {
        self.skip_line();
        quoted(self.text)
    }

    /// Skips the rest of the line.
    pub fn skip_line(&mut self) {
        self.rest = "".split_whitespace();
    }

    /// Parses the next three words as a point.
    pub fn point(&mut self) -> Result<DVec3, MeshError> {
        let x = self.next().number("the x coordinate")?;
        let y = self.next().number("the y coordinate")?;
        let z = self.next().number("the z coordinate")?;
        Ok(DVec3::new(x, y, z))
    }

    fn word(&self, text: Option<&'a str>) -> Word<'a> {
        Word {
            file: self.file,
            line: self.line,
            text,
        }
    }
}
