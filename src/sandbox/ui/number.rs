//! Formatting and parsing of numbers in the panel.
//!
//! [`parse`] reads the output of [`format`] back to the same digits.

use super::expression;

/// A number in at most `digits` significant digits: plain between 1e-3 and 1e5, scientific
/// outside, without trailing zeros. Infinity is `∞`.
pub fn format(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "NaN".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "-∞" }.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    // Rounding first, so that 9.9996 becomes 10, not 10.000.
    let scientific = format!("{value:.*e}", digits - 1);
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        return scientific;
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..5).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        trimmed(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{}e{exponent}", trimmed(mantissa))
    }
}

/// A count with thousands separators: `12 288`.
pub fn count(value: usize) -> String {
    let digits = value.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Reason why a typed text was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Nothing was typed.
    #[error("the entry is empty")]
    Empty,
    /// There is no number where one is expected.
    #[error("“{0}” is not a number; type one such as 0.02, 1e-4 or 1/3")]
    NoNumber(String),
    /// A parenthesis is not closed, or they are nested too deeply.
    #[error("a parenthesis is not closed")]
    Unclosed,
    /// Division by zero.
    #[error("division by zero")]
    DivisionByZero,
    /// The result is beyond the largest number.
    #[error("the number is too large")]
    TooLarge,
    /// The unit is another one.
    #[error("the unit is {expected}, not “{typed}”")]
    Unit {
        /// What was typed.
        typed: String,
        /// Unit of the entry.
        expected: String,
    },
    /// A unit after a number that has none.
    #[error("“{0}” after the number; it has no unit")]
    NoUnit(String),
}

/// A typed number, or simple arithmetic such as `1/3` or `2*3.5`, in `unit`. The unit can be
/// omitted, or typed with an SI prefix (`5 kPa`). A comma is read as the decimal point, `∞` and
/// `inf` as infinity.
///
/// # Errors
/// If there is no valid number, or another unit.
pub fn parse(text: &str, unit: &str) -> Result<f64, Refusal> {
    let text = text.trim().replace(',', ".").replace('−', "-");
    if text.is_empty() {
        return Err(Refusal::Empty);
    }
    let (value, typed) = expression::read(&text)?;
    if value.is_nan() {
        return Err(Refusal::NoNumber(text));
    }
    if value.is_infinite() && !text.contains('∞') && !text.contains("inf") {
        return Err(Refusal::TooLarge);
    }
    Ok(value * factor(typed, unit)?)
}

