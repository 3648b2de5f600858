//! Parameters of the laws: the keys that a user sets, and the resolved numbers that a law is built from.

use super::cone_fit::{ConeFit, FittedCone, NamedFit};
use crate::continuum::ContinuumKind;
use crate::problem::figure;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Elastic moduli in the thesis' names (docs/theory.md). Without rotations all but the first two are zero.
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

impl ElasticModuli {
    /// Largest modulus that a strain is multiplied by [Pa].
    pub fn largest(&self) -> f64 {
        self.lambda.abs() + 2.0 * (self.mu + self.kappa)
    }

    /// Moduli of a classical continuum.
    pub fn without_rotations(lambda: f64, mu: f64) -> Self {
        Self {
            lambda,
            mu,
            kappa: 0.0,
            alpha: 0.0,
            beta: 0.0,
            gamma: 0.0,
        }
    }
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
    /// l_p [m]; zero without rotations.
    pub plastic_length: f64,
    /// Tolerance of the local iteration [-].
    pub tolerance: f64,
}

/// Parameters of the sandstone law (docs/theory.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SandstoneParameters {
    /// G [Pa].
    pub shear_modulus: f64,
    /// K [Pa].
    pub bulk_modulus: f64,
    /// Gc [Pa].
    pub coupling_modulus: f64,
    /// Coefficient of tr(Gamma) I [N].
    pub alpha: f64,
    /// Coefficient 2 beta of skew Gamma [N].
    pub beta: f64,
    /// Coefficient 2 gamma of sym Gamma [N].
    pub gamma: f64,
    /// Without it the law is elastic.
    pub plastic: Option<SandstoneYield>,
    /// Without it nothing is damaged.
    pub damage: Option<SandstoneDamage>,
}

impl SandstoneParameters {
    /// Largest modulus that a strain is multiplied by [Pa].
    pub fn largest_modulus(&self) -> f64 {
        self.bulk_modulus + 4.0 / 3.0 * self.shear_modulus + 2.0 * self.coupling_modulus
    }
}

/// Yield surface, potential and hardening of the sandstone law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SandstoneYield {
    /// k = sqrt(3) b0 [Pa].
    pub strength: f64,
    /// mf = sqrt(3) m_phi [-].
    pub friction_slope: f64,
    /// md = sqrt(3) m_psi [-].
    pub dilatancy_slope: f64,
    /// h_delta [Pa].
    pub hardening_stress: f64,
    /// h_exp [-].
    pub hardening_rate: f64,
    /// h_d [-].
    pub dilation_rate: f64,
    /// l_J2 [m].
    pub plastic_length: f64,
    /// a1 to a4 of the generalised invariant J2 [-].
    pub weights: [f64; 4],
    /// Rounding of the cone at its apex [Pa].
    pub apex_rounding: f64,
    /// Tolerance of the local iteration [-].
    pub tolerance: f64,
}

/// Damage of the sandstone law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SandstoneDamage {
    /// l_d [m].
    pub length: f64,
    /// eps_f [-].
    pub softening_modulus: f64,
    /// Largest omega [-].
    pub max_damage: f64,
}

/// A law with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaterialSpec {
    Elastic(ElasticModuli),
    Elastoplastic(ElasticModuli, PlasticParameters),
    Sandstone(SandstoneParameters),
}

impl MaterialSpec {
    /// k of a law with a yield surface [Pa].
    pub fn strength(&self) -> Option<f64> {
        match self {
            MaterialSpec::Elastic(_) => None,
            MaterialSpec::Elastoplastic(_, plastic) => Some(plastic.yield_strength),
            MaterialSpec::Sandstone(parameters) => parameters.plastic.map(|plastic| plastic.strength),
        }
    }

    /// What ties rotations to displacements [Pa].
    pub fn coupling_modulus(&self) -> f64 {
        match self {
            MaterialSpec::Elastic(moduli) | MaterialSpec::Elastoplastic(moduli, _) => moduli.kappa,
            MaterialSpec::Sandstone(parameters) => parameters.coupling_modulus,
        }
    }

    /// Poisson's ratio of the elastic part [-].
    pub fn poisson_ratio(&self) -> f64 {
        let (lambda, mu) = match self {
            MaterialSpec::Elastic(moduli) | MaterialSpec::Elastoplastic(moduli, _) => (moduli.lambda, moduli.mu),
            MaterialSpec::Sandstone(parameters) => {
                let mu = parameters.shear_modulus;
                (parameters.bulk_modulus - 2.0 / 3.0 * mu, mu)
            }
        };
        0.5 * lambda / (lambda + mu)
    }

    /// Slope of the plastic potential over the mean stress [-], zero where plastic strain leaves the volume as it is; `None`
    /// without plasticity.
    pub fn dilatancy_slope(&self) -> Option<f64> {
        match self {
            MaterialSpec::Elastic(_) => None,
            MaterialSpec::Elastoplastic(_, plastic) => Some(plastic.dilatancy_slope),
            MaterialSpec::Sandstone(parameters) => parameters.plastic.map(|plastic| plastic.dilatancy_slope),
        }
    }
}

/// Names of the laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    Elastic,
    DruckerPrager,
    VonMises,
    /// Damage and plasticity of sandstone, where points rotate.
    Sandstone,
}

