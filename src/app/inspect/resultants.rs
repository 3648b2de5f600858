//! What loads do on rigid motions: where that is not nothing and no support prevents the motion, there is no equilibrium.

use super::Inspection;
use super::supports::Outline;
use crate::assembly::pieces::Pieces;
use crate::condition::pressure::Pressure;
use crate::continuum::Fields;
use crate::points::select::in_space;

/// Work of forces on unit motions of each piece, and the sum of the magnitudes of what it is made of.
pub struct Resultants {
    work: Vec<Vec<f64>>,
    magnitude: Vec<f64>,
}

/// Work below this share of its parts is round-off: the forces balance each other.
const BALANCED: f64 = 1.0e-9;

impl Resultants {
    /// Collective. Of the loads at full size that act over these stages.
    pub fn of<C: Fields<D, N>, const D: usize, const N: usize>(
        inspection: &Inspection<'_, C, D, N>,
        pieces: &Pieces,
        outlines: &[Outline],
        acts: impl Fn(usize) -> bool,
    ) -> Self {
        let mut resultants = Self {
            work: outlines
                .iter()
                .map(|outline| vec![0.0; outline.motions.count()])
                .collect(),
            magnitude: vec![0.0; outlines.len()],
        };
        resultants.add_dead_loads(inspection, pieces, outlines, &acts);
        resultants.add_face_loads(inspection, pieces, outlines, &acts);
        for pressure in inspection
            .model
            .surface
            .pressures
            .iter()
            .filter(|pressure| acts(pressure.stage))
        {
            resultants.add_pressure(inspection, pieces, outlines, pressure);
        }
        inspection.world.sum_slice(&mut resultants.magnitude);
        let mut all = resultants.work.concat();
        inspection.world.sum_slice(&mut all);
        let mut rest = all.into_iter();
        let work = resultants.work.iter_mut().flatten();
        work.for_each(|entry| *entry = rest.next().expect("as many as were summed"));
        resultants
    }

    /// Whether the forces on a piece do work on a motion of it.
    pub fn drive(&self, piece: usize, motion: &[f64]) -> bool {
        let work: f64 = self.work[piece]
            .iter()
            .zip(motion)
            .map(|(work, motion)| work * motion)
            .sum();
        work.abs() > BALANCED * self.magnitude[piece]
    }

    /// Adds the force, by unknown, that acts on a piece at a position.
    fn add<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        piece: usize,
        outline: &Outline,
        position: &[f64; 3],
        force: &[f64],
    ) {
        for (component, &force) in force.iter().enumerate().filter(|&(_, &force)| force != 0.0) {
            let Some(row) = outline.motions.row(&C::KIND, component, position) else {
                continue;
            };
            for (work, motion) in self.work[piece].iter_mut().zip(&row) {
                *work += force * motion;
            }
            self.magnitude[piece] += force.abs();
        }
    }

    fn add_dead_loads<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        inspection: &Inspection<'_, C, D, N>,
        pieces: &Pieces,
        outlines: &[Outline],
        acts: &impl Fn(usize) -> bool,
    ) {
        let points = &inspection.model.points;
        for load in inspection.model.loads.iter().filter(|load| acts(load.stage)) {
            let carried = |&p: &usize| load.bit.is_none_or(|bit| points.marks[p] >> bit & 1 == 1);
            for p in (0..points.len()).filter(carried) {
                let piece = pieces.of_point[p];
                let position = in_space(&points.position[p]);
                self.add::<C, D, N>(piece, &outlines[piece], &position, &load.amount.at(points, p));
            }
        }
    }

    fn add_face_loads<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        inspection: &Inspection<'_, C, D, N>,
        pieces: &Pieces,
        outlines: &[Outline],
        acts: &impl Fn(usize) -> bool,
    ) {
        let (nodes, own) = (inspection.model.initial_nodes(), inspection.survey.nodes.own());
        for load in inspection.model.face_loads.iter().filter(|load| acts(load.stage)) {
            for (key, share) in &load.shares {
                let Ok(node) = own.binary_search(key) else { continue };
                let piece = pieces.of_own_node[node];
                let force: Vec<_> = load.total.iter().map(|total| share * total).collect();
                let position = nodes.position(&nodes.indices(*key));
                self.add::<C, D, N>(piece, &outlines[piece], &position, &force);
            }
        }
    }

    fn add_pressure<C: Fields<D, N>, const D: usize, const N: usize>(
        &mut self,
        inspection: &Inspection<'_, C, D, N>,
        pieces: &Pieces,
        outlines: &[Outline],
        pressure: &Pressure,
    ) {
        let points = &inspection.model.points;
        for patch in &pressure.patches {
            for p in (0..points.len()).filter(|&p| points.marks[p] >> patch.bit & 1 == 1) {
                let piece = pieces.of_point[p];
                let mut position = in_space(&points.position[p]);
                let offset = patch.side.offset(points, p);
                (0..D).for_each(|k| position[k] += offset[k]);
                let force = patch.side.area(points, p) * -pressure.pressure;
                self.add::<C, D, N>(piece, &outlines[piece], &position, &force.as_slice()[..D]);
            }
        }
    }
}
