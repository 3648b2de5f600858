//! The body: material points, as arrays of what each of them carries.

pub mod elements;
pub mod migrate;
pub mod placement;
pub mod search;
pub mod seed;
pub mod select;

use crate::continuum::Continuum;
use nalgebra::SVector;

/// The material points of one rank. Entry `p` of every array belongs to the same point.
///
/// `motion`, `stress` and `state` are accepted; `trial_stress` and `trial_state` are scratch of the step in progress
/// and become the accepted ones by a swap. Nothing else changes before a step is accepted.
#[derive(Clone, Debug)]
pub struct Points<C: Continuum, const D: usize> {
    /// Number of the point in the order of seeding, the same on any number of ranks.
    pub id: Vec<u64>,
    pub body: Vec<u32>,
    /// Index into the list of laws.
    pub material: Vec<u32>,
    /// Bit `s` is set where the point belongs to selection `s`.
    pub marks: Vec<u64>,
    pub position: Vec<SVector<f64, D>>,
    /// Displacement since the initial state [m].
    pub displacement: Vec<SVector<f64, D>>,
    /// Reference volume [m3], per metre of thickness in the plane.
    pub volume: Vec<f64>,
    /// Half-lengths of the reference domain [m].
    pub reference_half_lengths: Vec<SVector<f64, D>>,
    pub half_lengths: Vec<SVector<f64, D>>,
    /// Whether the points have motion, stress and state: a check does without, and they take most of the memory.
    pub histories: bool,
    pub motion: Vec<C::Motion>,
    pub stress: Vec<C::Stress>,
    /// State of the law, `state_length` numbers a point.
    pub state: Vec<f64>,
    pub state_length: usize,
    /// Gaps of the springs that tie the point to platens [m, rad], `gap_count` numbers a point.
    pub gaps: Vec<f64>,
    pub gap_count: usize,
    /// Displacement in the last accepted step [m], where `keeps_last_motion`.
    pub last_motion: Vec<SVector<f64, D>>,
    pub keeps_last_motion: bool,
    pub trial_stress: Vec<C::Stress>,
    pub trial_state: Vec<f64>,
}

impl<C: Continuum, const D: usize> Points<C, D> {
    /// No points; those to come have histories with states of this length.
    pub fn empty(state_length: usize) -> Self {
        Self {
            histories: true,
            state_length,
            ..Self::without_histories()
        }
    }

    /// No points; those to come are places without histories.
    pub fn without_histories() -> Self {
        Self {
            id: Vec::new(),
            body: Vec::new(),
            material: Vec::new(),
            marks: Vec::new(),
            position: Vec::new(),
            displacement: Vec::new(),
            volume: Vec::new(),
            reference_half_lengths: Vec::new(),
            half_lengths: Vec::new(),
            histories: false,
            motion: Vec::new(),
            stress: Vec::new(),
            state: Vec::new(),
            state_length: 0,
            gaps: Vec::new(),
            gap_count: 0,
            last_motion: Vec::new(),
            keeps_last_motion: false,
            trial_stress: Vec::new(),
            trial_state: Vec::new(),
        }
    }

    pub fn len(&self) -> usize {
        self.id.len()
    }

    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Gives points without histories those of the initial state; `virgin` writes the state of a material, by its index.
    pub fn start_histories(&mut self, state_length: usize, virgin: impl Fn(usize, &mut [f64])) {
        self.histories = true;
        self.state_length = state_length;
        self.motion = vec![C::Motion::default(); self.len()];
        self.stress = vec![C::Stress::default(); self.len()];
        self.state = vec![0.0; state_length * self.len()];
        if state_length > 0 {
            let states = self.state.chunks_exact_mut(state_length);
            for (&material, state) in self.material.iter().zip(states) {
                virgin(material as usize, state);
            }
        }
        self.reset_trial();
    }

    /// Where a point was in the initial state; the third component is zero in plane strain.
    pub fn reference_position(&self, point: usize) -> [f64; 3] {
        select::in_space(&(self.position[point] - self.displacement[point]))
    }

    /// Accepted state of a point's law.
    pub fn state_of(&self, point: usize) -> &[f64] {
        &self.state[point * self.state_length..(point + 1) * self.state_length]
    }

    /// Puts the points into the order given: entry `i` of the result is point `order[i]`.
    pub fn reorder(&mut self, order: &[usize]) {
        fn permute<T: Clone>(values: &mut Vec<T>, order: &[usize]) {
            *values = order.iter().map(|&from| values[from].clone()).collect();
        }
        fn permute_rows(values: &mut Vec<f64>, width: usize, order: &[usize]) {
            let mut ordered = Vec::with_capacity(width * order.len());
            for &from in order {
                ordered.extend_from_slice(&values[from * width..(from + 1) * width]);
            }
            *values = ordered;
        }
        permute(&mut self.id, order);
        permute(&mut self.body, order);
        permute(&mut self.material, order);
        permute(&mut self.marks, order);
        permute(&mut self.position, order);
        permute(&mut self.displacement, order);
        permute(&mut self.volume, order);
        permute(&mut self.reference_half_lengths, order);
        permute(&mut self.half_lengths, order);
        if self.histories {
            permute(&mut self.motion, order);
            permute(&mut self.stress, order);
        }
        permute_rows(&mut self.state, self.state_length, order);
        permute_rows(&mut self.gaps, self.gap_count, order);
        if self.keeps_last_motion {
            permute(&mut self.last_motion, order);
        }
        self.reset_trial();
    }

    /// Gives every point room for this many gaps, all closed.
    pub fn keep_gaps(&mut self, count: usize) {
        self.gap_count = count;
        self.gaps = vec![0.0; count * self.len()];
    }

    /// Gives every point room for its motion in the last step, none so far.
    pub fn keep_last_motion(&mut self) {
        self.keeps_last_motion = true;
        self.last_motion = vec![SVector::zeros(); self.len()];
    }

    /// Makes the scratch arrays as long as the accepted ones.
    pub fn reset_trial(&mut self) {
        self.trial_stress.resize(self.stress.len(), C::Stress::default());
        self.trial_state.resize(self.state.len(), 0.0);
    }

    /// Makes the trial stresses and states the accepted ones.
    pub fn accept_trial(&mut self) {
        std::mem::swap(&mut self.stress, &mut self.trial_stress);
        std::mem::swap(&mut self.state, &mut self.trial_state);
    }
}
