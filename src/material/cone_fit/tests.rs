use super::*;
use crate::continuum::classical::{Classical, ClassicalStrain, ClassicalStress};
use crate::material::spec::{ElasticModuli, PlasticParameters};
use crate::material::{Components, Material, hencky::HenckyPlasticity};
use nalgebra::Matrix3;

const NAMES: [NamedFit; 4] = [
    NamedFit::Compression,
    NamedFit::Extension,
    NamedFit::PlaneStrain,
    NamedFit::Inscribed,
];

fn cone(fit: ConeFit, friction: f64, dilatancy: f64) -> FittedCone {
    FittedCone {
        fit,
        friction: friction.to_radians(),
        dilatancy: dilatancy.to_radians(),
    }
}

fn named(fit: NamedFit, friction: f64, dilatancy: f64) -> FittedCone {
    cone(ConeFit::Named(fit), friction, dilatancy)
}

fn close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-13 * expected.abs(),
        "{found} instead of {expected}"
    );
}

/// Drucker and Prager (1952), equations 16 and 17, with sqrt(3) since `q = sqrt(3 J2)`.
#[test]
fn plane_strain_with_associated_flow_is_that_of_drucker_and_prager() {
    for degrees in [10.0_f64, 20.0, 30.0, 40.0] {
        let tangent = degrees.to_radians().tan();
        let root = (9.0 + 12.0 * tangent * tangent).sqrt();
        for fit in [NamedFit::PlaneStrain, NamedFit::Inscribed] {
            let cone = named(fit, degrees, degrees);
            close(cone.friction_slope(), 3.0 * 3.0_f64.sqrt() * tangent / root);
            close(cone.dilatancy_slope(), cone.friction_slope());
            close(cone.strength(7.0), 3.0 * 3.0_f64.sqrt() * 7.0 / root);
        }
    }
}

#[test]
fn plane_strain_without_dilatancy_is_a_circle_in_the_plane() {
    let cone = named(NamedFit::PlaneStrain, 25.0, 0.0);
    let angle = 25.0_f64.to_radians();
    close(cone.friction_slope(), 3.0_f64.sqrt() * angle.sin());
    close(cone.strength(7.0), 3.0_f64.sqrt() * 7.0 * angle.cos());
    assert_eq!(cone.dilatancy_slope(), 0.0);
}

/// In the corners of triaxial stress the largest and the smallest of the principal stresses obey Mohr and Coulomb, and the
/// rates of plastic strain Rowe's ratio of the dilatancy angle.
#[test]
fn the_corners_of_triaxial_stress_are_met() {
    let (phi, psi, cohesion) = (30.0_f64.to_radians(), 10.0_f64.to_radians(), 7.0);
    // The deviator of q = 1: compression along one axis, or extension.
    for (fit, axial) in [(NamedFit::Compression, -2.0 / 3.0), (NamedFit::Extension, 2.0 / 3.0)] {
        let cone = named(fit, 30.0, 10.0);
        let pressure = -20.0;
        let shear = cone.strength(cohesion) - cone.friction_slope() * pressure;
        let (one, other) = (pressure + axial * shear, pressure - 0.5 * axial * shear);
        let (largest, smallest) = (f64::max(one, other), f64::min(one, other));
        let radius = 0.5 * (largest - smallest);
        close(radius + 0.5 * (largest + smallest) * phi.sin(), cohesion * phi.cos());
        // Rates: 3 s/(2 q) + beta/3, along the axis and (twice) across.
        let rate = |deviator: f64| 1.5 * deviator + cone.dilatancy_slope() / 3.0;
        let (along, across) = (rate(axial), 2.0 * rate(-0.5 * axial));
        let (opening, closing) = (f64::max(along, across), f64::min(along, across));
        close(-opening / closing, (1.0 + psi.sin()) / (1.0 - psi.sin()));
    }
}

#[test]
fn the_number_runs_from_compression_to_extension() {
    for (number, fit) in [(-1.0, NamedFit::Compression), (1.0, NamedFit::Extension)] {
        let (by_number, by_name) = (cone(ConeFit::Number(number), 30.0, 10.0), named(fit, 30.0, 10.0));
        assert_eq!(by_number.friction_slope(), by_name.friction_slope());
        assert_eq!(by_number.dilatancy_slope(), by_name.dilatancy_slope());
        assert_eq!(by_number.strength(3.0), by_name.strength(3.0));
    }
}

