//! The course of (T Table 7.5), continued to the goal.

use crate::scene::{Peg, TABLE_7_5};

/// More pegs like those of (T Table 7.5), from its last one up to `x_end`: two metres of travel bring the head
/// beyond the thesis's last peg, and without pegs the robot would stop there.
/// They keep the mean spacing and the mean y of the two rows of the table.
pub fn continued(x_end: f64) -> Vec<Peg> {
    let [radius, last_x, _] = TABLE_7_5[6];
    let spacing = (last_x - TABLE_7_5[0][1]) / 6.0;
    let places = (1..).map(|k| (k, last_x + f64::from(k) * spacing));
    places.take_while(|(_, x)| *x <= x_end).map(|(k, x)| Peg { radius, x, y: row_mean(k as usize) }).collect()
}

/// Mean y of the table's row to which the peg `k` places after its last one belongs.
fn row_mean(k: usize) -> f64 {
    let row: Vec<f64> = TABLE_7_5.iter().skip(k % 2).step_by(2).map(|peg| peg[2]).collect();
    row.iter().sum::<f64>() / row.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternates_on_from_the_table() {
        let pegs = continued(3.4);
        assert_eq!(pegs.len(), 3);
        assert!((pegs[0].x - 2.627).abs() < 1e-9 && (pegs[0].y - 0.0026667).abs() < 1e-6);
        assert!((pegs[1].y - 0.1785).abs() < 1e-9);
    }
}
