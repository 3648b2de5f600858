//! The known name that a misspelled one was probably meant to be.

/// The nearest of the known names, if it is near enough to be a misspelling.
pub fn nearest<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if typed.len() > 100 {
        return None;
    }
    let typed = typed.to_lowercase().replace(['-', ' '], "_");
    let allowed = (typed.chars().count() / 3).max(1);
    known
        .into_iter()
        .map(|name| (strsim::osa_distance(&typed, &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= allowed)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// `, did you mean "name"?`, or nothing.
pub fn did_you_mean(suggestion: Option<&str>) -> String {
    suggestion.map_or_else(String::new, |name| format!(", did you mean \"{name}\"?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspellings_are_recognised_and_other_words_are_not() {
        let known = ["poisson_ratio", "youngs_modulus", "law"];
        assert_eq!(nearest("possion_ratio", known), Some("poisson_ratio"));
        assert_eq!(nearest("Youngs-Modulus", known), Some("youngs_modulus"));
        assert_eq!(nearest("density", known), None);
        assert_eq!(did_you_mean(nearest("lwa", known)), ", did you mean \"law\"?");
    }
}
