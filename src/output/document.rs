//! A document of headings, text, tables and figures, as Markdown and as a self-contained HTML page.

use std::fmt::Write;

/// A block of a document.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A heading, from level 1.
    Heading(u8, String),
    /// A paragraph.
    Text(String),
    /// A list of sentences.
    List(Vec<String>),
    /// A table.
    Table {
        /// What it shows; may be empty.
        caption: String,
        /// Names of its columns.
        head: Vec<String>,
        /// Its rows, a cell for each column.
        rows: Vec<Vec<String>>,
    },
    /// A figure: its file beside the document, its caption, and its SVG.
    Figure {
        /// File name.
        file: String,
        /// Caption.
        caption: String,
        /// SVG source.
        svg: String,
    },
}

impl Block {
    /// A table from its caption, which may be empty, the names of its columns, and its rows.
    #[must_use]
    pub fn table(caption: impl Into<String>, head: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self::Table {
            caption: caption.into(),
            head: head.iter().map(|&name| name.to_owned()).collect(),
            rows,
        }
    }
}

/// The document as Markdown; figures are links to their files.
#[must_use]
pub fn markdown(blocks: &[Block]) -> String {
    let mut text = String::new();
    let cell = |cell: &String| cell.replace('|', "\\|");
    let row = |cells: &[String]| {
        let cells: Vec<_> = cells.iter().map(cell).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    for block in blocks {
        match block {
            Block::Heading(level, words) => {
                let marks = "#".repeat(usize::from(*level));
                text += &format!("{marks} {words}\n\n");
            }
            Block::Text(words) => text += &format!("{words}\n\n"),
            Block::List(items) => {
                for item in items {
                    text += &format!("- {item}\n");
                }
                text.push('\n');
            }
            Block::Table {
                caption,
                head,
                rows,
            } => {
                if !caption.is_empty() {
                    text += &format!("**{caption}**\n\n");
                }
                text += &row(head);
                text += &row(&vec!["---".to_owned(); head.len()]);
                text.extend(rows.iter().map(|cells| row(cells)));
                text.push('\n');
            }
            Block::Figure { file, caption, .. } => {
                text += &format!("![{caption}]({file})\n\n*{caption}*\n\n");
            }
        }
    }
    text
}

/// The document as a page of HTML with inline figures and style.
#[must_use]
pub fn html(title: &str, blocks: &[Block]) -> String {
    let mut body = String::new();
    for block in blocks {
        // Writing to a string cannot fail.
        let _ = match block {
            Block::Heading(level, words) => writeln!(body, "<h{level}>{}</h{level}>", safe(words)),
            Block::Text(words) => writeln!(body, "<p>{}</p>", safe(words)),
            Block::List(items) => {
                let items = items.iter().map(|item| format!("<li>{}</li>", safe(item)));
                writeln!(body, "<ul>{}</ul>", items.collect::<String>())
            }
            Block::Table {
                caption,
                head,
                rows,
            } => {
                let row = |cells: &[String], tag: &str| {
                    let cells = cells.iter();
                    let cells = cells.map(|cell| format!("<{tag}>{}</{tag}>", safe(cell)));
                    format!("<tr>{}</tr>", cells.collect::<String>())
                };
                let rows: String = rows.iter().map(|cells| row(cells, "td")).collect();
                writeln!(
                    body,
                    "<div class=\"wide\"><table>{}<thead>{}</thead><tbody>{rows}</tbody></table></div>",
                    match &caption[..] {
                        "" => String::new(),
                        caption => format!("<caption>{}</caption>", safe(caption)),
                    },
                    row(head, "th")
                )
            }
            Block::Figure { caption, svg, .. } => writeln!(
                body,
                "<figure>{svg}<figcaption>{}</figcaption></figure>",
                safe(caption)
            ),
        };
    }
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        safe(title)
    )
}

/// Escapes text for HTML; `code` in backticks becomes a code element.
fn safe(text: &str) -> String {
    let escaped = text
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;");
    let parts = escaped.split('`').enumerate();
    parts
        .map(|(place, part)| match place % 2 {
            1 => format!("<code>{part}</code>"),
            _ => part.to_owned(),
        })
        .collect()
}

const STYLE: &str = "
:root { color-scheme: light dark; --ink: #1d2129; --paper: #ffffff; --line: #d5d9e0; --soft: #f4f6f9; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e6ec; --paper: #16181d; --line: #383d47; --soft: #20242b; }
}
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3 { line-height: 1.2; margin-top: 2.2em; }
h1 { margin-top: 0; }
h2 { border-top: 1px solid var(--line); padding-top: 1em; }
.wide { overflow-x: auto; }
caption { text-align: left; font-weight: 600; padding: 0.4em 0; }
table { border-collapse: collapse; font-size: 0.9em; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: 0.3em 0.8em 0.3em 0; text-align: left; white-space: nowrap; }
code { background: var(--soft); padding: 0.1em 0.3em; border-radius: 3px; }
figure { margin: 1.5em 0; }
figure svg { max-width: 100%; height: auto; background: #ffffff; border: 1px solid var(--line); border-radius: 6px; }
figcaption { font-size: 0.85em; opacity: 0.8; }
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_like_a_tag_is_text_and_what_is_quoted_is_code() {
        assert_eq!(
            safe("a < b & `c > d`"),
            "a &lt; b &amp; <code>c &gt; d</code>"
        );
    }

    #[test]
    fn a_table_has_as_many_cells_below_as_above() {
        let rows = vec![vec!["1|2".to_owned(), "3".to_owned()]];
        let text = "| a | b |\n| --- | --- |\n| 1\\|2 | 3 |\n\n";
        let table = Block::table("", &["a", "b"], rows.clone());
        assert_eq!(markdown(&[table]), text);
        let captioned = [Block::table("Both", &["a", "b"], rows)];
        assert_eq!(markdown(&captioned), format!("**Both**\n\n{text}"));
        assert!(html("", &captioned).contains("<caption>Both</caption>"));
    }
}
