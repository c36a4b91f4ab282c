//! A document of headings, text, tables and figures, and its form as Markdown. Its blocks are also
//! the contents of a [page](super::page) of HTML.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_as_many_cells_below_as_above() {
        let rows = vec![vec!["1|2".to_owned(), "3".to_owned()]];
        let text = "| a | b |\n| --- | --- |\n| 1\\|2 | 3 |\n\n";
        let table = Block::table("", &["a", "b"], rows.clone());
        assert_eq!(markdown(&[table]), text);
        let captioned = [Block::table("Both", &["a", "b"], rows)];
        assert_eq!(markdown(&captioned), format!("**Both**\n\n{text}"));
    }
}
