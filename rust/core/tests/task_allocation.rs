//! A step allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use snake_core::task::{ActionMode, EnvConfig, Environment, Task};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn stepping_an_environment_does_not_allocate() {
    for task in [Task::Course, Task::Field, Task::Free] {
        for action_mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual] {
            let config = EnvConfig { task, action_mode, ..EnvConfig::default() };
            let mut environment = Environment::new(&config).unwrap();
            let mut observation = vec![0.0; environment.observation_size()];
            let action = vec![0.2; environment.action_size()];
            environment.reset(Some(1), &mut observation);
            // The first steps may reserve workspace that the rest re-uses.
            for _ in 0..20 {
                environment.step(&action, &mut observation);
            }
            let before = ALLOCATIONS.get();
            for _ in 0..100 {
                environment.step(&action, &mut observation);
            }
            assert_eq!(ALLOCATIONS.get() - before, 0, "{task:?}, {action_mode:?}");
        }
    }
}
