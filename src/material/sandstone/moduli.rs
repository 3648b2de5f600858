//! Consistent moduli: what the converged local problem gives when stretch, wryness or `alpha` change.
//!
//! With `j = U^-T : dU` and `V~` the isochoric trial stretch,
//!
//! ```text
//! dV~ = Jt^(-1/3) dU Fp~^-1 - j/3 V~        R_S dS + R_y dy = S^'(V)[dV~ E]        f_S dS + f_y dy = -df|(dU, dGamma)
//! dB = -j/3 B + Jt^(-1/3) [dp V~^-T - p V~^-T dV~^T V~^-T + (1 - omega) d(V^-T S E^T)] Fp~^-T
//! d(V^-T S) = V^-T (dS - dV^T V^-T S)
//! ```
//!
//! The wryness reaches `S` through `y` alone: one solution for a unit of `f` serves all its components.

use super::flow::{Flow, FlowRule, Plastic, Point, Trial};
use super::tensor::{Tensor, deviatoric_unit};
use super::{Sandstone, SandstoneState};
use crate::continuum::Linearisation;
use crate::continuum::gradient_micropolar::GradientMicropolarModuli;
use crate::continuum::micropolar::MicropolarStrain;
use crate::continuum::tensor::component;
use crate::material::active::Pair;
use crate::material::dense::Factors;

/// A converged state with what all its derivatives share.
struct Base<'a, T> {
    trial: &'a Trial<T>,
    point: &'a Point<T>,
    /// `V~^-T` and `V^-T`.
    trial_cofactor: T,
    cofactor: T,
    /// `V^-T S`.
    force: T,
    /// `1 - omega`.
    intact: f64,
}

/// Changes of a state with one input.
struct Change<T> {
    /// `j`.
    volume: f64,
    /// `dV~`.
    trial: Option<T>,
    /// `dS`.
    deviator: T,
    /// `dy`.
    ratio: f64,
    /// `d dl`.
    multiplier: f64,
}

impl Sandstone {
    pub(super) fn moduli_in<T: Tensor, const N: usize, const COLUMNS: usize>(
        &self,
        strain: &MicropolarStrain,
        old: &SandstoneState,
        new: &SandstoneState,
        (omega, omega_rate): (f64, f64),
        linearisation: Linearisation,
        out: &mut GradientMicropolarModuli,
    ) -> bool {
        // Both exist where the response does.
        let Ok(trial) = self.trial::<T>(strain, old) else {
            return false;
        };
        let converged = self.converged(&trial, strain, old, new);
        let about_to_flow = match (&converged, linearisation) {
            (None, Linearisation::Opening) => self.flow.about_to_flow(&trial),
            _ => None,
        };
        let flows_on = about_to_flow.is_some();
        let point = converged.or(about_to_flow).unwrap_or_else(|| self.flow.elastic(&trial));
        let ratio = point.flow.as_ref().map_or(0.0, |flow| flow.ratio);
        let base = Base {
            trial: &trial,
            point: &point,
            trial_cofactor: trial.isochoric.cofactor(),
            cofactor: point.isochoric.cofactor(),
            force: point.isochoric.cofactor() * point.deviator,
            intact: 1.0 - omega,
        };
        let force = self.isochoric_force(&point) * trial.old_inverse.transpose();
        out.stress_alpha.force = force.full() * (-omega_rate * trial.scale * self.parameters.shear_modulus);
        out.stress_alpha.couple = trial.wryness.couple(ratio) * -omega_rate;
        out.micropolar.coupled = point.flow.is_some();
        out.source_strain = Default::default();
        let couples = trial.wryness.couple_map(ratio);
        for &kl in T::WRYNESS {
            for &ij in T::WRYNESS {
                let modulus = base.intact * couples.coefficient(ij, kl);
                out.micropolar.couple_wryness[(component(ij.0, ij.1), component(kl.0, kl.1))] = modulus;
            }
        }
        let flowing = point.flow.as_ref().zip(self.flow.plastic());
        let solved = flowing.and_then(|(flow, plastic)| {
            let factors = self
                .flow
                .system::<T, N>(plastic, &trial, &point.isochoric, flow)
                .factorise()?;
            Some((flow, plastic, factors))
        });
        match solved {
            None => self.elastic_columns(&base, out),
            Some((flow, plastic, factors)) => {
                self.plastic_columns::<T, N, COLUMNS>(&base, flow, plastic, &factors, out)
            }
        }
        flows_on
    }

