//! A report as one self-contained page of HTML, for browsers and for print.
//!
//! A page begins with its [verdict](Verdict); its parts follow in order, and details are folded. It
//! needs no other file and no script, follows the color scheme of the reader, and is never wider
//! than its window: in a narrow one the rows of tables become cards. Text is written with the few
//! Markdown marks of a [document](super::document), and appears without them.

mod table;
mod text;

pub use text::{escaped, inline};

use super::document::Block;

/// A page.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Title of the page and of its window.
    pub title: String,
    /// The result in a sentence; the first thing on the page.
    pub verdict: Verdict,
    /// What follows, from top to bottom.
    pub parts: Vec<Part>,
}

/// The result of what a report is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Determines color and sign.
    pub status: Status,
    /// The result in a few words.
    pub words: String,
    /// Counts and circumstances, a line each.
    pub about: Vec<String>,
}

/// How a result is to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// As it should be.
    Passed,
    /// To be read before the result is used.
    Attention,
    /// A check failed.
    Failed,
}

impl Status {
    /// Its class of style.
    const fn class(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Attention => "attention",
            Self::Failed => "failed",
        }
    }

    /// A sign beside the words, so that the color is not the only difference.
    const fn sign(self) -> &'static str {
        match self {
            Self::Passed => "✓",
            Self::Attention => "!",
            Self::Failed => "✕",
        }
    }
}

/// A part of a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// A block of a document. A table gets units in its header and numbers to the right.
    Block(Block),
    /// A picture or another element that is written as HTML; text in it must be [`escaped`].
    Html(String),
    /// Parts that are folded away.
    Details {
        /// The target of links to it; letters, digits, `-` and `_`.
        id: String,
        /// What is shown while it is folded.
        summary: String,
        /// Whether it is open at first.
        open: bool,
        /// What it contains.
        parts: Vec<Part>,
    },
}

impl Part {
    /// A heading of level 2.
    #[must_use]
    pub fn heading(words: impl Into<String>) -> Self {
        Self::Block(Block::Heading(2, words.into()))
    }

    /// A paragraph.
    #[must_use]
    pub fn text(words: impl Into<String>) -> Self {
        Self::Block(Block::Text(words.into()))
    }

    fn html(&self) -> String {
        match self {
            Self::Block(block) => block_html(block),
            Self::Html(html) => format!("{html}\n"),
            Self::Details {
                id,
                summary,
                open,
                parts,
            } => format!(
                "<details id=\"{}\"{}>\n<summary>{}</summary>\n{}</details>\n",
                escaped(id),
                if *open { " open" } else { "" },
                inline(summary),
                all(parts)
            ),
        }
    }
}

impl From<Block> for Part {
    fn from(block: Block) -> Self {
        Self::Block(block)
    }
}

fn all(parts: &[Part]) -> String {
    parts.iter().map(Part::html).collect()
}

fn block_html(block: &Block) -> String {
    match block {
        Block::Heading(level, words) => format!("<h{level}>{}</h{level}>\n", inline(words)),
        Block::Text(words) => format!("<p>{}</p>\n", inline(words)),
        Block::List(items) => {
            let items = items
                .iter()
                .map(|item| format!("<li>{}</li>", inline(item)));
            format!("<ul>{}</ul>\n", items.collect::<String>())
        }
        Block::Table {
            caption,
            head,
            rows,
        } => table::html(caption, head, rows),
        Block::Figure { caption, svg, .. } => format!(
            "<figure class=\"plot\"><div>{svg}</div><figcaption>{}</figcaption></figure>\n",
            inline(caption)
        ),
    }
}

/// The page as the text of an HTML file.
#[must_use]
pub fn html(page: &Page) -> String {
    let Verdict {
        status,
        words,
        about,
    } = &page.verdict;
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}: {plain}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header>\n<h1>{title}</h1>\n\
         <p class=\"verdict {}\"><b>{}</b> <strong>{}</strong>{}</p>\n</header>\n\
         {}</body>\n</html>\n",
        status.class(),
        status.sign(),
        inline(words),
        about
            .iter()
            .map(|line| format!("<span>{}</span>", inline(line)))
            .collect::<String>(),
        all(&page.parts),
        title = escaped(&page.title),
        plain = escaped(words),
    )
}

const STYLE: &str = include_str!("style.css");

#[cfg(test)]
mod tests {
    use super::*;

    fn page(status: Status, parts: Vec<Part>) -> String {
        html(&Page {
            title: "A & B".to_owned(),
            verdict: Verdict {
                status,
                words: "2 unexpected failures".to_owned(),
                about: vec!["of `three`".to_owned()],
            },
            parts,
        })
    }

    #[test]
    fn the_verdict_comes_before_everything_else_and_stands_in_the_title() {
        let page = page(Status::Failed, vec![Part::text("Later.")]);
        assert!(page.contains("<title>A &amp; B: 2 unexpected failures</title>"));
        let verdict = page.find("class=\"verdict failed\"").expect("a verdict");
        assert!(verdict < page.find("Later.").expect("text"));
        assert!(page.contains("of <code>three</code>"));
    }

    #[test]
    fn details_are_folded_unless_they_are_open() {
        let details = |open| Part::Details {
            id: "one".to_owned(),
            summary: "*One*".to_owned(),
            open,
            parts: vec![Block::List(vec!["in it".to_owned()]).into()],
        };
        let text = page(Status::Passed, vec![details(false), details(true)]);
        assert!(text.contains("<details id=\"one\">\n<summary><em>One</em></summary>"));
        assert!(text.contains("<details id=\"one\" open>"));
        assert_eq!(text.matches("<li>in it</li>").count(), 2);
    }
}