/// What a user sets for a material.
///
/// The sandstone law (Neuner et al. 2024) takes `coupling_ratio` for the coupling, too; without `cohesion` and the keys
/// that go with it, it is elastic (not with a nonlocal damage field, which nothing would drive then).
///
/// Elasticity: `lame_lambda` and `shear_modulus`, or `youngs_modulus` and `poisson_ratio`, or `shear_modulus` and
/// `bulk_modulus`. The rest of the elasticity and `plastic_length` belong to rotations, which a classical continuum does
/// not have. Coupling: `coupling_modulus` or `coupling_number`. Curvature: `bending_length` with
/// `bounded_stiffness`, or `bending_length`, `torsion_length` and `polar_ratio`, or `alpha`, `beta` and `gamma`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialKeys {
    /// Constitutive law.
    pub law: LawName,
    /// Mass per reference volume [kg/m3], > 0; needed by a load of `gravity`.
    pub density: Option<f64>,
    /// Lame's first parameter [Pa]; `3 lame_lambda + 2 shear_modulus` > 0.
    pub lame_lambda: Option<f64>,
    /// Shear modulus [Pa], > 0.
    pub shear_modulus: Option<f64>,
    /// Bulk modulus [Pa], > 0.
    pub bulk_modulus: Option<f64>,
    /// Young's modulus [Pa], > 0.
    pub youngs_modulus: Option<f64>,
    /// Poisson's ratio [-], > -1 and < 0.5.
    pub poisson_ratio: Option<f64>,
    /// Coupling modulus kappa [Pa], >= 0.
    pub coupling_modulus: Option<f64>,
    /// Coupling number sqrt(kappa / (mu + kappa)) [-], >= 0 and < 1.
    pub coupling_number: Option<f64>,
    /// Characteristic length of bending sqrt((gamma + beta) / (4 mu)) [m], >= 0.
    pub bending_length: Option<f64>,
    /// Characteristic length of torsion sqrt(gamma / mu) [m], >= 0.
    pub torsion_length: Option<f64>,
    /// Polar ratio 2 gamma / (2 gamma + alpha) [-], > 0 and <= 1.5.
    pub polar_ratio: Option<f64>,
    /// With `true`, `bending_length` alone fixes the curvature: torsion twice as long, polar ratio 3/2.
    pub bounded_stiffness: Option<bool>,
    /// Coefficient of tr(Gamma) I in the couple-stress [N]; `3 alpha + 2 gamma` >= 0.
    pub alpha: Option<f64>,
    /// Half the coefficient of the skew part of Gamma [N]; `gamma + beta` >= 0.
    pub beta: Option<f64>,
    /// Half the coefficient of the symmetric part of Gamma [N], >= 0.
    pub gamma: Option<f64>,
    /// Friction angle of Mohr and Coulomb [degrees], >= 0 and < 90. How the cone stands for it, `cone_fit` says.
    pub friction_angle: Option<f64>,
    /// Dilatancy angle [degrees], >= 0 and < 90; the potential is a cone with the same `cone_fit`.
    pub dilatancy_angle: Option<f64>,
    /// Cohesion of Mohr and Coulomb [Pa], > 0. Either this or `yield_strength`.
    pub cohesion: Option<f64>,
    /// Generalised shear stress q at first yield without pressure, k [Pa], > 0. For a soil of undrained shear strength c_u:
    /// sqrt(3) c_u in plane strain, 2 c_u in triaxial compression.
    pub yield_strength: Option<f64>,
    /// Increase of the yield strength with the equivalent plastic strain, H [Pa]; 0 unless set.
    pub hardening_modulus: Option<f64>,
    /// Internal length of plasticity l_p [m], > 0: weighs the couple-stress in the yield function.
    pub plastic_length: Option<f64>,
    /// Coupling modulus over shear modulus, Gc/G [-], >= 0 (sandstone).
    pub coupling_ratio: Option<f64>,
    /// Where the cone of friction angle, dilatancy angle and cohesion equals Mohr and Coulomb's pyramid: `compression`, in
    /// triaxial compression (through the outer corners); `extension`, in triaxial extension (through the inner corners);
    /// `plane_strain`, at failure in plane strain, for any dilatancy angle; `inscribed`, the cone within the pyramid that touches
    /// its faces, which is `plane_strain` with a dilatancy angle equal to the friction angle; or the number A of 6 sin/(3 + A sin) [-],
    /// -1 (`compression`) to 1 (`extension`). `compression` unless set, for `law: sandstone` `extension`. Textbook values of
    /// a plane problem ask for `plane_strain`: there `compression` is stronger, for 30 degrees as 44 degrees without
    /// dilatancy.
    pub cone_fit: Option<ConeFit>,
    /// Increase of the yield strength by hardening, h_delta [Pa], >= 0; 0 unless set (sandstone).
    pub hardening_stress: Option<f64>,
    /// Rate of the hardening with the equivalent plastic strain, h_exp [-], > 0 (sandstone).
    pub hardening_rate: Option<f64>,
    /// Rate at which dilatancy dies out with the equivalent plastic strain, h_d [-], >= 0; 0 unless set (sandstone).
    pub dilation_rate: Option<f64>,
    /// Rounding of the yield cone at its apex [Pa], >= 0 and below the strength in shear; 1e-3 of that unless set. With 0
    /// there are strains without a stress (sandstone).
    pub apex_rounding: Option<f64>,
    /// Length over which damage spreads, l_d [m], > 0 (sandstone with a nonlocal damage field).
    pub damage_length: Option<f64>,
    /// Plastic growth of volume that damages, eps_f [-], > 0 (sandstone with a nonlocal damage field).
    pub softening_modulus: Option<f64>,
    /// Largest damage [-], > 0 and < 1; 0.99 unless set (sandstone with a nonlocal damage field).
    pub max_damage: Option<f64>,
}

