//! One counter-based random stream for each (seed, episode).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng};

/// Random numbers of one episode: they depend only on seed and episode, never on other environments, threads, or how
/// many numbers an earlier episode has drawn.
pub struct Rng(ChaCha8Rng);

impl Rng {
    pub fn new(seed: u64, episode: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(episode);
        Self(rng)
    }

    /// Random numbers of one control period of an episode, apart from those of the episode itself.
    pub fn of_step(seed: u64, episode: u64, step: u32) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ OF_STEPS);
        rng.set_stream(episode);
        rng.set_word_pos(u128::from(step) << WORDS_PER_STEP);
        Self(rng)
    }

    /// Uniform in `[0, 1)`, all 53 bits random.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in `[-reach, reach)`.
    pub fn around_zero(&mut self, reach: f64) -> f64 {
        self.uniform(-reach, reach)
    }

    /// True with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of `0..count`.
    pub fn index(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }
}

/// Sets the seeds of steps apart from those of episodes.
const OF_STEPS: u64 = 0x9E37_79B9_7F4A_7C15;

/// Binary logarithm of the words that a step may draw before the next one's begin.
const WORDS_PER_STEP: u32 = 16;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_different_seeds_and_episodes_differ_and_repeat() {
        let first = |seed, episode| Rng::new(seed, episode).unit();
        assert_eq!(first(7, 3), first(7, 3));
        assert_ne!(first(7, 3), first(7, 4));
        assert_ne!(first(7, 3), first(8, 3));
    }

    #[test]
    fn uniform_numbers_have_the_mean_and_range_of_their_law() {
        let mut rng = Rng::new(1, 1);
        let numbers: Vec<f64> = (0..10_000).map(|_| rng.uniform(2.0, 4.0)).collect();
        assert!(numbers.iter().all(|x| (2.0..4.0).contains(x)));
        // Five standard deviations of the mean: 5 * 2 / sqrt(12 * 10000).
        assert!((numbers.iter().sum::<f64>() / 1e4 - 3.0).abs() < 0.03);
    }
}
