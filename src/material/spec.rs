//! Parameters of the laws, resolved: what a law is built from.

/// Moduli of the elastic micropolar law in the thesis' names (docs/theory.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticModuli {
    /// Lame's first parameter [Pa].
    pub lambda: f64,
    /// Shear modulus [Pa].
    pub mu: f64,
    /// Coupling modulus [Pa].
    pub kappa: f64,
    /// Coefficient of tr(Gamma) I [N].
    pub alpha: f64,
    /// Coefficient 2 beta of skew Gamma [N].
    pub beta: f64,
    /// Coefficient 2 gamma of sym Gamma [N].
    pub gamma: f64,
}

/// Drucker-Prager cone with non-associated flow; von Mises is the case of two zero slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlasticParameters {
    /// alpha_DP [-].
    pub friction_slope: f64,
    /// beta_DP [-].
    pub dilatancy_slope: f64,
    /// k [Pa].
    pub yield_strength: f64,
    /// H [Pa].
    pub hardening_modulus: f64,
    /// l_p [m].
    pub plastic_length: f64,
    /// Tolerance of the local iteration [-].
    pub tolerance: f64,
}

/// A law with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaterialSpec {
    Elastic(ElasticModuli),
    Elastoplastic(ElasticModuli, PlasticParameters),
}
