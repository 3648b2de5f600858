//! Points on the move: pack, exchange, unpack.

use super::Points;
use crate::continuum::{Continuum, total_length};
use crate::parallel::{Directory, World};
use nalgebra::SVector;

/// A quantity in the record of a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordPart {
    /// Name in files, such as `motion/rotation`.
    pub name: String,
    pub length: usize,
    /// Whether its numbers are the bits of whole ones.
    pub whole: bool,
}

impl<C: Continuum, const D: usize> Points<C, D> {
    /// What the record of a point consists of, in the order of [`Points::pack`].
    pub fn record_parts(&self) -> Vec<RecordPart> {
        let part = |name: &str, length, whole| RecordPart {
            name: name.to_owned(),
            length,
            whole,
        };
        let mut parts = ["id", "body", "material", "marks"]
            .map(|name| part(name, 1, true))
            .to_vec();
        let vectors = ["position", "displacement", "reference_half_lengths", "half_lengths"];
        parts.extend(vectors.map(|name| part(name, D, false)));
        parts.push(part("volume", 1, false));
        let histories = [("motion", C::MOTION), ("stress", C::STRESS)];
        for (group, variables) in histories.into_iter().filter(|_| self.histories) {
            let named = variables
                .iter()
                .map(|variable| (format!("{group}/{}", variable.name), variable.length));
            parts.extend(named.map(|(name, length)| part(&name, length, false)));
        }
        parts.push(part("state", self.state_length, false));
        parts.push(part("gaps", self.gap_count, false));
        parts.push(part("last_motion", self.last_motion_length(), false));
        parts
    }

    fn last_motion_length(&self) -> usize {
        if self.keeps_last_motion { D } else { 0 }
    }

    /// Appends everything that a point carries to a record of numbers.
    pub fn pack(&self, point: usize, record: &mut Vec<f64>) {
        let integers = [
            self.id[point],
            u64::from(self.body[point]),
            u64::from(self.material[point]),
            self.marks[point],
        ];
        record.extend(integers.map(f64::from_bits));
        for vector in [
            &self.position[point],
            &self.displacement[point],
            &self.reference_half_lengths[point],
            &self.half_lengths[point],
        ] {
            record.extend_from_slice(vector.as_slice());
        }
        record.push(self.volume[point]);
        if self.histories {
            let start = record.len();
            record.resize(start + total_length(C::MOTION) + total_length(C::STRESS), 0.0);
            let (motion, stress) = record[start..].split_at_mut(total_length(C::MOTION));
            C::pack_motion(&self.motion[point], motion);
            C::pack_stress(&self.stress[point], stress);
        }
        record.extend_from_slice(self.state_of(point));
        record.extend_from_slice(&self.gaps[point * self.gap_count..][..self.gap_count]);
        if self.keeps_last_motion {
            record.extend_from_slice(self.last_motion[point].as_slice());
        }
    }

    /// Appends the points of a sequence of records.
    pub fn unpack(&mut self, records: &[f64]) {
        let length = self.record_parts().iter().map(|part| part.length).sum();
        for record in records.chunks_exact(length) {
            let (integers, rest) = record.split_at(4);
            self.id.push(integers[0].to_bits());
            self.body.push(integers[1].to_bits() as u32);
            self.material.push(integers[2].to_bits() as u32);
            self.marks.push(integers[3].to_bits());
            let (vectors, rest) = rest.split_at(4 * D);
            let vector = |k: usize| SVector::from_column_slice(&vectors[k * D..(k + 1) * D]);
            self.position.push(vector(0));
            self.displacement.push(vector(1));
            self.reference_half_lengths.push(vector(2));
            self.half_lengths.push(vector(3));
            self.volume.push(rest[0]);
            let mut rest = &rest[1..];
            if self.histories {
                let (motion, later) = rest.split_at(total_length(C::MOTION));
                let (stress, later) = later.split_at(total_length(C::STRESS));
                self.motion.push(C::unpack_motion(motion));
                self.stress.push(C::unpack_stress(stress));
                rest = later;
            }
            let (state, rest) = rest.split_at(self.state_length);
            let (gaps, last_motion) = rest.split_at(self.gap_count);
            self.state.extend_from_slice(state);
            self.gaps.extend_from_slice(gaps);
            if self.keeps_last_motion {
                self.last_motion.push(SVector::from_column_slice(last_motion));
            }
        }
        self.reset_trial();
    }

    /// Collective. Sends each point to the rank given for it.
    pub fn send(&mut self, world: &World, destination: &[usize]) {
        let leaving = destination.iter().any(|&rank| rank != world.rank());
        if !world.any(leaving) {
            return;
        }
        let mut outgoing = vec![Vec::new(); world.size()];
        for (point, &rank) in destination.iter().enumerate() {
            if rank != world.rank() {
                self.pack(point, &mut outgoing[rank]);
            }
        }
        let staying: Vec<usize> = (0..self.len())
            .filter(|&point| destination[point] == world.rank())
            .collect();
        self.reorder(&staying);
        for records in world.exchange(&outgoing) {
            self.unpack(&records);
        }
    }

    /// Collective. Brings all points of a cell to one rank: to the one that holds most of them. `cells` gives the
    /// cell of each point.
    pub fn gather_cells(&mut self, world: &World, cells: &[u64]) {
        if world.size() == 1 {
            return;
        }
        let counts = count_points(cells);
        let directory = Directory::build(world, counts.iter().copied());
        let keys: Vec<u64> = counts.iter().map(|&(cell, _)| cell).collect();
        let owners = directory.owners(world, &keys);
        let destination: Vec<usize> = cells
            .iter()
            .map(|cell| {
                let position = keys.binary_search(cell).expect("every point's cell was counted");
                owners[position].expect("counted cells were claimed")
            })
            .collect();
        self.send(world, &destination);
    }
}

/// Cells with the number of points in each, sorted by cell.
pub fn count_points(cells: &[u64]) -> Vec<(u64, u64)> {
    let mut sorted = cells.to_vec();
    sorted.sort_unstable();
    sorted
        .chunk_by(|a, b| a == b)
        .map(|run| (run[0], run.len() as u64))
        .collect()
}
