//! The ghost penalty in residual and tangent: it acts on the increments of the step.

use super::{Sink, active::Active};
use crate::continuum::UnknownKind;
use crate::grid::ghost::{GhostFaces, GhostScaling, GhostSettings};

/// Coefficients of the penalty for each unknown of a node.
pub struct GhostPenalty {
    scaling: GhostScaling,
    coefficients: Vec<f64>,
}

impl GhostPenalty {
    /// `kinds` tells what each unknown of a node is. A nonlocal damage field needs no penalty: its own equation holds it
    /// wherever there is material.
    pub fn new(settings: &GhostSettings, kinds: &[UnknownKind]) -> Self {
        let coefficient = |kind: &UnknownKind| match kind {
            UnknownKind::Translation => settings.translation,
            UnknownKind::Rotation => settings.rotation,
            UnknownKind::Damage => 0.0,
        };
        Self {
            scaling: settings.scaling,
            coefficients: kinds.iter().map(coefficient).collect(),
        }
    }

    /// How the matrices of the faces scale with the size of cells.
    pub fn scaling(&self) -> GhostScaling {
        self.scaling
    }

    /// Adds the forces of the penalty for local increments `u`.
    pub fn add_forces<const D: usize>(&self, faces: &GhostFaces<D>, active: &Active, u: &[f64], forces: &mut [f64]) {
        let unknowns = self.coefficients.len();
        for (index, face) in faces.faces.iter().enumerate() {
            let nodes = active.face_nodes(index);
            for (&row, stiffness) in nodes.iter().zip(faces.matrices[face.matrix].chunks_exact(nodes.len())) {
                for (&column, stiffness) in nodes.iter().zip(stiffness) {
                    for (a, coefficient) in self.coefficients.iter().enumerate() {
                        forces[row as usize * unknowns + a] +=
                            coefficient * stiffness * u[column as usize * unknowns + a];
                    }
                }
            }
        }
    }

    /// Adds to local unknowns the squares of the forces [N2, N2 m2] that increments of one [m, rad] would make.
    pub fn add_squares<const D: usize>(&self, faces: &GhostFaces<D>, active: &Active, squares: &mut [f64]) {
        let unknowns = self.coefficients.len();
        for (index, face) in faces.faces.iter().enumerate() {
            let nodes = active.face_nodes(index);
            for (&row, stiffness) in nodes.iter().zip(faces.matrices[face.matrix].chunks_exact(nodes.len())) {
                let sum: f64 = stiffness.iter().map(|entry| entry.abs()).sum();
                for (a, coefficient) in self.coefficients.iter().enumerate() {
                    squares[row as usize * unknowns + a] += (coefficient * sum).powi(2);
                }
            }
        }
    }

    /// Adds the stiffness of the penalty.
    pub fn add_stiffness<const D: usize>(&self, faces: &GhostFaces<D>, active: &Active, sink: &mut impl Sink) {
        let blocks: Vec<Vec<f64>> = faces.matrices.iter().map(|matrix| self.block(matrix)).collect();
        for (index, face) in faces.faces.iter().enumerate() {
            sink.add(active.face_nodes(index), &blocks[face.matrix]);
        }
    }

    /// The scalar matrix of a face, spread over the unknowns.
    fn block(&self, matrix: &[f64]) -> Vec<f64> {
        let unknowns = self.coefficients.len();
        let nodes = matrix.len().isqrt();
        let width = nodes * unknowns;
        let mut block = vec![0.0; width * width];
        for row in 0..nodes {
            for column in 0..nodes {
                for (a, coefficient) in self.coefficients.iter().enumerate() {
                    block[(row * unknowns + a) * width + column * unknowns + a] =
                        coefficient * matrix[row * nodes + column];
                }
            }
        }
        block
    }
}
