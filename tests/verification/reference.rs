//! Reference numbers of `tests/reference`.

use serde_json::Value;

/// A reference with a curve or other lists.
pub struct Reference(Value);

impl Reference {
    pub fn read(name: &str) -> Self {
        let path = format!("{}/tests/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        Reference(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}")))
    }

    /// One of several references in a file.
    pub fn part(&self, key: &str) -> Self {
        Reference(self.0[key].clone())
    }

    pub fn number(&self, key: &str) -> f64 {
        number(&self.0, key)
    }

    pub fn list(&self, key: &str) -> &[Value] {
        self.0[key].as_array().unwrap_or_else(|| panic!("{key} is no list"))
    }

    /// Points of the curve.
    pub fn curve(&self) -> &[Value] {
        let curve = self.0["curve"].as_array().expect("a curve");
        assert!(curve.len() >= 3, "a curve of {} points", curve.len());
        curve
    }
}

/// A number of a point of a curve.
pub fn number(value: &Value, key: &str) -> f64 {
    value[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

/// A vector of a point of a curve.
pub fn vector(value: &Value, key: &str) -> [f64; 3] {
    std::array::from_fn(|k| {
        value[key][k]
            .as_f64()
            .unwrap_or_else(|| panic!("{key} is no vector in {value}"))
    })
}
