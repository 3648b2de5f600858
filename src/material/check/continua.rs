//! What the checks must know of each continuum: changes of a strain, and what moduli say of them.

use super::{Random, driven};
use crate::continuum::classical::{Classical, ClassicalModuli, ClassicalStrain, ClassicalStress};
use crate::continuum::gradient_micropolar::{
    GradientMicropolar, GradientMicropolarModuli, GradientMicropolarStrain, GradientMicropolarStress,
};
use crate::continuum::micropolar::{Micropolar, MicropolarModuli, MicropolarStrain, MicropolarStress};
use crate::continuum::tensor::{SYMMETRIC_PAIRS, component, symmetric, symmetric_component};
use crate::material::Components;
use crate::material::active::Pair;
use crate::material::driver::{Deformation, Driven};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// A continuum whose laws can be checked.
pub trait Checked: Driven {
    /// A change of a strain.
    type Change: Copy;

    /// A change in the components that a motion can change, of the size of one, wryness and gradients times the length.
    fn change(random: &mut Random, components: Components, length: f64) -> Self::Change;
    /// The strain after a multiple of a change.
    fn moved(strain: &Self::Strain, change: &Self::Change, amount: f64) -> Self::Strain;
    /// Change of the stress by the moduli, in the components that do work.
    fn predicted(
        moduli: &Self::Moduli,
        stress: &Self::Stress,
        components: Components,
        change: &Self::Change,
    ) -> Self::Stress;
    /// The components of a stress that do work: first those with its units, couples over the length, then pure numbers.
    fn parts(stress: &Self::Stress, components: Components, length: f64) -> Vec<Vec<f64>>;
    /// All of a stress, whether it does work or not.
    fn all_of(stress: &Self::Stress) -> Vec<f64>;
    /// A stress full of one number.
    fn dirty_stress(dirt: f64) -> Self::Stress;
    /// Moduli full of one number.
    fn dirty_moduli(dirt: f64) -> Self::Moduli;
    /// The entries of moduli that are read.
    fn active(moduli: &Self::Moduli, components: Components) -> Vec<f64>;
    /// Strains with this number in one place, for every place.
    fn broken(number: f64) -> Vec<Self::Strain>;
    /// A deformation with this strain and no micro-rotation.
    fn deformation(strain: &Self::Strain) -> Deformation;
}

/// Places of a symmetric tensor that do work.
fn working(components: Components) -> &'static [usize] {
    match components {
        Components::Plane => &[0, 1, 3],
        Components::Space => &[0, 1, 2, 3, 4, 5],
    }
}

/// The strain is the deformation gradient `F`; a change `l` makes it `(I + l) F`.
impl Checked for Classical {
    type Change = Matrix3<f64>;

    fn change(random: &mut Random, components: Components, _length: f64) -> Matrix3<f64> {
        random.tensor(driven(components).0)
    }

    fn moved(strain: &ClassicalStrain, change: &Matrix3<f64>, amount: f64) -> ClassicalStrain {
        ClassicalStrain {
            deformation_gradient: (Matrix3::identity() + change * amount) * strain.deformation_gradient,
        }
    }

    /// `C : d + w tau - tau w`. Entries of `C` across the plane are not read.
    fn predicted(
        moduli: &ClassicalModuli,
        stress: &ClassicalStress,
        components: Components,
        change: &Matrix3<f64>,
    ) -> ClassicalStress {
        let (d, w) = (symmetric(change), (change - change.transpose()) * 0.5);
        let mut kirchhoff = w * stress.kirchhoff - stress.kirchhoff * w;
        for &row in working(components) {
            let (i, j) = SYMMETRIC_PAIRS[row];
            let sum: f64 = (0..9)
                .map(|kl| (symmetric_component(kl / 3, kl % 3), d[(kl / 3, kl % 3)]))
                .filter(|(column, _)| working(components).contains(column))
                .map(|(column, stretching)| moduli.corotational[row][column] * stretching)
                .sum();
            kirchhoff[(i, j)] += sum;
            if i != j {
                kirchhoff[(j, i)] += sum;
            }
        }
        ClassicalStress { kirchhoff }
    }

    fn parts(stress: &ClassicalStress, components: Components, _length: f64) -> Vec<Vec<f64>> {
        let (pairs, _) = driven(components);
        vec![pairs.iter().map(|&pair| stress.kirchhoff[pair]).collect()]
    }

    fn all_of(stress: &ClassicalStress) -> Vec<f64> {
        stress.kirchhoff.iter().copied().collect()
    }

    fn dirty_stress(dirt: f64) -> ClassicalStress {
        ClassicalStress {
            kirchhoff: Matrix3::from_element(dirt),
        }
    }

