//! Contacts that close: when they do within a part of a step, and when open ones will after it.
//!
//! Every row of contact, in every model, has at the end of its stage the gap `c (offset + rate)` with the coefficient c
//! of the stage and the rate `w . u` at which it opens. Closing times follow from these numbers, so that they cost no
//! geometry.

use crate::math::{Mask, Real};

/// What the rows of one robot say of a part.
#[derive(Debug, Clone, Copy)]
pub struct Closing {
    /// Time from the start of the part to the first closing of a contact that did not touch before; infinite if none
    /// closes \[s\].
    pub at: f64,
    /// Time from the end of the part to the first closing of an open contact, by its gap and rate there \[s\].
    pub forecast: f64,
    /// Time from the start of the part at which the first contact leaves its patch of the ground; infinite if none does
    /// \[s\].
    pub crossing: f64,
}

impl Closing {
    /// Whether a contact closes in the part that did not touch before.
    pub fn is_fresh(&self) -> bool {
        self.at < f64::INFINITY
    }
}

impl Default for Closing {
    fn default() -> Self {
        Self { at: f64::INFINITY, forecast: f64::INFINITY, crossing: f64::INFINITY }
    }
}

/// One row of contact at the end of a solved stage.
#[derive(Debug, Clone, Copy)]
pub struct ClosingRow<T: Real> {
    /// Its gap without motion over the coefficient of the stage \[m/s\].
    pub offset: T,
    /// w . u of the velocity with which the stage was predicted, and of its solution \[m/s\].
    pub expected_rate: T,
    pub rate: T,
    /// Whether it carries force, and did so at the end of the last accepted part.
    pub presses: T::Mask,
    pub touched: T::Mask,
}

impl<T: Real> ClosingRow<T> {
    /// In a stage of coefficient `c` that ends `elapsed` after the start of the part: time within the part at which the row
    /// closes, and time after it at which it is forecast to in the lanes `forecasts`; infinite where there is none \[s\].
    #[inline(always)]
    pub fn times(&self, c: T, elapsed: T, forecasts: T::Mask) -> (T, T) {
        let (zero, never, slow) = (T::zero(), T::splat(f64::INFINITY), T::splat(-SLOW));
        let closes = self.presses & !self.touched & self.expected_rate.lt(slow);
        let approaches = forecasts & !self.presses & self.rate.lt(slow);
        let (mut at, mut forecast) = (never, never);
        // Quotients are the larger part of this, and few rows need one.
        if closes.any() {
            // From the base of the stage with the velocity that was expected without the contact.
            let time = elapsed - c - c * self.offset / self.expected_rate;
            at = T::select(closes, time.max(zero).min(elapsed), never);
        }
        if approaches.any() {
            forecast = T::select(approaches, (c * (self.offset + self.rate)).max(zero) / -self.rate, never);
        }
        (at, forecast)
    }
}

/// The closings of a register's robots.
pub struct Closings<T> {
    /// In the stages of the part that are kept, see [`Closing`].
    at: T,
    forecast: T,
    crossing: T,
    /// In the stage at hand.
    stage_at: T,
    stage_forecast: T,
}

impl<T: Real> Closings<T> {
    #[inline(always)]
    pub fn none() -> Self {
        let never = T::splat(f64::INFINITY);
        Self { at: never, forecast: never, crossing: never, stage_at: never, stage_forecast: never }
    }

    /// Begins a part.
    #[inline(always)]
    pub fn begin_part(&mut self) {
        *self = Self::none();
    }

    /// Begins to collect the rows of a solved stage.
    #[inline(always)]
    pub fn begin_stage(&mut self) {
        (self.stage_at, self.stage_forecast) = (T::splat(f64::INFINITY), T::splat(f64::INFINITY));
    }

    /// Adds times of [`ClosingRow::times`].
    #[inline(always)]
    pub fn add(&mut self, (at, forecast): (T, T)) {
        (self.stage_at, self.stage_forecast) = (self.stage_at.min(at), self.stage_forecast.min(forecast));
    }

    /// Keeps the closings of the stage at hand in these lanes: those of the stage before no longer forecast.
    #[inline(always)]
    pub fn keep_stage(&mut self, lanes: T::Mask) {
        self.at = T::select(lanes, self.at.min(self.stage_at), self.at);
        self.forecast = T::select(lanes, self.stage_forecast, self.forecast);
    }

    pub fn of(&self, lane: usize) -> Closing {
        let [at, forecast, crossing] = [self.at, self.forecast, self.crossing].map(|times| times.lane(lane));
        Closing { at, forecast, crossing }
    }

    /// Adds a time within the part at which a contact leaves its patch of the ground; infinite where none does \[s\].
    pub fn add_crossing(&mut self, lane: usize, crossing: f64) {
        self.crossing.set_lane(lane, crossing.min(self.crossing.lane(lane)));
    }
}

/// Speed of approach below which a closing is no impact \[m/s\]: the rates of contacts at rest are round-off.
const SLOW: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    fn times(closings: &Closings<f64>) -> (f64, f64) {
        let Closing { at, forecast, .. } = closings.of(0);
        (at, forecast)
    }

    #[test]
    fn only_stages_that_are_kept_count_and_the_last_of_them_forecasts() {
        let mut closings = Closings::none();
        closings.begin_stage();
        closings.add((0.3, 0.7));
        closings.add((0.2, f64::INFINITY));
        closings.keep_stage(false);
        assert_eq!(times(&closings), (f64::INFINITY, f64::INFINITY), "it is solved again");
        closings.keep_stage(true);
        assert_eq!(times(&closings), (0.2, 0.7));
        closings.begin_stage();
        closings.add((0.4, 0.9));
        closings.keep_stage(true);
        assert_eq!(times(&closings), (0.2, 0.9), "the first closing of the part, the forecast of its end");
        closings.begin_part();
        assert!(!closings.of(0).is_fresh());
    }

    #[test]
    fn a_row_closes_when_its_gap_is_used_up() {
        let row = ClosingRow { offset: 0.5, expected_rate: -1.0, rate: -0.25, presses: true, touched: false };
        // The stage covers 2 s from 1 s on: a gap of 1 m closes at 1 m/s.
        assert_eq!(row.times(2.0, 3.0, true), (2.0, f64::INFINITY));
        let open = ClosingRow { presses: false, ..row };
        // 0.5 m are left at its end.
        assert_eq!(open.times(2.0, 3.0, true), (f64::INFINITY, 2.0));
        assert_eq!(open.times(2.0, 3.0, false).1, f64::INFINITY);
        assert_eq!(ClosingRow { touched: true, ..row }.times(2.0, 3.0, true).0, f64::INFINITY, "no new closing");
    }
}
