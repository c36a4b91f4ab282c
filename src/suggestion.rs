//! Suggestions for misspelled names.

/// The name among `valid`, separated by commas, that is most similar to an unknown one, as in
/// ` (did you mean “bunny”?)`; empty if none is similar.
#[must_use]
pub fn similar(unknown: &str, valid: &str) -> String {
    // Typing errors: a wrong, missing, additional or swapped letter in three.
    let max_distance = unknown.chars().count().div_ceil(3);
    let distance = |name: &&str| strsim::damerau_levenshtein(name, unknown);
    let nearest = valid.split(", ").min_by_key(distance);
    match nearest.filter(|name| distance(name) <= max_distance) {
        Some(name) => format!(" (did you mean “{name}”?)"),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::similar;

    #[test]
    fn typing_errors_are_recognized_and_other_words_are_not() {
        let valid = "jelly_cube, bunny, balloon";
        for (unknown, expected) in [
            ("buny", "bunny"),
            ("bnuny", "bunny"),
            ("jellycube", "jelly_cube"),
            ("ballon", "balloon"),
        ] {
            let suggestion = similar(unknown, valid);
            assert!(suggestion.contains(expected), "{unknown}: {suggestion}");
        }
        for unknown in ["", "cloth", "xyz"] {
            assert_eq!(similar(unknown, valid), "", "{unknown}");
        }
    }
}
