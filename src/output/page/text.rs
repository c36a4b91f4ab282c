//! Text with marks as HTML.

/// Text that appears as it is written.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Marks, the longer ones first, with their elements.
const MARKS: [(&str, &str); 3] = [("`", "code"), ("**", "strong"), ("*", "em")];

/// Text in which `code`, **strong** and *emphasized* words are marked as in Markdown. A mark that
/// does not enclose words is text.
#[must_use]
pub fn inline(text: &str) -> String {
    let mut html = String::new();
    let mut plain = String::new();
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        let starts_word = !plain.ends_with(|c: char| c.is_alphanumeric() || c == '*');
        let marked = MARKS.iter().find_map(|&(mark, element)| {
            let (inside, after) = enclosed(rest, mark)?;
            (starts_word || mark == "`").then_some((element, inside, after))
        });
        if let Some((element, inside, after)) = marked {
            html += &escaped(&std::mem::take(&mut plain));
            let inside = match element {
                "code" => escaped(inside),
                _ => inline(inside),
            };
            html += &format!("<{element}>{inside}</{element}>");
            rest = after;
        } else {
            plain.push(next);
            rest = &rest[next.len_utf8()..];
        }
    }
    html + &escaped(&plain)
}

/// The words between a mark at the start of the text and the next one, and what follows them.
fn enclosed<'a>(text: &'a str, mark: &str) -> Option<(&'a str, &'a str)> {
    let (inside, after) = text.strip_prefix(mark)?.split_once(mark)?;
    let words = !inside.is_empty() && inside.trim() == inside;
    (words || (mark == "`" && !inside.is_empty())).then_some((inside, after))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_like_a_tag_is_text_and_what_is_quoted_is_code() {
        assert_eq!(
            inline("a < b & `c > d *e*`"),
            "a &lt; b &amp; <code>c &gt; d *e*</code>"
        );
    }

    #[test]
    fn marks_of_emphasis_become_elements() {
        assert_eq!(
            inline("**Solver error** of *4 × 1*, *within noise*."),
            "<strong>Solver error</strong> of <em>4 × 1</em>, <em>within noise</em>."
        );
        assert_eq!(
            inline("**so *and* so**"),
            "<strong>so <em>and</em> so</strong>"
        );
    }

    #[test]
    fn a_product_is_no_mark() {
        for product in ["2*3*4", "2 * 3 * 4", "a* b", "*", "**", "`"] {
            assert_eq!(inline(product), product);
        }
    }
}
