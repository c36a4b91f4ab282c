//! The fuzzer of the suite and the engine of the property tests: valid input is corrupted by a few
//! edits, and its reader must return a value or an error, with memory in proportion to the input.
//!
//! The only engine is proptest. Bolero would add a generator of raw bytes on stable Rust; its other
//! advantage, coverage, needs a nightly compiler and a tool of its own. Raw bytes rarely get past
//! the first token of a scene file. Edits of valid files that know items, values and numbers reach
//! further, and proptest minimizes a failure by removing edits.
//!
//! The suite runs a fixed set of cases that takes a few seconds. On demand, a hundred times as many
//! with another seed:
//!
//! ```sh
//! PLIANT_FUZZ=100 PLIANT_FUZZ_SEED=7 cargo test --release --test suite -- fuzz random
//! ```
//!
//! A failure is printed with the seed and the number of the case.

use crate::allocation;
use proptest::{
    prelude::*,
    sample::Index,
    test_runner::{RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner},
};
use std::{
    any::Any,
    cell::Cell,
    env,
    io::{Write as _, stderr},
    ops::Range,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::Duration,
};

/// Time after which a case counts as hanging: the slowest takes a few seconds, some times as many on a busy machine.
const HANGS: Duration = Duration::from_secs(300);

/// Runs a test on this number of random values (times `PLIANT_FUZZ`), and panics with the smallest
/// value that makes it panic. A case that hangs aborts the suite.
pub fn fuzz<S: Strategy>(name: &'static str, cases: u32, values: &S, test: impl Fn(S::Value)) {
    let number = |variable: &str, default: u32| -> u32 {
        let text = env::var(variable).ok();
        text.map_or(default, |text| text.parse().expect("a whole number"))
    };
    let (times, seed) = (number("PLIANT_FUZZ", 1), number("PLIANT_FUZZ_SEED", 0));
    let mut bytes = [0; 32];
    bytes[..4].copy_from_slice(&seed.to_le_bytes());
    for (place, letter) in name.bytes().enumerate() {
        bytes[4 + place % 28] ^= letter;
    }
    let config = ProptestConfig {
        cases: cases.saturating_mul(times),
        failure_persistence: None,
        max_shrink_iters: 2000,
        ..ProptestConfig::default()
    };
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let (watch, case) = (Watch::new(name, seed), Cell::new(0_u64));
    let outcome = runner.run(values, |value| {
        case.set(case.get() + 1);
        watch.case.store(case.get(), Ordering::Relaxed);
        catch_unwind(AssertUnwindSafe(|| test(value)))
            .map_err(|panic| TestCaseError::fail(message(panic.as_ref())))
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(why, value)) => panic!("{name}, seed {seed}: {why}\nfor {value:#?}"),
        Err(TestError::Abort(why)) => panic!("{name}, seed {seed}: {why}"),
    }
}

/// Aborts the suite when a case hangs; a test cannot be interrupted from outside.
struct Watch {
    case: Arc<AtomicU64>,
}

impl Watch {
    fn new(name: &'static str, seed: u32) -> Self {
        let case = Arc::new(AtomicU64::new(0));
        let seen = Arc::downgrade(&case);
        thread::spawn(move || {
            let mut last = None;
            loop {
                thread::sleep(HANGS);
                let Some(case) = seen.upgrade() else {
                    return;
                };
                let now = case.load(Ordering::Relaxed);
                if last == Some(now) {
                    // Not `eprintln!`, which the test would capture and take with it.
                    let _ = writeln!(stderr(), "{name}, seed {seed}: case {now} hangs");
                    std::process::abort();
                }
                last = Some(now);
            }
        });
        Self { case }
    }
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    let literal = || panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(literal).unwrap_or_else(|| "a panic".into())
}

