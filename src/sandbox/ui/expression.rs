//! Simple arithmetic in number entries: `1/3`, `2*3.5`, `1e-4`, `(2 + 1)/4`.
//!
//! Reads an expression from the start of a text and returns what follows it, which is the unit.

use super::number::Refusal;

/// Maximum depth of parentheses.
const MAX_DEPTH: u32 = 16;

/// Value of the expression at the start of `text`, and the text after it. Operators are `+`, `-`,
/// `*` and `/`, with the usual precedence; `∞` and `inf` are infinity.
///
/// # Errors
/// If there is no number where one is expected, or a parenthesis is not closed.
pub(super) fn read(text: &str) -> Result<(f64, &str), Refusal> {
    let mut reader = Reader { rest: text };
    let value = reader.sum(0)?;
    Ok((value, reader.rest.trim()))
}

struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn sum(&mut self, depth: u32) -> Result<f64, Refusal> {
        let mut value = self.product(depth)?;
        loop {
            value = if self.take('+') {
                value + self.product(depth)?
            } else if self.take('-') {
                value - self.product(depth)?
            } else {
                return Ok(value);
            };
        }
    }

    fn product(&mut self, depth: u32) -> Result<f64, Refusal> {
        let mut value = self.factor(depth)?;
        loop {
            value = if self.take('*') {
                value * self.factor(depth)?
            } else if self.take('/') {
                let divisor = self.factor(depth)?;
                if divisor == 0.0 {
                    return Err(Refusal::DivisionByZero);
                }
                value / divisor
            } else {
                return Ok(value);
            };
        }
    }

    fn factor(&mut self, depth: u32) -> Result<f64, Refusal> {
        let negative = self.take('-');
        if !negative {
            self.take('+');
        }
        let value = if self.take('(') {
            if depth == MAX_DEPTH {
                return Err(Refusal::Unclosed);
            }
            let value = self.sum(depth + 1)?;
            if !self.take(')') {
                return Err(Refusal::Unclosed);
            }
            value
        } else {
            self.number()?
        };
        Ok(if negative { -value } else { value })
    }

    fn number(&mut self) -> Result<f64, Refusal> {
        self.rest = self.rest.trim_start();
        for infinity in ["∞", "inf"] {
            if let Some(rest) = self.rest.strip_prefix(infinity) {
                self.rest = rest;
                return Ok(f64::INFINITY);
            }
        }
        let length = number_length(self.rest);
        let (digits, rest) = self.rest.split_at(length);
        let value = digits
            .parse()
            .map_err(|_| Refusal::NoNumber(self.rest.to_owned()))?;
        self.rest = rest;
        Ok(value)
    }

    fn take(&mut self, sign: char) -> bool {
        match self.rest.trim_start().strip_prefix(sign) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }
}

/// Length of the number without sign at the start of a text: digits, a point, an exponent. An `e`
/// without digits belongs to the unit.
fn number_length(text: &str) -> usize {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let mut length = digits(text);
    if text[length..].starts_with('.') {
        length += 1 + digits(&text[length + 1..]);
    }
    let exponent = text[length..].strip_prefix(['e', 'E']);
    if let Some(exponent) = exponent.filter(|_| length > 0) {
        let sign = usize::from(exponent.starts_with(['+', '-']));
        let power = digits(&exponent[sign..]);
        if power > 0 {
            length += 1 + sign + power;
        }
    }
    length
}