/// What is wrong with one key of a material; an empty key means the material as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyProblem {
    pub key: &'static str,
    pub message: String,
    pub expected: String,
}

const ELASTIC_KEYS: [&str; 6] = [
    "density",
    "lame_lambda",
    "shear_modulus",
    "bulk_modulus",
    "youngs_modulus",
    "poisson_ratio",
];

/// Keys of the elasticity of points that rotate; the only one of them that is no number is `bounded_stiffness`.
const ROTATION_KEYS: [&str; 9] = [
    "coupling_modulus",
    "coupling_number",
    "bending_length",
    "torsion_length",
    "polar_ratio",
    "bounded_stiffness",
    "alpha",
    "beta",
    "gamma",
];

/// A key of plastic laws that belongs to rotations, too.
const PLASTIC_LENGTH: &str = "plastic_length";

/// How the sandstone law spells the coupling of the rotations.
const COUPLING_RATIO: &str = "coupling_ratio";

/// The one key that is a word or a number.
pub const CONE_FIT: &str = "cone_fit";

fn belongs_to_rotations(key: &str) -> bool {
    ROTATION_KEYS.contains(&key) || key == PLASTIC_LENGTH || key == COUPLING_RATIO
}

const DRUCKER_PRAGER_KEYS: [&str; 7] = [
    "friction_angle",
    "dilatancy_angle",
    "cohesion",
    CONE_FIT,
    "yield_strength",
    "hardening_modulus",
    "plastic_length",
];

/// Keys of the yield surface of the sandstone law: all that must be set are, or none.
const SANDSTONE_YIELD_KEYS: [&str; 9] = [
    "cohesion",
    "friction_angle",
    "dilatancy_angle",
    "plastic_length",
    CONE_FIT,
    "hardening_stress",
    "hardening_rate",
    "dilation_rate",
    "apex_rounding",
];

const DAMAGE_KEYS: [&str; 3] = ["damage_length", "softening_modulus", "max_damage"];

const VON_MISES_KEYS: [&str; 3] = ["yield_strength", "hardening_modulus", "plastic_length"];

/// Rounding of the apex of the sandstone law over the strength in shear, unless set: it changes results by 1e-8.
const APEX_ROUNDING: f64 = 1e-3;

/// Weights of the generalised invariant J2 (N 65): half the squares of Mandel stress and couple-stress.
const INVARIANT_WEIGHTS: [f64; 4] = [0.5, 0.0, 0.5, 0.0];

impl LawName {
    /// Keys that the law knows beside those of elasticity.
    fn plastic_keys(self, continuum: ContinuumKind) -> Vec<&'static str> {
        match self {
            LawName::Elastic => Vec::new(),
            LawName::DruckerPrager => DRUCKER_PRAGER_KEYS.to_vec(),
            LawName::VonMises => VON_MISES_KEYS.to_vec(),
            LawName::Sandstone => {
                let mut keys = vec![COUPLING_RATIO];
                keys.extend(SANDSTONE_YIELD_KEYS);
                if continuum.has_damage() {
                    keys.extend(DAMAGE_KEYS);
                }
                keys
            }
        }
    }
}

/// Bounds of the cohesion of Drucker-Prager soil, and what dry sand takes instead of none.
const COHESION: &str = "a number > 0; for dry sand a small one that its loads hardly feel, such as 0.1e3 to 1e3, with \
                        stabilisation.ghost or grid.basis: bspline2 where cells hold little";

impl MaterialKeys {
    /// The keys that hold numbers and are set, by name.
    pub fn numbers_mut(&mut self) -> impl Iterator<Item = (&'static str, &mut f64)> {
        let numbers = [
            ("density", self.density.as_mut()),
            ("lame_lambda", self.lame_lambda.as_mut()),
            ("shear_modulus", self.shear_modulus.as_mut()),
            ("bulk_modulus", self.bulk_modulus.as_mut()),
            ("youngs_modulus", self.youngs_modulus.as_mut()),
            ("poisson_ratio", self.poisson_ratio.as_mut()),
            ("coupling_modulus", self.coupling_modulus.as_mut()),
            ("coupling_number", self.coupling_number.as_mut()),
            ("bending_length", self.bending_length.as_mut()),
            ("torsion_length", self.torsion_length.as_mut()),
            ("polar_ratio", self.polar_ratio.as_mut()),
            ("alpha", self.alpha.as_mut()),
            ("beta", self.beta.as_mut()),
            ("gamma", self.gamma.as_mut()),
            ("friction_angle", self.friction_angle.as_mut()),
            ("dilatancy_angle", self.dilatancy_angle.as_mut()),
            ("cohesion", self.cohesion.as_mut()),
            ("yield_strength", self.yield_strength.as_mut()),
            ("hardening_modulus", self.hardening_modulus.as_mut()),
            ("plastic_length", self.plastic_length.as_mut()),
            ("coupling_ratio", self.coupling_ratio.as_mut()),
            (CONE_FIT, self.cone_fit.as_mut().and_then(ConeFit::number_mut)),
            ("hardening_stress", self.hardening_stress.as_mut()),
            ("hardening_rate", self.hardening_rate.as_mut()),
            ("dilation_rate", self.dilation_rate.as_mut()),
            ("apex_rounding", self.apex_rounding.as_mut()),
            ("damage_length", self.damage_length.as_mut()),
            ("softening_modulus", self.softening_modulus.as_mut()),
            ("max_damage", self.max_damage.as_mut()),
        ];
        numbers.into_iter().filter_map(|(key, number)| Some((key, number?)))
    }