/// The result of an action, after checking that its thread held at most `base` + `factor` ·
/// `length` bytes.
#[track_caller]
pub fn in_proportion<T>(
    length: usize,
    (base, factor): (u64, u64),
    action: impl FnOnce() -> T,
) -> T {
    let (result, most) = allocation::peak(action);
    let allowed = base + factor * length as u64;
    assert!(
        most <= allowed,
        "{most} bytes held for an input of {length}; at most {allowed} are in proportion"
    );
    result
}

/// An edit that corrupts a file. Positions are fractions of the number of candidates.
#[derive(Debug, Clone)]
pub enum Edit {
    /// Replaces a byte.
    Byte(Index, u8),
    /// Replaces four bytes by a little-endian number.
    Binary(Index, u32),
    /// Replaces a number by an extreme one.
    Number(Index, &'static str),
    /// Removes a line, a list item or a value.
    Drop(Index),
    /// Repeats one several times.
    Repeat(Index, usize),
    /// Replaces one by another.
    Replace(Index, Index),
    /// Wraps one in this many levels of brackets.
    Nest(Index, usize),
    /// Replaces one by a word.
    Word(Index, &'static str),
    /// Truncates the file.
    Cut(Index),
}

/// Numbers at and beyond the limits of the types that files are read into, and near zero.
const EXTREMES: &[&str] = &[
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "3",
    "0.5",
    "64",
    "1e6",
    "-1e6",
    "1e-7",
    "1e7",
    "1e-38",
    "1e-45",
    "3.4e38",
    "-3.4e38",
    "3.5e38",
    "1e308",
    "-1e-310",
    "1e400",
    "NaN",
    "nan",
    "inf",
    "-inf",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999999999999999999999",
];

/// Tokens of the file formats, and tokens that are likely to break them.
const WORDS: &[&str] = &[
    "", "\"", "\\\n", "#", "\n", "é", "\0", "(", ")", "[", "]", "{", "}", ",", ":", "-", "//",
    "/*", "()", "[]", "{}", "null", "true", "\"\"", "Some(())", "None", "-1", "0", "nan",
];

/// A few random edits.
pub fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let place = any::<Index>;
    let edit = prop_oneof![
        2 => (place(), any::<u8>()).prop_map(|(at, byte)| Edit::Byte(at, byte)),
        1 => (place(), prop_oneof![Just(0), Just(u32::MAX), Just(1 << 31), any::<u32>()])
            .prop_map(|(at, number)| Edit::Binary(at, number)),
        8 => (place(), prop::sample::select(EXTREMES)).prop_map(|(at, to)| Edit::Number(at, to)),
        3 => place().prop_map(Edit::Drop),
        3 => (place(), 2..5_usize).prop_map(|(at, times)| Edit::Repeat(at, times)),
        3 => (place(), place()).prop_map(|(at, by)| Edit::Replace(at, by)),
        1 => (place(), prop_oneof![1..4_usize, Just(200), Just(20_000)])
            .prop_map(|(at, depth)| Edit::Nest(at, depth)),
        2 => (place(), prop::sample::select(WORDS)).prop_map(|(at, to)| Edit::Word(at, to)),
        1 => place().prop_map(Edit::Cut),
    ];
    prop::collection::vec(edit, 1..4)
}

/// A file after all edits, applied in order.
pub fn broken(file: &[u8], edits: &[Edit]) -> Vec<u8> {
    edits
        .iter()
        .fold(file.to_vec(), |file, edit| edit.apply(file))
}

impl Edit {
    fn apply(&self, mut file: Vec<u8>) -> Vec<u8> {
        if file.is_empty() {
            return file;
        }
        let pick = |at: &Index, spans: Vec<Range<usize>>| -> Option<Range<usize>> {
            (!spans.is_empty()).then(|| spans[at.index(spans.len())].clone())
        };
        let part = |at: &Index| pick(at, parts(&file));
        let (span, by): (Option<Range<usize>>, Vec<u8>) = match self {
            Self::Byte(at, byte) => {
                let at = at.index(file.len());
                (Some(at..at + 1), vec![*byte])
            }
            Self::Binary(at, number) => {
                let at = at.index(file.len()) & !3;
                (
                    Some(at..(at + 4).min(file.len())),
                    number.to_le_bytes().to_vec(),
                )
            }
            Self::Number(at, to) => (pick(at, numbers(&file)), to.as_bytes().to_vec()),
            Self::Drop(at) => (part(at), Vec::new()),
            Self::Repeat(at, times) => {
                let span = part(at);
                let text = span.clone().map_or(&[][..], |span| &file[span]);
                let comma: &[u8] = if text.ends_with(b"\n") { b"" } else { b"," };
                (span, vec![text; *times].join(comma))
            }
            Self::Replace(at, by) => {
                let by = part(by).map_or(Vec::new(), |span| file[span].to_vec());
                (part(at), by)
            }
            Self::Nest(at, depth) => {
                let span = part(at);
                let text = span.clone().map_or(&[][..], |span| &file[span]);
                let (open, close): (&[u8], &[u8]) = if depth % 2 == 0 {
                    (b"[", b"]")
                } else {
                    (b"(", b")")
                };
                let nested = [&open.repeat(*depth), text, &close.repeat(*depth)].concat();
                (span, nested)
            }
            Self::Word(at, to) => (part(at), to.as_bytes().to_vec()),
            Self::Cut(at) => (Some(at.index(file.len())..file.len()), Vec::new()),
        };
        if let Some(span) = span {
            file.splice(span, by);
        }
        file
    }
}

/// Lines, items of lists, and the values after colons.
fn parts(file: &[u8]) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    let mut line = 0;
    for end in (0..file.len()).filter(|&at| file[at] == b'\n') {
        parts.push(line..end + 1);
        line = end + 1;
    }
    let mut open = Vec::new();
    let (mut at, mut item, mut value) = (0, 0, None);
    while at < file.len() {
        match file[at] {
            b'"' => {
                let rest = &file[at + 1..];
                at += 1 + rest.iter().position(|&c| c == b'"').unwrap_or(rest.len());
            }
            b'(' | b'[' | b'{' => {
                open.push((item, value));
                (item, value) = (at + 1, None);
            }
            b',' | b')' | b']' | b'}' => {
                if !file[item..at].trim_ascii().is_empty() {
                    parts.push(item..at);
                    parts.extend(value.map(|value| value..at));
                }
                (item, value) = match file[at] {
                    b',' => (at + 1, None),
                    _ => open.pop().unwrap_or((at + 1, None)),
                };
            }
            b':' => value = Some(at + 1),
            _ => {}
        }
        at += 1;
    }
    parts
}

