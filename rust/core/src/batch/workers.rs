//! The threads of a batch.

/// Threads, started at first use and again in a forked child, where those of the parent do not exist.
#[derive(Debug)]
pub struct Workers {
    count: usize,
    process: u32,
    pool: Option<rayon::ThreadPool>,
}

impl Workers {
    /// `count` threads; 0: one for each core.
    pub fn new(count: usize) -> Self {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        Self { count: if count == 0 { cores() } else { count }, process: std::process::id(), pool: None }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// The threads that share `parts` parts of work with the calling one, or `None` where that by itself is faster: with one
    /// thread or part, and where no threads can be started.
    pub fn helpers(&mut self, parts: usize) -> Option<&rayon::ThreadPool> {
        if self.count == 1 || parts < 2 {
            return None;
        }
        if self.process != std::process::id() {
            self.abandon();
        }
        if self.pool.is_none() {
            self.pool = rayon::ThreadPoolBuilder::new().num_threads(self.count - 1).build().ok();
        }
        self.pool.as_ref()
    }

    /// Never uses the pool of the parent process: its locks may be held by threads that are gone.
    fn abandon(&mut self) {
        std::mem::forget(self.pool.take());
        self.process = std::process::id();
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            self.abandon();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn a_pool_of_another_process_is_left_alone() {
        let mut workers = Workers::new(2);
        assert!(workers.helpers(2).is_some());
        workers.process = 0;
        let sum: i32 = workers.helpers(2).unwrap().install(|| (0..10).into_par_iter().sum());
        assert_eq!((sum, workers.process), (45, std::process::id()));
    }

    #[test]
    fn one_thread_never_starts_a_pool() {
        let mut workers = Workers::new(1);
        assert!(workers.helpers(1000).is_none() && workers.pool.is_none());
    }
}