#[test]
fn plane_strain_gives_back_the_angles_that_were_typed() {
    for (friction, dilatancy) in [(20.0, 0.0), (35.0, 12.0), (45.0, 45.0), (60.0, 5.0)] {
        let cone = named(NamedFit::PlaneStrain, friction, dilatancy);
        let found = cone.in_plane_strain(cone.strength(11.0)).unwrap();
        close(found.friction.to_degrees(), friction);
        close(found.cohesion, 11.0);
    }
    // The cone through the compression corners has sin phi = 6 sin/(sqrt(3) (3 - sin)), 43.9 degrees for 30.
    let steep = named(NamedFit::Compression, 30.0, 0.0).in_plane_strain(1.0).unwrap();
    close(steep.friction.sin(), 1.2 / 3.0_f64.sqrt());
    assert_eq!(named(NamedFit::Compression, 43.0, 0.0).in_plane_strain(1.0), None);
}

/// The inscribed cone lies within Mohr and Coulomb's pyramid for every angle of Lode, and touches it.
#[test]
fn the_inscribed_cone_touches_the_pyramid_from_within() {
    let (phi, cone) = (35.0_f64.to_radians(), named(NamedFit::Inscribed, 35.0, 0.0));
    let smallest = (0..=60_000)
        .map(|k| {
            let lode = (f64::from(k) * 1e-3 - 30.0).to_radians();
            let radius = lode.cos() / 3.0_f64.sqrt() + lode.sin() * phi.sin() / 3.0;
            // q of the pyramid without pressure and with unit cohesion.
            phi.cos() / radius
        })
        .fold(f64::INFINITY, f64::min);
    assert!((cone.strength(1.0) / smallest - 1.0).abs() < 1e-9, "{smallest}");
}

/// Kirchhoff stress of a point that is sheared and squeezed in plane strain until nothing but plastic strain changes.
fn collapsed(cone: &FittedCone, cohesion: f64, volume: f64) -> Matrix3<f64> {
    let plastic = PlasticParameters {
        friction_slope: cone.friction_slope(),
        dilatancy_slope: cone.dilatancy_slope(),
        yield_strength: cone.strength(cohesion),
        hardening_modulus: 0.0,
        plastic_length: 0.0,
        tolerance: 1e-12,
    };
    let law = HenckyPlasticity::new(
        &ElasticModuli::without_rotations(60e6, 40e6),
        &plastic,
        Components::Plane,
    );
    let mut state = vec![0.0; 8];
    Material::<Classical>::initial_state(&law, &mut state);
    let mut stress = ClassicalStress::default();
    // Rates of volume over shear of a flow that stays in the plane.
    let beta = cone.dilatancy_slope();
    let dilatancy = 3.0_f64.sqrt() * beta / (9.0 - beta * beta).sqrt();
    for step in 1..=1000 {
        // Squeezed along y at the rate of volume that the flow has, under a volume that confines it.
        let shortening = f64::from(step) * 2e-4;
        let growth = dilatancy * shortening - volume;
        let (along_x, along_y) = (0.5 * (growth + shortening), 0.5 * (growth - shortening));
        let deformation_gradient = Matrix3::from_diagonal(&[along_x.exp(), along_y.exp(), 1.0].into());
        let mut new = state.clone();
        let strain = ClassicalStrain { deformation_gradient };
        law.respond(&strain, &state, &mut new, &mut stress).unwrap();
        state = new;
    }
    stress.kirchhoff
}

/// A point driven in plane strain fails where Mohr and Coulomb's line says, with the angles that the cone amounts to; with
/// `plane_strain` these are the ones typed.
#[test]
fn a_point_in_plane_strain_fails_as_mohr_and_coulomb_say() {
    for (friction, dilatancy) in [(30.0, 0.0), (30.0, 12.0), (30.0, 30.0), (0.0, 0.0)] {
        for fit in NAMES.map(ConeFit::Named).into_iter().chain([ConeFit::Number(0.3)]) {
            let cone = cone(fit, friction, dilatancy);
            let expected = cone.in_plane_strain(cone.strength(10e3)).unwrap();
            let stress = collapsed(&cone, 10e3, 2e-3);
            let radius = 0.5 * (stress[(0, 0)] - stress[(1, 1)]);
            let centre = 0.5 * (stress[(0, 0)] + stress[(1, 1)]);
            let line = expected.cohesion * expected.friction.cos() - centre * expected.friction.sin();
            assert!(
                (radius / line - 1.0).abs() < 1e-6,
                "{cone:?}: {radius} instead of {line}"
            );
            if fit == ConeFit::Named(NamedFit::PlaneStrain) {
                assert!(
                    (expected.friction - cone.friction).abs() < 1e-13 && (expected.cohesion / 10e3 - 1.0).abs() < 1e-12
                );
            }
        }
    }
}