    /// The state of a step that flowed; `None` for an elastic one.
    fn converged<T: Tensor>(
        &self,
        trial: &Trial<T>,
        strain: &MicropolarStrain,
        old: &SandstoneState,
        new: &SandstoneState,
    ) -> Option<Point<T>> {
        let multiplier = new.chi - old.chi;
        if multiplier <= 0.0 {
            return None;
        }
        let end = self.trial::<T>(strain, new).ok()?;
        self.flow.rebuild(trial, &end.isochoric, &end.wryness, multiplier)
    }

    fn elastic_columns<T: Tensor>(&self, base: &Base<T>, out: &mut GradientMicropolarModuli) {
        out.micropolar.coupled = false;
        for &pair in T::STRETCH {
            let (volume, trial) = base.trial_change(pair);
            let change = Change {
                volume,
                trial: Some(trial),
                deviator: self.flow.mandel_rate(&base.point.isochoric, &trial),
                ratio: 0.0,
                multiplier: 0.0,
            };
            self.write_force(base, &change, pair, out);
        }
    }

    fn plastic_columns<T: Tensor, const N: usize, const COLUMNS: usize>(
        &self,
        base: &Base<T>,
        flow: &Flow<T>,
        plastic: &Plastic,
        factors: &Factors<N>,
        out: &mut GradientMicropolarModuli,
    ) {
        let changes = T::STRETCH.iter().map(|&pair| base.trial_change(pair));
        let solution = factors.solve(&right_sides::<T, N, COLUMNS>(&self.flow, base, flow, plastic, changes));
        let change_of = |column: usize, volume, trial| {
            let mut deviator = T::identity() * 0.0;
            for (&pair, row) in T::DEVIATOR.iter().zip(&solution) {
                deviator = deviator + deviatoric_unit::<T>(pair) * row[column];
            }
            let ratio = solution[N - 1][column];
            let shear = flow.shear_by_deviator(&deviator) + flow.shear_by_ratio() * ratio;
            Change {
                volume,
                trial,
                deviator,
                ratio,
                multiplier: (flow.ratio * shear + flow.shear * ratio) / 1.5,
            }
        };
        let couple_by_ratio = base.trial.wryness.couple_by_ratio(flow.ratio) * base.intact;
        for (column, &(k, l)) in T::STRETCH.iter().enumerate() {
            let (volume, trial) = base.trial_change((k, l));
            let change = change_of(column, volume, Some(trial));
            self.write_force(base, &change, (k, l), out);
            for &(i, j) in T::WRYNESS {
                out.micropolar.couple_stretch[(component(i, j), component(k, l))] =
                    couple_by_ratio[(i, j)] * change.ratio;
            }
            out.source_strain.force[(k, l)] = -flow.dilation_rate * change.multiplier;
        }
        // A unit of f, and what each component of the wryness adds to f, to q and with it to the multiplier.
        let unit = change_of(COLUMNS - 1, 0.0, None);
        let of_unit = self.force_change(base, &unit);
        let of_multiplier = self.force_by_multiplier(base, flow);
        let shear_by_wryness = base.trial.wryness.invariant_by_wryness(flow.ratio) * (1.5 / flow.shear);
        for &(k, l) in T::WRYNESS {
            let shear = shear_by_wryness[(k, l)];
            let amount = -flow.excess_by_shear() * shear;
            let direct = flow.ratio * shear / 1.5;
            let force = of_unit * amount + of_multiplier * direct;
            for &(i, j) in T::STRETCH {
                out.micropolar.force_wryness[(component(i, j), component(k, l))] = force.at((i, j));
            }
            for &(i, j) in T::WRYNESS {
                out.micropolar.couple_wryness[(component(i, j), component(k, l))] +=
                    couple_by_ratio[(i, j)] * unit.ratio * amount;
            }
            out.source_strain.couple[(k, l)] = -flow.dilation_rate * (unit.multiplier * amount + direct);
        }
    }

