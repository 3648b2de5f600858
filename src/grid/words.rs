//! Lengths and places for messages.

/// A length for a message: four digits tell enough, and hide the round-off of a division.
pub fn length(metres: f64) -> String {
    let rounded: f64 = format!("{metres:.3e}").parse().unwrap_or(metres);
    match rounded.abs() {
        1e-4..1e6 => format!("{rounded}"),
        _ if rounded == 0.0 => "0".to_owned(),
        _ => format!("{rounded:e}"),
    }
}

/// A place for a message.
pub fn place(position: &[f64]) -> String {
    let numbers: Vec<_> = position.iter().map(|&metres| length(metres)).collect();
    format!("({})", numbers.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_four_digits_at_most() {
        for (metres, text) in [
            (0.00125000000000002, "0.00125"),
            (0.1 / 3.0, "0.03333"),
            (2.0, "2"),
            (-0.05, "-0.05"),
            (0.0, "0"),
            (12_345.6, "12350"),
            (1.0e-6 / 3.0, "3.333e-7"),
            (2.5e7, "2.5e7"),
        ] {
            assert_eq!(length(metres), text);
        }
    }
}
