//! Nothing allocates in an implicit step of the robot model: every request to the allocator is counted.

#[path = "common/minimal.rs"]
mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::{default_config, soft_start, straight};
use snake_core::minimal::{FeedbackConfig, NoiseConfig, Treatment};
use snake_core::minimal_simulation::MinimalConfig;

struct Counting;

// The count of each thread: the test harness has threads of its own.
thread_local! {
    static REQUESTS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        REQUESTS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        REQUESTS.with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn an_implicit_step_asks_for_no_memory() {
    let limited = FeedbackConfig { torque_limit: Some(10.0), ..FeedbackConfig::io() };
    let held = FeedbackConfig { treatment: Treatment::Step, ..FeedbackConfig::io_for_period(0.02) };
    for controller in [FeedbackConfig::pd(), FeedbackConfig::io(), limited, held] {
        let noise = NoiseConfig { joint_angle: 1e-5, ..NoiseConfig::default() };
        let mut simulation = straight(&MinimalConfig { controller, noise, ..default_config() });
        let reference = soft_start();
        assert!(simulation.advance(0.05, &reference));
        let before = REQUESTS.get();
        assert!(simulation.advance(1.0, &reference));
        assert_eq!(REQUESTS.get() - before, 0, "{controller:?}");
    }
}
