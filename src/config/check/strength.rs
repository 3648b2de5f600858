//! What the strength of a material amounts to where it was typed without saying for which state of stress.

use crate::material::cone_fit::{ConeFit, MohrCoulomb, NamedFit};
use crate::material::spec::{MaterialKeys, MaterialSpec};

/// What the cone of a material amounts to in plane strain, for a material whose fit nobody chose.
pub(super) fn assumed_cone(name: &str, keys: &MaterialKeys, spec: &MaterialSpec) -> Option<String> {
    let cone = keys.cone().filter(|_| keys.cone_fit.is_none())?;
    let strength = spec.strength()?;
    let state = match cone.fit {
        ConeFit::Named(NamedFit::Extension) => "extension",
        _ => "compression",
    };
    let typed = match keys.cohesion {
        Some(cohesion) => format!("a cohesion of {}", stress(cohesion)),
        None => format!("a yield_strength of {}", stress(strength)),
    };
    let angle = keys.friction_angle?;
    let amounts = match cone.in_plane_strain(strength) {
        Some(MohrCoulomb { friction, cohesion }) => format!(
            "Mohr-Coulomb with {:.1} degrees and {}",
            friction.to_degrees(),
            stress(cohesion)
        ),
        None => "stronger than Mohr-Coulomb with any friction angle".to_owned(),
    };
    Some(format!(
        "material {name}: cone_fit is not set, and the cone is that of triaxial {state}: friction_angle {angle} degrees and \
         {typed} are at failure in plane strain {amounts}; cone_fit: plane_strain takes them as those of plane strain, \
         cone_fit: {state} keeps this cone"
    ))
}

/// A stress with three digits.
fn stress(pascal: f64) -> String {
    let (value, unit) = match pascal.abs() {
        1e6.. => (pascal * 1e-6, "MPa"),
        1e3.. => (pascal * 1e-3, "kPa"),
        _ => (pascal, "Pa"),
    };
    // Three digits, and no zeros that say nothing.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    format!("{rounded} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stresses_have_three_digits() {
        for (pascal, text) in [
            (10e3, "10 kPa"),
            (13_462.0, "13.5 kPa"),
            (8e6, "8 MPa"),
            (0.25, "0.25 Pa"),
        ] {
            assert_eq!(stress(pascal), text);
        }
    }
}