    fn write_force<T: Tensor>(
        &self,
        base: &Base<T>,
        change: &Change<T>,
        (k, l): Pair,
        out: &mut GradientMicropolarModuli,
    ) {
        let force = self.force_change(base, change);
        for &(i, j) in T::STRETCH {
            out.micropolar.force_stretch[(component(i, j), component(k, l))] = force.at((i, j));
        }
    }

    /// Change of `B` with the multiplier at fixed `S` and `y`: through the volume alone.
    fn force_by_multiplier<T: Tensor>(&self, base: &Base<T>, flow: &Flow<T>) -> T {
        let trial = base.trial;
        let rate = -self.flow.pressure_rate(trial.volume * base.plastic_volume()) * flow.dilation_rate;
        base.trial_cofactor * trial.old_inverse.transpose() * (rate * trial.scale * self.parameters.shear_modulus)
    }

    /// `dB`.
    fn force_change<T: Tensor>(&self, base: &Base<T>, change: &Change<T>) -> T {
        let Base {
            trial,
            point,
            trial_cofactor,
            cofactor,
            force,
            intact,
        } = base;
        let third = change.volume / 3.0;
        let (exponential, exponential_change, dilation) = match &point.flow {
            None => (T::identity(), None, 0.0),
            Some(flow) => {
                let plastic = self.flow.plastic().expect("only a law with a yield surface flows");
                let exponent = flow.direction * -change.ratio - plastic.direction(&change.deviator) * flow.ratio;
                let rate = flow.exponential.rate(&exponent);
                (
                    flow.exponential.value,
                    Some(rate),
                    flow.dilation_rate * change.multiplier,
                )
            }
        };
        let pressure = self.flow.pressure_rate(trial.volume * base.plastic_volume()) * (change.volume - dilation);
        let mut inner = *trial_cofactor * (pressure - third * point.pressure);
        let mut stretch = T::identity() * 0.0;
        if let Some(moved) = &change.trial {
            inner = inner - *trial_cofactor * moved.transpose() * *trial_cofactor * point.pressure;
            stretch = *moved * exponential;
        }
        if let Some(rate) = &exponential_change {
            stretch = stretch + trial.isochoric * *rate;
        }
        let force_change = *cofactor * (change.deviator - stretch.transpose() * *force) - *force * third;
        let mut isochoric = force_change * exponential.transpose();
        if let Some(rate) = &exponential_change {
            isochoric = isochoric + *force * rate.transpose();
        }
        (inner + isochoric * *intact) * trial.old_inverse.transpose() * (trial.scale * self.parameters.shear_modulus)
    }
}

impl<T: Tensor> Base<'_, T> {
    /// `j` and `dV~` for a unit of the component `ab` of `U`.
    fn trial_change(&self, (a, b): (usize, usize)) -> (f64, T) {
        let trial = self.trial;
        let moved = T::unit((a, b)) * trial.old_inverse * trial.scale;
        // U^-T : dU = Ut^-T : dUt
        let volume = self.trial_cofactor.dot(&moved);
        (volume, moved - trial.isochoric * (volume / 3.0))
    }

    /// `J/Jt`.
    fn plastic_volume(&self) -> f64 {
        self.point.flow.as_ref().map_or(1.0, |flow| (-flow.dilation).exp())
    }
}

/// Minus the derivatives of `R` and `f` by the components of the stretch; in the last column a unit of `f`.
fn right_sides<T: Tensor, const N: usize, const COLUMNS: usize>(
    rule: &FlowRule,
    base: &Base<T>,
    flow: &Flow<T>,
    plastic: &Plastic,
    changes: impl Iterator<Item = (f64, T)>,
) -> [[f64; COLUMNS]; N] {
    let mut right = [[0.0; COLUMNS]; N];
    let volume = base.trial.volume * base.plastic_volume();
    let by_volume = plastic.friction_slope() * rule.pressure_rate(volume);
    for (column, (change, trial)) in changes.enumerate() {
        let deviator = rule.mandel_rate(&base.point.isochoric, &(trial * flow.exponential.value));
        for (row, &pair) in right.iter_mut().zip(T::DEVIATOR) {
            row[column] = deviator.at(pair);
        }
        right[N - 1][column] = -by_volume * change;
    }
    right[N - 1][COLUMNS - 1] = 1.0;
    right
}