    /// Names of the keys that hold numbers and are set.
    pub fn numbers_set(&self) -> Vec<&'static str> {
        self.clone().numbers_mut().map(|(key, _)| key).collect()
    }

    /// Names of the keys beside the law that are set.
    fn keys_set(&self) -> Vec<&'static str> {
        let mut set = self.numbers_set();
        set.extend(self.bounded_stiffness.map(|_| "bounded_stiffness"));
        if matches!(self.cone_fit, Some(ConeFit::Named(_))) {
            set.push(CONE_FIT);
        }
        set
    }

    /// The fit of the cone: unless set, that of the paper that the law comes from.
    fn fit(&self) -> ConeFit {
        let default = match self.law {
            LawName::Sandstone => NamedFit::Extension,
            LawName::Elastic | LawName::DruckerPrager | LawName::VonMises => NamedFit::Compression,
        };
        self.cone_fit.unwrap_or(ConeFit::Named(default))
    }

    /// The cone of a law that fits one to a friction angle, where that is set.
    pub fn cone(&self) -> Option<FittedCone> {
        let has_cone = matches!(self.law, LawName::DruckerPrager | LawName::Sandstone);
        let (friction, dilatancy) = self.friction_angle.zip(self.dilatancy_angle).filter(|_| has_cone)?;
        Some(FittedCone {
            fit: self.fit(),
            friction: friction.to_radians(),
            dilatancy: dilatancy.to_radians(),
        })
    }

    /// Whether a key is set that only a body with rotations has.
    pub fn sets_rotations(&self) -> bool {
        self.bounded_stiffness.is_some() || self.numbers_set().into_iter().any(belongs_to_rotations)
    }

    /// The law of a continuum with its parameters; `tolerance` [-] ends the local iteration of a plastic law.
    ///
    /// # Errors
    /// All that is wrong: keys that are missing, contradict each other or are unknown to law or continuum, and moduli
    /// without positive energy.
    pub fn resolve(&self, continuum: ContinuumKind, tolerance: f64) -> Result<MaterialSpec, Vec<KeyProblem>> {
        let mut checks = Checks {
            keys: self,
            continuum,
            problems: Vec::new(),
        };
        if !checks.law_fits_continuum() {
            return Err(checks.problems);
        }
        checks.refuse_foreign_keys();
        checks.positive("density", self.density);
        let elastic = checks.elastic();
        if self.law == LawName::Sandstone {
            let sandstone = checks.sandstone(elastic, tolerance);
            return match sandstone {
                Some(parameters) if checks.problems.is_empty() => Ok(MaterialSpec::Sandstone(parameters)),
                _ => Err(checks.problems),
            };
        }
        let plastic = match self.law {
            LawName::Elastic | LawName::Sandstone => None,
            LawName::DruckerPrager => Some(checks.drucker_prager(tolerance)),
            LawName::VonMises => Some(checks.von_mises(tolerance)),
        };
        if let (Some(elastic), Some(Some(plastic))) = (&elastic, &plastic) {
            checks.classical_softening(elastic, plastic);
        }
        let spec = match (elastic, plastic) {
            (Some(elastic), None) => Some(MaterialSpec::Elastic(elastic)),
            (Some(elastic), Some(Some(plastic))) => Some(MaterialSpec::Elastoplastic(elastic, plastic)),
            _ => None,
        };
        match spec {
            Some(spec) if checks.problems.is_empty() => Ok(spec),
            _ => Err(checks.problems),
        }
    }
}

/// Converts the keys of a material and collects what is wrong with them.
struct Checks<'a> {
    keys: &'a MaterialKeys,
    continuum: ContinuumKind,
    problems: Vec<KeyProblem>,
}

