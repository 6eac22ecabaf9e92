//! Ends a call from outside, between the parts of a step: a signal handler, for one, has something to say.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Whether the call at hand is to end; shared by the robots of a batch.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    is_raised: AtomicBool,
    asks: OnceLock<fn() -> bool>,
}

/// What unwinds the call, as a panic would, without a message.
struct Interrupted;

impl Interrupt {
    /// Calls end where `asks` returns true, which is called often and by any thread.
    pub fn ask_with(&self, asks: fn() -> bool) {
        self.0.asks.get_or_init(|| asks);
    }

    /// Begins a call.
    pub fn clear(&self) {
        self.0.is_raised.store(false, Ordering::Relaxed);
    }

    pub fn is_raised(&self) -> bool {
        let Shared { is_raised, asks } = &*self.0;
        if asks.get().is_some_and(|asks| asks()) {
            is_raised.store(true, Ordering::Relaxed);
        }
        is_raised.load(Ordering::Relaxed)
    }

    /// Unwinds the call if it is to end.
    pub fn check(&self) {
        if self.is_raised() {
            resume_unwind(Box::new(Interrupted));
        }
    }
}
