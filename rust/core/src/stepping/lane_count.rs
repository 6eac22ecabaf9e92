//! How many robots are stepped side by side: by their number and the processor's registers, or as a variable prescribes.

use std::sync::OnceLock;

use crate::error::ConfigError;
use crate::math::MAX_LANES;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::math::Wide4;
#[cfg(target_arch = "x86_64")]
use crate::math::Wide8;

/// Environment variable that prescribes the number of lanes; it is read once.
pub const VARIABLE: &str = "SNAKE_ENV_LANES";

/// Numbers of lanes that this processor has, in ascending order.
pub fn available_lanes() -> Vec<usize> {
    #[allow(unused_mut, reason = "some architectures have one only")]
    let mut lanes = vec![1];
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    if Wide4::is_available() {
        lanes.push(4);
    }
    #[cfg(target_arch = "x86_64")]
    if Wide8::is_available() {
        lanes.push(8);
    }
    lanes
}

/// The number of lanes that [`VARIABLE`] prescribes, if it is set.
///
/// # Errors
/// If the processor does not have it.
pub fn forced_lanes() -> Result<Option<usize>, ConfigError> {
    static FORCED: OnceLock<Result<Option<usize>, ConfigError>> = OnceLock::new();
    FORCED.get_or_init(|| std::env::var(VARIABLE).map_or(Ok(None), |value| parse(&value).map(Some))).clone()
}

fn parse(value: &str) -> Result<usize, ConfigError> {
    let available = available_lanes();
    let lanes = value.parse().ok().filter(|lanes| available.contains(lanes));
    lanes.ok_or_else(|| {
        ConfigError::new(VARIABLE, format!("{value:?}"), format!("one of {available:?} on this processor"))
    })
}

/// The lanes of the widest registers that a fleet of so many robots takes.
pub fn widest_lanes(fleet: usize) -> usize {
    lanes_for(if fleet < SMALL_FLEET { fleet.min(4) } else { fleet })
}

/// The lanes of a register that 0, 1, 2, ... of the robots of a fleet share, the widest last.
///
/// The robots of a small fleet rarely fill a wide register, since their parts are of two schemes and end at different times.
/// Few registers of a large fleet are not full, and there the code of other widths takes more time than it saves.
pub(super) fn lanes_of_registers(fleet: usize) -> [usize; MAX_LANES + 1] {
    let widest = widest_lanes(fleet);
    std::array::from_fn(|robots| if fleet < LARGE_FLEET { lanes_for(robots).min(widest) } else { widest })
}

/// Robots below which a fleet is small, and from which on it is large.
const SMALL_FLEET: usize = 12;
const LARGE_FLEET: usize = 100;

/// The lanes to use for `robots` robots; few of them are faster in a narrow register than in a wide one.
fn lanes_for(robots: usize) -> usize {
    let worthwhile = |lanes: usize| lanes == 1 || robots > lanes / 2;
    forced_lanes().ok().flatten().unwrap_or_else(|| {
        available_lanes().into_iter().filter(|&lanes| worthwhile(lanes)).max().expect("one lane at least")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_names_a_width_of_the_processor() {
        assert_eq!(parse("1").unwrap(), 1);
        for wrong in ["3", "many", ""] {
            let error = parse(wrong).unwrap_err().to_string();
            assert!(error.starts_with(&format!("SNAKE_ENV_LANES = {wrong:?}: expected one of [1")), "{error}");
        }
    }

    #[test]
    fn three_robots_are_worth_a_narrow_register_and_five_a_wide_one() {
        let available = available_lanes();
        let widest = |most: usize| available.iter().copied().filter(|&lanes| lanes <= most).max().unwrap();
        assert_eq!([1, 2, 3, 4, 5].map(lanes_for), [1, 1, widest(4), widest(4), widest(8)]);
        for (fleet, few, many) in [(2, 1, 1), (11, 1, 4), (12, 1, 8), (99, 1, 8), (100, 8, 8)] {
            let lanes = lanes_of_registers(fleet);
            assert_eq!([lanes[1], lanes[MAX_LANES]], [widest(few), widest(many)], "{fleet} robots");
        }
    }
}