impl Checks<'_> {
    fn report(&mut self, key: &'static str, message: impl Into<String>, expected: impl Into<String>) {
        self.problems.push(KeyProblem {
            key,
            message: message.into(),
            expected: expected.into(),
        });
    }

    /// Reports a value that is outside its bounds.
    fn bound(&mut self, key: &'static str, value: f64, within: bool, bounds: &str) -> bool {
        if !within {
            self.report(key, format!("{} is out of bounds", figure(value)), bounds);
        }
        within
    }

    fn positive(&mut self, key: &'static str, value: Option<f64>) {
        if let Some(value) = value {
            self.bound(key, value, value > 0.0, "a number > 0");
        }
    }

    fn not_negative(&mut self, key: &'static str, value: Option<f64>) {
        if let Some(value) = value {
            self.bound(key, value, value >= 0.0, "a number >= 0");
        }
    }

    /// Which of a group of keys are set.
    fn set_of(&self, group: &[&'static str]) -> Vec<&'static str> {
        let mut set = self.keys.keys_set();
        set.retain(|key| group.contains(key));
        if self.keys.bounded_stiffness == Some(false) {
            set.retain(|key| *key != "bounded_stiffness");
        }
        set
    }

    fn law_fits_continuum(&mut self) -> bool {
        let sandstone = self.keys.law == LawName::Sandstone;
        if sandstone && !self.continuum.has_rotations() {
            let expected = "continuum: micropolar or gradient_micropolar; elastic, drucker_prager, von_mises";
            self.report("law", "a classical continuum does not know this law", expected);
            return false;
        }
        if !sandstone && self.continuum.has_damage() {
            let message = "this law does not drive a nonlocal damage field";
            self.report("law", message, "sandstone; or continuum: micropolar");
            return false;
        }
        true
    }

    fn refuse_foreign_keys(&mut self) {
        let plastic = self.keys.law.plastic_keys(self.continuum);
        let rotations = self.continuum.has_rotations();
        let mut accepted = [&ELASTIC_KEYS, plastic.as_slice()].concat();
        if rotations {
            accepted.extend(ROTATION_KEYS);
        } else {
            accepted.retain(|key| *key != PLASTIC_LENGTH);
        }
        let set = self.keys.keys_set();
        for key in set.into_iter().filter(|key| !accepted.contains(key)) {
            let message = if !rotations && belongs_to_rotations(key) {
                "a classical continuum has no rotations and does not know this key"
            } else if self.keys.law == LawName::Sandstone && DAMAGE_KEYS.contains(&key) {
                "only continuum: gradient_micropolar has a nonlocal damage field"
            } else {
                "the law of this material does not know this key"
            };
            self.report(key, message, accepted.join(", "));
        }
    }

    /// The chosen one of several sets of keys; anything but exactly one complete set is reported.
    fn choose(&mut self, what: &str, choices: &[&[&'static str]]) -> Option<usize> {
        let set = self.set_of(&choices.concat());
        let same = |choice: &&[&str]| choice.len() == set.len() && choice.iter().all(|key| set.contains(key));
        let chosen = choices.iter().position(same);
        if chosen.is_none() {
            let accepted: Vec<_> = choices.iter().map(|choice| choice.join(" and ")).collect();
            let accepted = match accepted.as_slice() {
                [only] => only.clone(),
                several => format!("either {}", several.join(", or ")),
            };
            match set.as_slice() {
                [] => self.report("", format!("{what} is missing"), accepted),
                [.., last] => {
                    let message = format!("{what} is not given by {} together", set.join(", "));
                    let message = if set.len() == 1 {
                        format!("{what} is not given by {last} alone")
                    } else {
                        message
                    };
                    self.report(last, message, accepted);
                }
            }
        }
        chosen
    }

    fn elastic(&mut self) -> Option<ElasticModuli> {
        let lame = self.lame();
        if !self.continuum.has_rotations() {
            return lame.map(|(lambda, mu)| ElasticModuli::without_rotations(lambda, mu));
        }
        let couplings: [&[&str]; 3] = [&["coupling_modulus"], &["coupling_number"], &[COUPLING_RATIO]];
        let known = if self.keys.law == LawName::Sandstone { 3 } else { 2 };
        let coupling = self.choose("the coupling of the rotations", &couplings[..known]);
        self.not_negative("coupling_modulus", self.keys.coupling_modulus);
        self.not_negative(COUPLING_RATIO, self.keys.coupling_ratio);
        if let Some(number) = self.keys.coupling_number {
            self.bound(
                "coupling_number",
                number,
                (0.0..1.0).contains(&number),
                "a number >= 0 and < 1",
            );
        }
        // Curvature in units of the shear modulus is checked even where that is wrong.
        let (lambda, mu) = lame.unwrap_or((1.0, 1.0));
        let curvature = self.curvature(mu);
        lame?;
        let kappa = match coupling? {
            0 => self.keys.coupling_modulus?,
            2 => mu * self.keys.coupling_ratio?,
            _ => self
                .keys
                .coupling_number
                .map(|number| mu * number * number / (1.0 - number * number))?,
        };
        let [alpha, beta, gamma] = curvature?;
        Some(ElasticModuli {
            lambda,
            mu,
            kappa,
            alpha,
            beta,
            gamma,
        })
    }

    /// Lame's parameters lambda and mu, with `mu > 0` and `3 lambda + 2 mu > 0`.
    fn lame(&mut self) -> Option<(f64, f64)> {
        let keys = self.keys;
        self.positive("shear_modulus", keys.shear_modulus);
        self.positive("bulk_modulus", keys.bulk_modulus);
        self.positive("youngs_modulus", keys.youngs_modulus);
        if let Some(ratio) = keys.poisson_ratio {
            self.bound(
                "poisson_ratio",
                ratio,
                ratio > -1.0 && ratio < 0.5,
                "a number > -1 and < 0.5",
            );
        }
        let choices: [&[&str]; 3] = [
            &["lame_lambda", "shear_modulus"],
            &["youngs_modulus", "poisson_ratio"],
            &["shear_modulus", "bulk_modulus"],
        ];
        match self.choose("the elasticity", &choices)? {
            0 => {
                let (lambda, mu) = (keys.lame_lambda?, keys.shear_modulus?);
                if mu > 0.0 && 3.0 * lambda + 2.0 * mu <= 0.0 {
                    let message = format!(
                        "{} makes 3 lame_lambda + 2 shear_modulus = {}",
                        figure(lambda),
                        figure(3.0 * lambda + 2.0 * mu)
                    );
                    self.report("lame_lambda", message, "3 lame_lambda + 2 shear_modulus > 0");
                }
                Some((lambda, mu))
            }
            1 => {
                let (young, poisson) = (keys.youngs_modulus?, keys.poisson_ratio?);
                let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
                Some((lambda, young / (2.0 * (1.0 + poisson))))
            }
            _ => {
                let (mu, bulk) = (keys.shear_modulus?, keys.bulk_modulus?);
                Some((bulk - 2.0 / 3.0 * mu, mu))
            }
        }
    }

    /// `alpha`, `beta`, `gamma` (docs/theory.md, elastic constants).
    fn curvature(&mut self, mu: f64) -> Option<[f64; 3]> {
        let keys = self.keys;
        self.not_negative("bending_length", keys.bending_length);
        self.not_negative("torsion_length", keys.torsion_length);
        if let Some(ratio) = keys.polar_ratio {
            self.bound(
                "polar_ratio",
                ratio,
                ratio > 0.0 && ratio <= 1.5,
                "a number > 0 and <= 1.5",
            );
        }
        let choices: [&[&str]; 3] = [
            &["bending_length", "bounded_stiffness"],
            &["bending_length", "torsion_length", "polar_ratio"],
            &["alpha", "beta", "gamma"],
        ];
        match self.choose("the stiffness against curvature", &choices)? {
            0 => {
                let gamma = 4.0 * mu * keys.bending_length?.powi(2);
                Some([-2.0 / 3.0 * gamma, 0.0, gamma])
            }
            1 => {
                let gamma = mu * keys.torsion_length?.powi(2);
                let beta = 4.0 * mu * keys.bending_length?.powi(2) - gamma;
                Some([2.0 * gamma * (1.0 / keys.polar_ratio? - 1.0), beta, gamma])
            }
            _ => {
                let [alpha, beta, gamma] = [keys.alpha?, keys.beta?, keys.gamma?];
                // Bounds that hold with equality must survive the rounding of their decimal digits.
                let round_off = 1e-9 * (gamma.abs() + alpha.abs() + beta.abs());
                if self.bound("gamma", gamma, gamma >= 0.0, "a number >= 0") {
                    self.bound("beta", beta, gamma + beta >= -round_off, "gamma + beta >= 0");
                    self.bound(
                        "alpha",
                        alpha,
                        3.0 * alpha + 2.0 * gamma >= -round_off,
                        "3 alpha + 2 gamma >= 0",
                    );
                }
                Some([alpha, beta, gamma])
            }
        }
    }

    /// Whether an angle is given and within its bounds.
    fn angle(&mut self, key: &'static str, degrees: Option<f64>) -> bool {
        let accepted = "an angle in degrees, >= 0 and < 90";
        let Some(degrees) = degrees else {
            self.report(key, "this key is missing", accepted);
            return false;
        };
        self.bound(key, degrees, (0.0..90.0).contains(&degrees), accepted)
    }

    /// Both angles with the fit of the cone to them.
    fn cone(&mut self) -> Option<FittedCone> {
        let keys = self.keys;
        let angles = [
            self.angle("friction_angle", keys.friction_angle),
            self.angle("dilatancy_angle", keys.dilatancy_angle),
        ];
        if let Some(ConeFit::Number(number)) = keys.cone_fit {
            let within = (-1.0..=1.0).contains(&number);
            self.bound(CONE_FIT, number, within, &ConeFit::accepted());
        }
        keys.cone().filter(|_| !angles.contains(&false))
    }

    /// The classical return is a division by the fall of the yield function along it.
    fn classical_softening(&mut self, elastic: &ElasticModuli, plastic: &PlasticParameters) {
        let bulk = elastic.lambda + 2.0 / 3.0 * elastic.mu;
        let fall = 3.0 * elastic.mu + bulk * plastic.friction_slope * plastic.dilatancy_slope;
        let hardening = plastic.hardening_modulus;
        if !self.continuum.has_rotations() && hardening <= -fall {
            let message = format!(
                "{} softens faster than the stress of a point can fall",
                figure(hardening)
            );
            self.report("hardening_modulus", message, format!("a number > {}", figure(-fall)));
        }
    }

    fn drucker_prager(&mut self, tolerance: f64) -> Option<PlasticParameters> {
        let keys = self.keys;
        let cone = self.cone();
        let strength = self.choose("the strength", &[&["cohesion"], &["yield_strength"]]);
        if let Some(cohesion) = keys.cohesion {
            self.bound("cohesion", cohesion, cohesion > 0.0, COHESION);
        }
        self.positive("yield_strength", keys.yield_strength);
        let plastic_length = self.plastic_length();
        let cone = cone?;
        let yield_strength = match strength? {
            0 => cone.strength(keys.cohesion?),
            _ => keys.yield_strength?,
        };
        Some(PlasticParameters {
            friction_slope: cone.friction_slope(),
            dilatancy_slope: cone.dilatancy_slope(),
            yield_strength,
            hardening_modulus: keys.hardening_modulus.unwrap_or(0.0),
            plastic_length: plastic_length?,
            tolerance,
        })
    }

    fn von_mises(&mut self, tolerance: f64) -> Option<PlasticParameters> {
        let strength = self.choose("the strength", &[&["yield_strength"]]);
        self.positive("yield_strength", self.keys.yield_strength);
        let plastic_length = self.plastic_length();
        strength?;
        Some(PlasticParameters {
            friction_slope: 0.0,
            dilatancy_slope: 0.0,
            yield_strength: self.keys.yield_strength?,
            hardening_modulus: self.keys.hardening_modulus.unwrap_or(0.0),
            plastic_length: plastic_length?,
            tolerance,
        })
    }

    fn sandstone(&mut self, elastic: Option<ElasticModuli>, tolerance: f64) -> Option<SandstoneParameters> {
        let plastic = self.sandstone_yield(tolerance);
        let damage = self.sandstone_damage();
        let elastic = elastic?;
        // Bounds that hold with equality must survive the rounding of their decimal digits.
        if elastic.beta < -1e-9 * elastic.gamma {
            let key = if self.keys.beta.is_some() {
                "beta"
            } else {
                "torsion_length"
            };
            let message = "the skew part of the wryness has a negative energy";
            self.report(key, message, "torsion_length <= 2 bending_length (beta >= 0)");
        }
        Some(SandstoneParameters {
            shear_modulus: elastic.mu,
            bulk_modulus: elastic.lambda + 2.0 / 3.0 * elastic.mu,
            coupling_modulus: elastic.kappa,
            alpha: elastic.alpha,
            beta: elastic.beta.max(0.0),
            gamma: elastic.gamma,
            plastic: plastic?,
            damage: damage?,
        })
    }

    /// `Some(None)` where no key of the yield surface is set.
    fn sandstone_yield(&mut self, tolerance: f64) -> Option<Option<SandstoneYield>> {
        let keys = self.keys;
        if self.set_of(&SANDSTONE_YIELD_KEYS).is_empty() {
            if self.continuum.has_damage() {
                let message = "without a yield surface nothing drives the damage";
                self.report(
                    "cohesion",
                    message,
                    "cohesion, friction_angle, dilatancy_angle and plastic_length; or continuum: micropolar",
                );
                return None;
            }
            return Some(None);
        }
        let cone = self.cone();
        let cohesion = self.required_positive("cohesion", keys.cohesion, "a stress in Pa, > 0");
        let plastic_length = self.plastic_length();
        self.not_negative("hardening_stress", keys.hardening_stress);
        self.not_negative("dilation_rate", keys.dilation_rate);
        self.positive("hardening_rate", keys.hardening_rate);
        let hardening_stress = keys.hardening_stress.unwrap_or(0.0);
        if hardening_stress > 0.0 && keys.hardening_rate.is_none() {
            self.report(
                "hardening_rate",
                "this key is missing",
                "a number > 0 with hardening_stress",
            );
        }
        let cone = cone?;
        let strength = cone.strength(cohesion?);
        let rounding = keys.apex_rounding.unwrap_or(APEX_ROUNDING * strength);
        let within = rounding >= 0.0 && rounding < strength;
        self.bound(
            "apex_rounding",
            rounding,
            within,
            &format!("a stress >= 0 and < {} (the strength in shear)", figure(strength)),
        );
        Some(Some(SandstoneYield {
            strength,
            friction_slope: cone.friction_slope(),
            dilatancy_slope: cone.dilatancy_slope(),
            hardening_stress,
            hardening_rate: keys.hardening_rate.unwrap_or(0.0),
            dilation_rate: keys.dilation_rate.unwrap_or(0.0),
            plastic_length: plastic_length?,
            weights: INVARIANT_WEIGHTS,
            apex_rounding: rounding,
            tolerance,
        }))
    }

    /// `Some(None)` where there is no nonlocal damage field.
    fn sandstone_damage(&mut self) -> Option<Option<SandstoneDamage>> {
        if !self.continuum.has_damage() {
            return Some(None);
        }
        let keys = self.keys;
        let length = self.required_positive("damage_length", keys.damage_length, "a length in m, > 0");
        let softening = self.required_positive("softening_modulus", keys.softening_modulus, "a number > 0");
        let max_damage = keys.max_damage.unwrap_or(0.99);
        let within = max_damage > 0.0 && max_damage < 1.0;
        self.bound("max_damage", max_damage, within, "a number > 0 and < 1");
        Some(Some(SandstoneDamage {
            length: length?,
            softening_modulus: softening?,
            max_damage,
        }))
    }

    fn required_positive(&mut self, key: &'static str, value: Option<f64>, expected: &str) -> Option<f64> {
        if value.is_none() {
            self.report(key, "this key is missing", expected);
        }
        self.positive(key, value);
        value
    }

    fn plastic_length(&mut self) -> Option<f64> {
        if !self.continuum.has_rotations() {
            return Some(0.0);
        }
        if self.keys.plastic_length.is_none() {
            self.report("plastic_length", "this key is missing", "a length in m, > 0");
        }
        self.positive("plastic_length", self.keys.plastic_length);
        self.keys.plastic_length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(json: serde_json::Value) -> MaterialKeys {
        serde_json::from_value(json).unwrap()
    }

    fn layer() -> serde_json::Value {
        serde_json::json!({
            "law": "drucker_prager", "lame_lambda": 4e9, "shear_modulus": 4e9, "coupling_modulus": 4e8,
            "bending_length": 5e-3, "bounded_stiffness": true, "friction_angle": 8.6, "dilatancy_angle": 2.0,
            "yield_strength": 100e6, "plastic_length": 5e-3,
        })
    }

    fn with(mut json: serde_json::Value, changes: &[(&str, serde_json::Value)]) -> MaterialKeys {
        for (key, value) in changes {
            json[key] = value.clone();
        }
        keys(json)
    }

    fn reported(keys: &MaterialKeys) -> Vec<&'static str> {
        keys.resolve(ContinuumKind::Micropolar, 1e-9)
            .unwrap_err()
            .iter()
            .map(|problem| problem.key)
            .collect()
    }

    fn close(value: f64, expected: f64) -> bool {
        (value - expected).abs() <= 1e-12 * expected.abs().max(1e-30)
    }

    #[test]
    fn bounded_stiffness_fixes_the_three_coefficients() {
        let Ok(MaterialSpec::Elastoplastic(elastic, plastic)) = keys(layer()).resolve(ContinuumKind::Micropolar, 1e-9)
        else {
            panic!()
        };
        assert!(
            close(elastic.gamma, 4e5) && close(elastic.alpha, -2.0 / 3.0 * 4e5),
            "{elastic:?}"
        );
        assert_eq!(
            (elastic.lambda, elastic.mu, elastic.kappa, elastic.beta),
            (4e9, 4e9, 4e8, 0.0)
        );
        let sine = 8.6_f64.to_radians().sin();
        assert!(close(plastic.friction_slope, 6.0 * sine / (3.0 - sine)));
        assert_eq!(
            (plastic.yield_strength, plastic.hardening_modulus, plastic.tolerance),
            (100e6, 0.0, 1e-9)
        );
    }

    #[test]
    fn the_three_sets_of_curvature_constants_agree() {
        let none = serde_json::Value::Null;
        let lengths = with(
            layer(),
            &[
                ("bounded_stiffness", none.clone()),
                ("torsion_length", 1e-2.into()),
                ("polar_ratio", 1.5.into()),
            ],
        );
        let names = with(
            layer(),
            &[
                ("bounded_stiffness", none.clone()),
                ("bending_length", none),
                ("alpha", (-2.0 / 3.0 * 4e5).into()),
                ("beta", 0.0.into()),
                ("gamma", 4e5.into()),
            ],
        );
        for keys in [lengths, names] {
            let Ok(MaterialSpec::Elastoplastic(elastic, _)) = keys.resolve(ContinuumKind::Micropolar, 1e-9) else {
                panic!("{keys:?}")
            };
            assert!(
                close(elastic.gamma, 4e5) && close(elastic.alpha, -2.0 / 3.0 * 4e5),
                "{elastic:?}"
            );
            assert!(elastic.beta.abs() < 1e-9 * elastic.gamma, "{elastic:?}");
        }
    }

    #[test]
    fn the_three_sets_of_elastic_constants_agree() {
        let none = serde_json::Value::Null;
        let young = with(
            layer(),
            &[
                ("lame_lambda", none.clone()),
                ("shear_modulus", none.clone()),
                ("youngs_modulus", 10e9.into()),
                ("poisson_ratio", 0.25.into()),
                ("coupling_modulus", none.clone()),
                ("coupling_number", (1.0_f64 / 11.0).sqrt().into()),
            ],
        );
        let bulk = with(
            layer(),
            &[("lame_lambda", none), ("bulk_modulus", (4e9 + 8e9 / 3.0).into())],
        );
        for keys in [young, bulk] {
            let Ok(MaterialSpec::Elastoplastic(elastic, _)) = keys.resolve(ContinuumKind::Micropolar, 1e-9) else {
                panic!("{keys:?}")
            };
            assert!(
                close(elastic.lambda, 4e9) && close(elastic.mu, 4e9) && close(elastic.kappa, 4e8),
                "{elastic:?}"
            );
        }
    }

    #[test]
    fn cohesion_becomes_the_strength_of_the_cone() {
        let none = serde_json::Value::Null;
        let keys = with(
            layer(),
            &[
                ("yield_strength", none),
                ("cohesion", 100e3.into()),
                ("friction_angle", 30.0.into()),
            ],
        );
        let Ok(MaterialSpec::Elastoplastic(_, plastic)) = keys.resolve(ContinuumKind::Micropolar, 1e-9) else {
            panic!()
        };
        assert!(
            close(plastic.yield_strength, 6.0 * 100e3 * 30_f64.to_radians().cos() / 2.5),
            "{plastic:?}"
        );
    }

    #[test]
    fn problems_are_reported_on_the_keys_that_were_typed() {
        assert_eq!(
            reported(&with(layer(), &[("shear_modulus", (-1.0).into())])),
            ["shear_modulus"]
        );
        assert_eq!(
            reported(&with(layer(), &[("lame_lambda", (-3e9).into())])),
            ["lame_lambda"]
        );
        assert_eq!(
            reported(&with(layer(), &[("poisson_ratio", 0.6.into())])),
            ["poisson_ratio", "poisson_ratio"]
        );
        assert_eq!(
            reported(&with(layer(), &[("torsion_length", 0.1.into())])),
            ["bounded_stiffness"]
        );
        assert_eq!(
            reported(&with(layer(), &[("friction_angle", 90.0.into())])),
            ["friction_angle"]
        );
        assert_eq!(
            reported(&with(layer(), &[("cohesion", 1.0.into())])),
            ["yield_strength"]
        );
        assert_eq!(
            reported(&with(layer(), &[("law", "von_mises".into())])),
            ["friction_angle", "dilatancy_angle"]
        );
        let wrong = [
            ("coupling_modulus", (-1.0).into()),
            ("plastic_length", 0.0.into()),
            ("density", 0.0.into()),
        ];
        assert_eq!(
            reported(&with(layer(), &wrong)),
            ["density", "coupling_modulus", "plastic_length"]
        );
        assert_eq!(reported(&keys(serde_json::json!({"law": "elastic"}))), ["", "", ""]);
    }

    #[test]
    fn indefinite_curvature_is_refused() {
        let none = serde_json::Value::Null;
        let typed = |alpha: f64, beta: f64, gamma: f64| {
            let cleared = [("bounded_stiffness", none.clone()), ("bending_length", none.clone())];
            let set = [("alpha", alpha.into()), ("beta", beta.into()), ("gamma", gamma.into())];
            with(layer(), &[cleared.as_slice(), set.as_slice()].concat())
        };
        assert!(typed(-2.0, 0.0, 3.0).resolve(ContinuumKind::Micropolar, 1e-9).is_ok());
        assert_eq!(reported(&typed(-2.1, 0.0, 3.0)), ["alpha"]);
        assert_eq!(reported(&typed(0.0, -3.1, 3.0)), ["beta"]);
        assert_eq!(reported(&typed(0.0, 0.0, -3.0)), ["gamma"]);
    }
}
