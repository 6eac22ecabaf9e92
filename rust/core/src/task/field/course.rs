//! The course of (T Table 7.5), continued to the goal.

use crate::scene::{Peg, TABLE_7_5};

/// Fills `pegs` with the seven pegs of (T Table 7.5) and, up to `x_end`, more of the same: two metres
/// of travel bring the head beyond the thesis's last peg, and without pegs the robot would stop there.
/// The added pegs keep the mean spacing and the mean y of the two rows of the table.
pub fn course(x_end: f64, pegs: &mut Vec<Peg>) {
    pegs.clear();
    pegs.extend(TABLE_7_5.map(Peg::from));
    let [radius, last_x, _] = TABLE_7_5[6];
    let spacing = (last_x - TABLE_7_5[0][1]) / 6.0;
    for k in 1.. {
        let x = last_x + f64::from(k) * spacing;
        if x > x_end {
            break;
        }
        pegs.push(Peg { radius, x, y: row_mean(k as usize) });
    }
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
    fn begins_with_the_table_and_alternates_on() {
        let mut pegs = Vec::new();
        course(3.4, &mut pegs);
        assert_eq!(&pegs[..7], TABLE_7_5.map(Peg::from));
        assert_eq!(pegs.len(), 10);
        assert!((pegs[7].x - 2.627).abs() < 1e-9 && (pegs[7].y - 0.0026667).abs() < 1e-6);
        assert!((pegs[8].y - 0.1785).abs() < 1e-9);
    }
}
