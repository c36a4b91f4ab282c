//! Formatting and parsing of numbers in the panel.
//!
//! [`parse`] reads the output of [`format`] back to the same digits. Both ignore units, which are
//! shown beside the number; [`parse`] skips a unit that was typed.

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

/// The number at the start of a typed text; the rest (a unit) is ignored. A comma is read as the
/// decimal point, `∞` and `inf` as infinity.
///
/// `None` if there is no valid number.
pub fn parse(text: &str) -> Option<f64> {
    let text = text.trim().replace(',', ".").replace('−', "-");
    if let Some(rest) = text.strip_prefix('-')
        && (rest.starts_with('∞') || rest.starts_with("inf"))
    {
        return Some(f64::NEG_INFINITY);
    }
    if text.starts_with('∞') || text.starts_with("inf") {
        return Some(f64::INFINITY);
    }
    let numeric = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let end = text.find(|c| !numeric(c)).unwrap_or(text.len());
    // "5e" (five, then the first letter of a unit) is 5: shortened until it parses.
    (1..=end)
        .rev()
        .find_map(|end| text[..end].parse::<f64>().ok())
        .filter(|value| value.is_finite())
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
                let read = parse(&text).expect("a number was written");
                assert!((read - value).abs() <= 1e-12 * value.abs(), "{text}");
            }
        }
    }

    #[test]
    fn a_typed_unit_a_comma_and_infinity_are_understood() {
        assert_eq!(parse(" 1e-5 m/N"), Some(1e-5));
        assert_eq!(parse("9,81"), Some(9.81));
        assert_eq!(parse("5e"), Some(5.0));
        assert_eq!(parse("−2"), Some(-2.0));
        assert_eq!(parse("∞ N"), Some(f64::INFINITY));
        assert_eq!(parse("inf"), Some(f64::INFINITY));
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "  ", "soft", "NaN", "e5", "--1", "1e999"] {
            assert_eq!(parse(text), None, "{text:?}");
        }
    }

    #[test]
    fn counts_have_their_thousands_apart() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(12_288), "12 288");
        assert_eq!(count(1_000_000), "1 000 000");
    }
}