/// Factor from a typed unit to `unit`.
fn factor(typed: &str, unit: &str) -> Result<f64, Refusal> {
    const PREFIXES: [(&str, f64); 9] = [
        ("", 1.0),
        ("G", 1e9),
        ("M", 1e6),
        ("k", 1e3),
        ("c", 1e-2),
        ("m", 1e-3),
        ("µ", 1e-6),
        ("u", 1e-6),
        ("n", 1e-9),
    ];
    if typed.is_empty() {
        return Ok(1.0);
    }
    if unit.is_empty() {
        return Err(Refusal::NoUnit(typed.to_owned()));
    }
    // As they are typed: m/s2, m/s^2, N*m.
    let plain = typed.replace('^', "").replace('*', "·");
    let plain = plain.replace('2', "²").replace('3', "³").replace('4', "⁴");
    plain
        .strip_suffix(unit)
        .and_then(|prefix| PREFIXES.iter().find(|(name, _)| *name == prefix.trim()))
        .map(|(_, factor)| *factor)
        .ok_or_else(|| Refusal::Unit {
            typed: typed.to_owned(),
            expected: unit.to_owned(),
        })
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use crate::sandbox::ui::number::*;

    #[test]
    fn numbers_are_plain_near_one_and_scientific_far_from_it() {
        let cases = [
            (0.0, "0"),
            (-9.81, "-9.81"),
            (1.0, "1"),
            (20.0, "20"),
            (1240.0, "1240"),
            (0.012, "0.012"),
            (9.9996, "10"),
            (1e-5, "1e-5"),
            (f64::from(1e-5_f32), "1e-5"),
            (2.5e-8, "2.5e-8"),
            (1.2e9, "1.2e9"),
            (99_996.0, "1e5"),
            (f64::INFINITY, "∞"),
        ];
        for (value, text) in cases {
            assert_eq!(format(value, 4), text);
        }
    }

    #[test]
    fn what_is_written_reads_back() {
        for exponent in -12..12 {
            for mantissa in [1.0, 1.25, 9.99, -3.0] {
                let value = mantissa * 10f64.powi(exponent);
                let text = format(value, 4);
                let read = parse(&text, "").expect("a number was written");
                assert!((read - value).abs() <= 1e-12 * value.abs(), "{text}");
            }
        }
    }

    #[test]
    fn a_typed_unit_a_comma_and_infinity_are_understood() {
        assert_eq!(parse(" 1e-5 m/N", "m/N"), Ok(1e-5));
        assert_eq!(parse("9,81", "m/s²"), Ok(9.81));
        assert_eq!(parse("−2", ""), Ok(-2.0));
        assert_eq!(parse("∞ N", "N"), Ok(f64::INFINITY));
        assert_eq!(parse("-inf", ""), Ok(f64::NEG_INFINITY));
        assert_eq!(parse("0.5 ×", "×"), Ok(0.5));
        assert_eq!(parse("-9.81 m/s^2", "m/s²"), Ok(-9.81));
    }

    #[test]
    fn a_prefix_of_the_unit_counts_and_another_unit_is_refused() {
        assert_eq!(parse("5 kPa", "Pa"), Ok(5000.0));
        assert_eq!(parse("2mm", "m"), Ok(2e-3));
        assert_eq!(parse("2 m", "m"), Ok(2.0));
        for (text, unit) in [("5 N", "Pa"), ("5 xPa", "Pa"), ("5e", "m"), ("1 2", "m")] {
            let refused = parse(text, unit);
            assert!(matches!(refused, Err(Refusal::Unit { .. })), "{text}");
        }
        assert_eq!(parse("5 m", ""), Err(Refusal::NoUnit("m".to_owned())));
    }

    #[test]
    fn arithmetic_has_the_usual_precedence() {
        let cases = [
            ("1/3", 1.0 / 3.0),
            ("2*3.5", 7.0),
            ("1e-4", 1e-4),
            ("1 + 2*3", 7.0),
            ("(1+2)*3", 9.0),
            ("8/2/2", 2.0),
            ("2 - -1", 3.0),
            ("-(2+1)", -3.0),
            (".5", 0.5),
        ];
        for (text, value) in cases {
            assert_eq!(parse(text, ""), Ok(value), "{text}");
        }
        assert_eq!(parse("1/2 m/N", "m/N"), Ok(0.5));
    }

    #[test]
    fn what_is_no_number_is_refused_with_the_reason() {
        assert_eq!(parse("  ", ""), Err(Refusal::Empty));
        assert_eq!(parse("1/0", ""), Err(Refusal::DivisionByZero));
        assert_eq!(parse("1e999", ""), Err(Refusal::TooLarge));
        assert_eq!(parse("(1", ""), Err(Refusal::Unclosed));
        for text in ["soft", "NaN", "e5", "--1", "1/", "2*", "inf-inf", ")"] {
            let refused = parse(text, "");
            assert!(matches!(refused, Err(Refusal::NoNumber(_))), "{text:?}");
        }
        let deep = "(".repeat(100_000);
        assert_eq!(parse(&deep, ""), Err(Refusal::Unclosed));
    }

    #[test]
    fn counts_have_their_thousands_apart() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(12_288), "12 288");
        assert_eq!(count(1_000_000), "1 000 000");
    }
}
