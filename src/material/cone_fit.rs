//! How a cone of Drucker and Prager stands for Mohr and Coulomb's pyramid, and what it amounts to in plane strain.
//!
//! With `f = q + alpha p - k` and `g = q + beta p` (stress positive in tension) a fit turns friction angle, dilatancy angle
//! and cohesion into `alpha`, `beta` and `k`; `docs/theory.md` derives the formulas.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// Fits that have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedFit {
    Compression,
    Extension,
    PlaneStrain,
    Inscribed,
}

/// The fit of a cone: a word, or the number A of `6 sin/(3 + A sin)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ConeFit {
    Named(NamedFit),
    Number(f64),
}

const ACCEPTED: [&str; 5] = [
    "compression",
    "extension",
    "plane_strain",
    "inscribed",
    "a number from -1 to 1",
];

/// Friction and dilatancy angle [rad] with the fit of the cone to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedCone {
    pub fit: ConeFit,
    pub friction: f64,
    pub dilatancy: f64,
}

/// Strength by Mohr and Coulomb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MohrCoulomb {
    /// Friction angle [rad].
    pub friction: f64,
    /// Cohesion [Pa].
    pub cohesion: f64,
}

impl ConeFit {
    /// What a fit may be, for messages.
    pub fn accepted() -> String {
        ACCEPTED.join(", ")
    }

    /// The number, to be scaled; a word has none.
    pub fn number_mut(&mut self) -> Option<&mut f64> {
        match self {
            ConeFit::Number(number) => Some(number),
            ConeFit::Named(_) => None,
        }
    }

    /// `m` and `n` of a slope `m sin/n` and a strength `m c cos/n` from the sines of the angles. For the slope of the
    /// potential both are that of the dilatancy angle: no other angle counts.
    fn ratio(self, friction: f64, dilatancy: f64) -> (f64, f64) {
        match self {
            ConeFit::Number(number) => (6.0, 3.0 + number * friction),
            ConeFit::Named(NamedFit::Compression) => (6.0, 3.0 - friction),
            ConeFit::Named(NamedFit::Extension) => (6.0, 3.0 + friction),
            ConeFit::Named(NamedFit::Inscribed) => (3.0, (3.0 + friction * friction).sqrt()),
            ConeFit::Named(NamedFit::PlaneStrain) => {
                (3.0 * (3.0 + dilatancy * dilatancy).sqrt(), 3.0 + friction * dilatancy)
            }
        }
    }
}

impl FittedCone {
    /// alpha [-].
    pub fn friction_slope(&self) -> f64 {
        let (m, n) = self.fit.ratio(self.friction.sin(), self.dilatancy.sin());
        m * self.friction.sin() / n
    }

    /// beta [-].
    pub fn dilatancy_slope(&self) -> f64 {
        let sine = self.dilatancy.sin();
        let (m, n) = self.fit.ratio(sine, sine);
        m * sine / n
    }

    /// k [Pa] for a cohesion [Pa].
    pub fn strength(&self, cohesion: f64) -> f64 {
        let (m, n) = self.fit.ratio(self.friction.sin(), self.dilatancy.sin());
        m * cohesion * self.friction.cos() / n
    }

    /// What the cone with strength `k` [Pa] amounts to where it flows in plane strain, once no elastic strain changes any
    /// more; `None` where it is steeper there than any friction angle.
    pub fn in_plane_strain(&self, strength: f64) -> Option<MohrCoulomb> {
        let (alpha, beta) = (self.friction_slope(), self.dilatancy_slope());
        // q over sqrt(3) times the radius of Mohr's circle, where nothing flows across the plane.
        let by_radius = (1.0 - beta * beta / 9.0).sqrt().recip();
        let radius = 3.0_f64.sqrt() * by_radius * (1.0 - alpha * beta / 9.0);
        let sine = alpha / radius;
        (radius > 0.0 && sine < 1.0).then(|| {
            let friction = sine.asin();
            let cohesion = strength / (radius * friction.cos());
            MohrCoulomb { friction, cohesion }
        })
    }
}

impl JsonSchema for ConeFit {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "ConeFit".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (word, number) = (generator.subschema_for::<NamedFit>(), generator.subschema_for::<f64>());
        json_schema!({ "anyOf": [word, number] })
    }
}

impl<'de> Deserialize<'de> for ConeFit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ConeFitVisitor)
    }
}

struct ConeFitVisitor;

impl Visitor<'_> for ConeFitVisitor {
    type Value = ConeFit;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", ConeFit::accepted())
    }

    fn visit_str<E: de::Error>(self, word: &str) -> Result<ConeFit, E> {
        let named = match word {
            "compression" => NamedFit::Compression,
            "extension" => NamedFit::Extension,
            "plane_strain" => NamedFit::PlaneStrain,
            "inscribed" => NamedFit::Inscribed,
            _ => return Err(E::unknown_variant(word, &ACCEPTED)),
        };
        Ok(ConeFit::Named(named))
    }

    fn visit_f64<E: de::Error>(self, number: f64) -> Result<ConeFit, E> {
        Ok(ConeFit::Number(number))
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<ConeFit, E> {
        Ok(ConeFit::Number(number as f64))
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<ConeFit, E> {
        Ok(ConeFit::Number(number as f64))
    }
}

#[cfg(test)]
mod tests;