    fn dirty_moduli(dirt: f64) -> ClassicalModuli {
        ClassicalModuli {
            corotational: [[dirt; 6]; 6],
        }
    }

    fn active(moduli: &ClassicalModuli, components: Components) -> Vec<f64> {
        let places = working(components);
        let row = |&row: &usize| places.iter().map(move |&column| moduli.corotational[row][column]);
        places.iter().flat_map(row).collect()
    }

    fn broken(number: f64) -> Vec<ClassicalStrain> {
        let broken = |place| {
            let mut strain = ClassicalStrain::default();
            strain.deformation_gradient[place] = number;
            strain
        };
        (0..9).map(broken).collect()
    }

    fn deformation(strain: &ClassicalStrain) -> Deformation {
        Deformation {
            gradient: strain.deformation_gradient,
            ..Deformation::default()
        }
    }
}

fn product(block: &SMatrix<f64, 9, 9>, rows: &[Pair], columns: &[Pair], by: &Matrix3<f64>, out: &mut Matrix3<f64>) {
    let at = |pair: Pair| component(pair.0, pair.1);
    for &row in rows {
        for &column in columns {
            out[row] += block[(at(row), at(column))] * by[column];
        }
    }
}

impl Checked for Micropolar {
    type Change = MicropolarStrain;

    fn change(random: &mut Random, components: Components, length: f64) -> MicropolarStrain {
        let (stretches, wrynesses) = driven(components);
        MicropolarStrain {
            stretch: random.tensor(stretches),
            wryness: random.tensor(wrynesses) / length,
        }
    }

    fn moved(strain: &MicropolarStrain, change: &MicropolarStrain, amount: f64) -> MicropolarStrain {
        MicropolarStrain {
            stretch: strain.stretch + change.stretch * amount,
            wryness: strain.wryness + change.wryness * amount,
        }
    }

    fn predicted(
        moduli: &MicropolarModuli,
        _stress: &MicropolarStress,
        components: Components,
        change: &MicropolarStrain,
    ) -> MicropolarStress {
        let (stretches, wrynesses) = driven(components);
        let MicropolarStrain { stretch, wryness } = change;
        let mut out = MicropolarStress::default();
        product(&moduli.force_stretch, stretches, stretches, stretch, &mut out.force);
        product(&moduli.couple_wryness, wrynesses, wrynesses, wryness, &mut out.couple);
        if moduli.coupled {
            product(&moduli.force_wryness, stretches, wrynesses, wryness, &mut out.force);
            product(&moduli.couple_stretch, wrynesses, stretches, stretch, &mut out.couple);
        }
        out
    }

    fn parts(stress: &MicropolarStress, components: Components, length: f64) -> Vec<Vec<f64>> {
        let (stretches, wrynesses) = driven(components);
        let force = stretches.iter().map(|&pair| stress.force[pair]);
        let couple = wrynesses.iter().map(|&pair| stress.couple[pair] / length);
        vec![force.chain(couple).collect()]
    }

    fn all_of(stress: &MicropolarStress) -> Vec<f64> {
        stress.force.iter().chain(&stress.couple).copied().collect()
    }

    fn dirty_stress(dirt: f64) -> MicropolarStress {
        MicropolarStress {
            force: Matrix3::from_element(dirt),
            couple: Matrix3::from_element(dirt),
        }
    }

    fn dirty_moduli(dirt: f64) -> MicropolarModuli {
        let block = SMatrix::from_element(dirt);
        MicropolarModuli {
            force_stretch: block,
            force_wryness: block,
            couple_stretch: block,
            couple_wryness: block,
            coupled: dirt != 0.0,
        }
    }

    fn active(moduli: &MicropolarModuli, components: Components) -> Vec<f64> {
        let (stretches, wrynesses) = driven(components);
        let mut entries = vec![f64::from(u8::from(moduli.coupled))];
        let mut add = |block: &SMatrix<f64, 9, 9>, rows: &[Pair], columns: &[Pair]| {
            for &(i, j) in rows {
                entries.extend(columns.iter().map(|&(k, l)| block[(component(i, j), component(k, l))]));
            }
        };
        add(&moduli.force_stretch, stretches, stretches);
        add(&moduli.couple_wryness, wrynesses, wrynesses);
        if moduli.coupled {
            add(&moduli.force_wryness, stretches, wrynesses);
            add(&moduli.couple_stretch, wrynesses, stretches);
        }
        entries
    }

    fn broken(number: f64) -> Vec<MicropolarStrain> {
        let broken = |place: usize| {
            let mut strain = MicropolarStrain::default();
            match place {
                0..9 => strain.stretch[place] = number,
                _ => strain.wryness[place - 9] = number,
            }
            strain
        };
        (0..18).map(broken).collect()
    }

