//! Points that change cells change ranks, and the work stays shared.

use super::scenes;
use crate::common::compare::same_history;
use crate::common::snapshots::Snapshots;

fn points_of(ranks: &[usize], rank: usize) -> usize {
    ranks.iter().filter(|&&own| own == rank).count()
}

#[test]
fn a_sliding_body_gives_the_same_history_while_its_points_change_ranks() {
    let alone = scenes::sliding_block().run().completed();
    let travelled = alone.history().last("place_x") - alone.history().column("place_x")[0];
    assert!(travelled > 0.06, "the body slides by six cells, not by {travelled} m");
    for count in [2, 3] {
        let together = scenes::sliding_block().ranks(count).run().completed();
        same_history(
            &format!("{count} ranks and one"),
            &together.history(),
            &alone.history(),
            1e-8,
        );
        let snapshots = Snapshots::read(&together.file("points.vtkhdf"));
        assert_eq!(snapshots.times.len(), 13);
        let ranks: Vec<Vec<usize>> = (0..snapshots.times.len())
            .map(|snapshot| {
                snapshots
                    .scalar("rank", snapshot)
                    .into_iter()
                    .map(|rank| rank as usize)
                    .collect()
            })
            .collect();
        let moved: Vec<usize> = ranks
            .windows(2)
            .map(|pair| {
                pair[0]
                    .iter()
                    .zip(&pair[1])
                    .filter(|(before, after)| before != after)
                    .count()
            })
            .collect();
        println!("points that change ranks from snapshot to snapshot: {moved:?}");
        let steps_with_migration = moved[1..].iter().filter(|&&moved| moved > 0).count();
        assert!(steps_with_migration >= 3, "points change ranks too seldom: {moved:?}");
        // Two cuts of two cells of four points: more than those move only where all points are shared anew.
        let most = moved[2..].iter().max().expect("snapshots");
        assert!(
            count < 3 || *most > 2 * 2 * 4,
            "the points are not shared anew: {moved:?}"
        );
        // No rank is left behind with nothing, which is what happens when cells stay with ranks and nobody shares anew.
        for (snapshot, ranks) in ranks.iter().enumerate().skip(1) {
            let largest = (0..count).map(|rank| points_of(ranks, rank)).max().expect("ranks");
            let imbalance = (largest * count) as f64 / ranks.len() as f64;
            assert!(imbalance < 1.5, "imbalance {imbalance} at snapshot {snapshot}");
        }
    }
}
