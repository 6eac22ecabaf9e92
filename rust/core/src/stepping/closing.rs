//! Contacts that close: when they do within a part of a step, and when open ones will after it.
//!
//! Every row of contact, in every model, has at the end of its stage the gap `c (offset + rate)` with the coefficient c
//! of the stage and the rate `w . u` at which it opens. Closing times follow from these numbers, so that they cost no
//! geometry.

use crate::math::{MAX_LANES, Mask, Real};

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
    const NONE: Self = Self { at: f64::INFINITY, forecast: f64::INFINITY, crossing: f64::INFINITY };

    /// Whether a contact closes in the part that did not touch before.
    pub fn is_fresh(&self) -> bool {
        self.at < f64::INFINITY
    }
}

impl Default for Closing {
    fn default() -> Self {
        Self::NONE
    }
}

/// One row of contact at the end of a solved stage.
#[derive(Debug, Clone, Copy)]
pub struct ClosingRow<T: Real = f64> {
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
pub struct Closings {
    lanes: [Closing; MAX_LANES],
}

impl Closings {
    pub fn none() -> Self {
        Self { lanes: [Closing::NONE; MAX_LANES] }
    }

    /// Begins a part.
    pub fn begin_part(&mut self) {
        self.lanes = [Closing::NONE; MAX_LANES];
    }

    /// Begins to collect the rows of a lane's solved stage: those of the stage before no longer forecast.
    pub fn begin_stage(&mut self, lane: usize) {
        self.lanes[lane].forecast = f64::INFINITY;
    }

    pub fn of(&self, lane: usize) -> &Closing {
        &self.lanes[lane]
    }

    /// Adds a closing at a time within the part, and one forecast at a time after it; infinite where there is none \[s\].
    pub fn add_times(&mut self, lane: usize, at: f64, forecast: f64) {
        let closing = &mut self.lanes[lane];
        (closing.at, closing.forecast) = (closing.at.min(at), closing.forecast.min(forecast));
    }

    /// Adds a time within the part at which a contact leaves its patch of the ground; infinite where none does \[s\].
    pub fn add_crossing(&mut self, lane: usize, crossing: f64) {
        let closing = &mut self.lanes[lane];
        closing.crossing = closing.crossing.min(crossing);
    }

    /// Adds a row, see [`ClosingRow::times`].
    pub fn add(&mut self, lane: usize, row: &ClosingRow, c: f64, elapsed: f64) {
        let (at, forecast) = row.times(c, elapsed, true);
        self.add_times(lane, at, forecast);
    }
}

/// Speed of approach below which a closing is no impact \[m/s\]: the rates of contacts at rest are round-off.
const SLOW: f64 = 1e-3;