    fn deformation(strain: &MicropolarStrain) -> Deformation {
        Deformation {
            gradient: strain.stretch,
            wryness: strain.wryness,
            ..Deformation::default()
        }
    }
}

impl Checked for GradientMicropolar {
    type Change = GradientMicropolarStrain;

    fn change(random: &mut Random, components: Components, length: f64) -> GradientMicropolarStrain {
        GradientMicropolarStrain {
            micropolar: Micropolar::change(random, components, length),
            alpha: random.number(),
            alpha_gradient: Vector3::from_fn(|_, _| random.number()) / length,
        }
    }

    fn moved(
        strain: &GradientMicropolarStrain,
        change: &GradientMicropolarStrain,
        amount: f64,
    ) -> GradientMicropolarStrain {
        GradientMicropolarStrain {
            micropolar: Micropolar::moved(&strain.micropolar, &change.micropolar, amount),
            alpha: strain.alpha + change.alpha * amount,
            alpha_gradient: strain.alpha_gradient + change.alpha_gradient * amount,
        }
    }

    fn predicted(
        moduli: &GradientMicropolarModuli,
        stress: &GradientMicropolarStress,
        components: Components,
        change: &GradientMicropolarStrain,
    ) -> GradientMicropolarStress {
        let MicropolarStrain { stretch, wryness } = change.micropolar;
        let mut micropolar =
            Micropolar::predicted(&moduli.micropolar, &stress.micropolar, components, &change.micropolar);
        micropolar.force += moduli.stress_alpha.force * change.alpha;
        micropolar.couple += moduli.stress_alpha.couple * change.alpha;
        let (stretches, wrynesses) = driven(components);
        let by_stretch = stretches
            .iter()
            .map(|&pair| moduli.source_strain.force[pair] * stretch[pair]);
        let by_wryness = wrynesses
            .iter()
            .map(|&pair| moduli.source_strain.couple[pair] * wryness[pair]);
        GradientMicropolarStress {
            micropolar,
            source: by_stretch.chain(by_wryness).sum::<f64>() + moduli.source_alpha * change.alpha,
            flux: change.alpha_gradient * moduli.flux_gradient,
        }
    }

    fn parts(stress: &GradientMicropolarStress, components: Components, length: f64) -> Vec<Vec<f64>> {
        let mut parts = Micropolar::parts(&stress.micropolar, components, length);
        parts.push(vec![stress.source]);
        parts.push(stress.flux.iter().map(|flux| flux / length).collect());
        parts
    }

    fn all_of(stress: &GradientMicropolarStress) -> Vec<f64> {
        let mut all = Micropolar::all_of(&stress.micropolar);
        all.push(stress.source);
        all.extend(&stress.flux);
        all
    }

    fn dirty_stress(dirt: f64) -> GradientMicropolarStress {
        GradientMicropolarStress {
            micropolar: Micropolar::dirty_stress(dirt),
            source: dirt,
            flux: Vector3::repeat(dirt),
        }
    }

    fn dirty_moduli(dirt: f64) -> GradientMicropolarModuli {
        GradientMicropolarModuli {
            micropolar: Micropolar::dirty_moduli(dirt),
            stress_alpha: Micropolar::dirty_stress(dirt),
            source_strain: Micropolar::dirty_stress(dirt),
            source_alpha: dirt,
            flux_gradient: dirt,
        }
    }

    fn active(moduli: &GradientMicropolarModuli, components: Components) -> Vec<f64> {
        let mut entries = Micropolar::active(&moduli.micropolar, components);
        for stress in [&moduli.stress_alpha, &moduli.source_strain] {
            entries.extend(Micropolar::parts(stress, components, 1.0).concat());
        }
        entries.extend([moduli.source_alpha, moduli.flux_gradient]);
        entries
    }

    fn broken(number: f64) -> Vec<GradientMicropolarStrain> {
        let strain = GradientMicropolarStrain::default();
        let mut strains: Vec<_> = Micropolar::broken(number)
            .into_iter()
            .map(|micropolar| GradientMicropolarStrain { micropolar, ..strain })
            .collect();
        strains.push(GradientMicropolarStrain {
            alpha: number,
            ..strain
        });
        strains.push(GradientMicropolarStrain {
            alpha_gradient: Vector3::new(0.0, number, 0.0),
            ..strain
        });
        strains
    }

    fn deformation(strain: &GradientMicropolarStrain) -> Deformation {
        Deformation {
            alpha: strain.alpha,
            ..Micropolar::deformation(&strain.micropolar)
        }
    }
}
