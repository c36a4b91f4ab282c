//! Numbers in reports of a study.

/// Error targets for which the cheapest setting is reported.
pub const TARGETS: [f64; 3] = [0.1, 0.01, 0.001];

/// A fraction in per cent, with two significant digits.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", number(fraction * 100.0))
}

/// A number with three significant digits.
pub(super) fn number(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 || !number.is_finite() {
        format!("{number}")
    } else if !(1e-3..1e5).contains(&size) {
        format!("{number:.1e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).clamp(0, 6);
        format!("{number:.*}", digits as usize)
    }
}
