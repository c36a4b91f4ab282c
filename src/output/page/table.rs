//! A table as HTML: numbers to the right, their common unit in the header.

use super::text::{escaped, inline};

/// Tables with more columns than this become cards in a narrow window.
const MAX_NARROW: usize = 2;

/// A line break in a cell; what follows it is a note in small print.
const NOTE: char = '\n';

/// What is shown where there is no value.
const NONE: &str = "—";

/// Stands before the number of a bound.
const BOUND: &str = "< ";

/// A column, as it is shown.
struct Column {
    /// The header as HTML.
    head: String,
    /// The header as the value of an attribute.
    label: String,
    numeric: bool,
    /// The unit in the header, which its cells do not repeat.
    unit: Option<String>,
}

/// The table as HTML. A caption may be empty.
pub(super) fn html(caption: &str, head: &[String], rows: &[Vec<String>]) -> String {
    let columns: Vec<Column> = head
        .iter()
        .enumerate()
        .map(|(place, head)| column(head, rows.iter().filter_map(|row| row.get(place))))
        .collect();
    let class = |column: &Column| {
        if column.numeric {
            " class=\"number\""
        } else {
            ""
        }
    };
    let heads = columns
        .iter()
        .map(|column| format!("<th scope=\"col\"{}>{}</th>", class(column), column.head));
    let heads: String = heads.collect();
    let row = |cells: &Vec<String>| {
        let cells = cells.iter().zip(&columns).map(|(cell, column)| {
            format!(
                "<td{} data-label=\"{}\">{}</td>",
                class(column),
                column.label,
                contents(cell, column)
            )
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let kind = if head.len() > MAX_NARROW {
        " class=\"cards\""
    } else {
        ""
    };
    let caption = match caption {
        "" => String::new(),
        caption => format!("<caption>{}</caption>", inline(caption)),
    };
    format!(
        "<table{kind}>{caption}<thead><tr>{heads}</tr></thead>\n<tbody>\n{}</tbody></table>\n",
        rows.iter().map(row).collect::<String>()
    )
}

fn column<'a>(head: &str, cells: impl Iterator<Item = &'a String>) -> Column {
    let quantities: Option<Vec<(&str, &str)>> = cells
        .filter(|cell| !cell.is_empty() && *cell != NONE)
        .map(|cell| quantity(cell))
        .collect();
    let quantities = quantities.filter(|all| !all.is_empty());
    let unit = quantities.as_ref().and_then(|all| {
        let (_, unit) = all[0];
        let common = all.iter().all(|(_, other)| *other == unit);
        (common && !unit.is_empty()).then(|| unit.to_owned())
    });
    let head = match &unit {
        Some(unit) => format!("{head} [{unit}]"),
        None => head.to_owned(),
    };
    Column {
        numeric: quantities.is_some(),
        head: inline(&head),
        label: escaped(&head),
        unit,
    }
}

/// A number or a range of numbers with its unit, which may be empty; `None` for words and for names
/// that begin with a number. A number may be a bound, as in `< 0.1 %`.
fn quantity(cell: &str) -> Option<(&str, &str)> {
    let bare = cell.strip_prefix(BOUND).unwrap_or(cell);
    let end = bare.find([' ', '×']).unwrap_or(bare.len());
    let (number, unit) = (&bare[..end], bare[end..].trim_start());
    let is_number = number.split('–').all(|end| end.parse::<f64>().is_ok());
    let with_bound = &cell[..cell.len() - bare.len() + end];
    let is_unit = !unit.contains([' ', ',']) && !unit.contains(|c: char| c.is_ascii_digit());
    (is_number && is_unit).then_some((with_bound, unit))
}

fn contents(cell: &str, column: &Column) -> String {
    let shown = match (&column.unit, quantity(cell)) {
        (Some(_), Some((number, _))) => number,
        _ => cell,
    };
    match shown.split_once(NOTE) {
        _ if shown.is_empty() => String::new(),
        Some((value, note)) => format!(
            "<span>{}<small>{}</small></span>",
            broken(value),
            broken(note)
        ),
        None => format!("<span>{}</span>", broken(shown)),
    }
}

/// Text that may be broken after the commas of long names.
fn broken(text: &str) -> String {
    inline(text).replace(',', ",<wbr>").replace(",<wbr> ", ", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(head: &[&str], rows: &[&[&str]]) -> String {
        let words = |words: &[&str]| {
            words
                .iter()
                .map(|&word| word.to_owned())
                .collect::<Vec<_>>()
        };
        let rows: Vec<Vec<String>> = rows.iter().map(|row| words(row)).collect();
        html("", &words(head), &rows)
    }

    #[test]
    fn the_common_unit_of_numbers_is_in_the_header_alone() {
        let text = table(
            &["mesh", "error", "time"],
            &[
                &["a", "0.5 %", "1"],
                &["b", "< 2e-3 %", "2–3"],
                &["c", "—", ""],
            ],
        );
        assert!(
            text.contains("<th scope=\"col\" class=\"number\">error [%]</th>"),
            "{text}"
        );
        assert!(
            text.contains("<td class=\"number\" data-label=\"error [%]\"><span>0.5</span></td>"),
            "{text}"
        );
        assert!(text.contains(">&lt; 2e-3</span>"), "{text}");
        assert!(
            text.contains("<th scope=\"col\" class=\"number\">time</th>"),
            "{text}"
        );
    }

    #[test]
    fn words_and_different_units_stay_as_they_are() {
        let text = table(&["a", "b"], &[&["3 m", "2 m"], &["4 s", "none"]]);
        assert!(
            text.contains("<th scope=\"col\" class=\"number\">a</th>"),
            "{text}"
        );
        assert!(
            text.contains(">3 m</span>") && text.contains(">4 s</span>"),
            "{text}"
        );
        assert!(text.contains("<th scope=\"col\">b</th>"), "{text}");
        let names = table(&["member", "mesh"], &[&["3 cube5", "8×1×1"]]);
        assert!(!names.contains("number"), "{names}");
    }

    #[test]
    fn a_long_name_can_be_broken_and_a_note_is_small() {
        let text = table(&["a"], &[&["cube3,scale=1\nby chance, it seems"]]);
        let cell = "cube3,<wbr>scale=1<small>by chance, it seems</small>";
        assert!(text.contains(cell), "{text}");
    }
}
