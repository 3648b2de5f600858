//! One, two, three and four ranks give the same history.

use super::scenes;
use crate::common::compare::{same_history, same_path};
use crate::common::launch::{Launch, Run};

/// Of the largest magnitude of a column.
const TOLERANCE: f64 = 1e-8;

fn ranks_agree(scene: fn() -> Launch, counts: &[usize]) {
    let alone = scene().run().completed();
    for &ranks in counts {
        let together = scene().ranks(ranks).run().completed();
        assert_eq!(together.summary().count("ranks"), ranks);
        same_history(
            &format!("{ranks} ranks and one"),
            &together.history(),
            &alone.history(),
            TOLERANCE,
        );
        same_counts(&together, &alone);
    }
}

/// What does not depend on how the work is shared.
fn same_counts(together: &Run, alone: &Run) {
    let (together, alone) = (together.summary(), alone.summary());
    for key in ["points", "active_cells", "dofs", "nonzeros", "steps", "attempts"] {
        assert_eq!(together.count(key), alone.count(key), "{key}");
    }
}

#[test]
fn on_the_shear_layer() {
    ranks_agree(scenes::shear_layer, &[2, 3, 4]);
}

#[test]
fn on_the_curved_cantilever() {
    ranks_agree(scenes::curved_cantilever, &[2, 3, 4]);
}

#[test]
fn on_finite_elements() {
    ranks_agree(scenes::elements, &[2, 3]);
}

#[test]
fn on_a_yielding_block_with_ghost_penalty() {
    ranks_agree(scenes::block, &[2, 3, 4]);
}

#[test]
fn on_splines() {
    ranks_agree(scenes::block_on_splines, &[2, 3]);
    ranks_agree(scenes::sliding_block_on_splines, &[2, 3]);
}

#[test]
fn on_sandstone_with_damage() {
    ranks_agree(scenes::sandstone, &[2, 3]);
}

#[test]
fn on_a_collapsing_classical_block() {
    ranks_agree(scenes::collapsing_block, &[2, 3]);
}

#[test]
fn on_a_path_beyond_its_limit_point() {
    let alone = scenes::softening_column().run().completed();
    let factors = alone.history().column("load_factor");
    assert!(
        factors.windows(2).any(|pair| pair[1] < pair[0]),
        "the load does not fall: {factors:?}"
    );
    for ranks in [2, 3] {
        let together = scenes::softening_column().ranks(ranks).run().completed();
        let title = format!("{ranks} ranks and one");
        same_path(&title, &together.history(), &alone.history(), TOLERANCE);
        same_counts(&together, &alone);
    }
}

#[test]
fn where_ranks_have_no_points() {
    ranks_agree(scenes::one_cell, &[2, 3]);
}