/// Positions of numbers.
fn numbers(file: &[u8]) -> Vec<Range<usize>> {
    let belongs = |c: u8| c.is_ascii_alphanumeric() || b"+-._".contains(&c);
    let mut numbers = Vec::new();
    let mut at = 0;
    while at < file.len() {
        let length = file[at..].iter().take_while(|c| belongs(**c)).count();
        let word = &file[at..at + length];
        if word.iter().any(u8::is_ascii_digit) && !word[0].is_ascii_alphabetic() {
            numbers.push(at..at + length);
        }
        at += length.max(1);
    }
    numbers
}

#[test]
fn parts_and_numbers_of_a_file_are_found() {
    let file = b"a: [1, -2.5e3], b: (c: \"x,1\")\n";
    let text = |spans: Vec<Range<usize>>| -> Vec<String> {
        let words = spans.into_iter().map(|span| &file[span]);
        words
            .map(|word| String::from_utf8_lossy(word).trim().to_owned())
            .collect()
    };
    let all = "a: [1, -2.5e3], b: (c: \"x,1\")";
    let expected = [all, "1", "-2.5e3", "a: [1, -2.5e3]", "[1, -2.5e3]"];
    let expected = [&expected[..], &["c: \"x,1\"", "\"x,1\""]].concat();
    assert_eq!(text(parts(file)), expected);
    assert_eq!(text(numbers(file)), ["1", "-2.5e3", "1"]);
}
