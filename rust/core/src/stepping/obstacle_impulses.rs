//! What obstacles have done to a robot, at the cost of those that touched it.

use nalgebra::Vector3;

/// Sums of impulses, one per obstacle, world frame \[N s\].
#[derive(Debug, Clone)]
pub struct ObstacleImpulses {
    sums: Vec<Vector3<f64>>,
    /// Obstacles with a sum that may not be zero, so that thousands of far ones need not be visited.
    touched: Vec<usize>,
}

impl ObstacleImpulses {
    pub fn zeros(obstacles: usize) -> Self {
        Self { sums: vec![Vector3::zeros(); obstacles], touched: Vec::with_capacity(TOUCHED) }
    }

    /// The sums, by the obstacles' numbers.
    pub fn sums(&self) -> &[Vector3<f64>] {
        &self.sums
    }

    /// Adds to the sum of an obstacle.
    pub fn add(&mut self, obstacle: usize, impulse: Vector3<f64>) {
        let sum = &mut self.sums[obstacle];
        if *sum == Vector3::zeros() && impulse != Vector3::zeros() {
            self.touched.push(obstacle);
        }
        *sum += impulse;
    }

    /// Clears all sums; from now on there are so many obstacles.
    pub fn clear(&mut self, obstacles: usize) {
        for obstacle in self.touched.drain(..) {
            self.sums[obstacle] = Vector3::zeros();
        }
        self.sums.resize(obstacles, Vector3::zeros());
    }

    /// Replaces all sums.
    pub fn replace(&mut self, sums: &[Vector3<f64>]) {
        self.clear(sums.len());
        for (obstacle, &sum) in sums.iter().enumerate() {
            self.add(obstacle, sum);
        }
    }
}

/// Obstacles reserved for; a robot that touches more in an interval grows the list once.
const TOUCHED: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_list_is_one_of_zeros_of_any_length() {
        let push = Vector3::new(1.0, -2.0, 0.0);
        let mut impulses = ObstacleImpulses::zeros(3);
        for impulse in [push, -push, Vector3::zeros(), push] {
            impulses.add(2, impulse);
        }
        impulses.add(0, Vector3::zeros());
        assert_eq!(impulses.sums(), [Vector3::zeros(), Vector3::zeros(), push]);
        for obstacles in [1, 5] {
            impulses.clear(obstacles);
            assert_eq!(impulses.sums(), vec![Vector3::zeros(); obstacles]);
        }
        let saved = [push, Vector3::zeros(), 3.0 * push];
        impulses.replace(&saved);
        assert_eq!(impulses.sums(), saved);
        impulses.clear(3);
        assert_eq!(impulses.sums(), [Vector3::zeros(); 3], "sums that were replaced are cleared too");
    }
}
