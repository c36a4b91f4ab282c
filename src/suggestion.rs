//! Suggestions for misspelled names.

/// Length of a name up to which others are compared, and their number: names of a file may be long and many.
const LONGEST: usize = 100;
const MOST: usize = 1000;

/// The name among `valid`, separated by commas, that is most similar to an unknown one, as in
/// ` (did you mean “bunny”?)`; empty if none is similar.
#[must_use]
pub fn similar(unknown: &str, valid: &str) -> String {
    similar_of(unknown, valid.split(", "))
}

/// As [`similar`], among names that may contain commas. Upper and lower case are the same.
#[must_use]
pub fn similar_of<'a>(unknown: &str, valid: impl Iterator<Item = &'a str>) -> String {
    let length = unknown.chars().count();
    if length > LONGEST {
        return String::new();
    }
    // Typing errors: a wrong, missing, additional or swapped letter in three.
    let max_distance = length.div_ceil(3);
    let unknown = unknown.to_lowercase();
    let distance = |name: &&str| strsim::damerau_levenshtein(&name.to_lowercase(), &unknown);
    // The distance of others is not less than the difference of the lengths, and may take long.
    let is_candidate = |name: &&str| name.chars().count().abs_diff(length) <= max_distance;
    let nearest = valid.take(MOST).filter(is_candidate).min_by_key(distance);
    match nearest.filter(|name| distance(name) <= max_distance) {
        Some(name) => format!(" (did you mean “{}”?)", name.escape_debug()),
        None => String::new(),
    }
}

/// The message of an error in RON, with the name that an unknown field or variant may mean.
pub(crate) fn with_similar(error: &ron::Error) -> String {
    use ron::Error::{NoSuchEnumVariant, NoSuchStructField};
    let similar = match error {
        NoSuchStructField {
            expected, found, ..
        }
        | NoSuchEnumVariant {
            expected, found, ..
        } => similar_of(found, expected.iter().copied()),
        _ => String::new(),
    };
    format!("{error}{similar}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_errors_are_recognized_and_other_words_are_not() {
        let valid = "jelly_cube, bunny, balloon";
        for (unknown, expected) in [
            ("buny", "bunny"),
            ("bnuny", "bunny"),
            ("jellycube", "jelly_cube"),
            ("ballon", "balloon"),
            ("BUNNY", "bunny"),
        ] {
            let suggestion = similar(unknown, valid);
            assert!(suggestion.contains(expected), "{unknown}: {suggestion}");
        }
        let long = "a".repeat(LONGEST + 1);
        assert_eq!(similar(&long, &long), "");
        assert!(similar("bunn", "bunn\u{1b}").contains(r"“bunn\u{1b}”"));
        for unknown in ["", "cloth", "xyz"] {
            assert_eq!(similar(unknown, valid), "", "{unknown}");
        }
    }
}
