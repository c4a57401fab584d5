//! Worker threads, kept between pictures, one set per number of threads asked for.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// More threads than this are never started.
pub const MAX_THREADS: usize = 256;

/// Thread pools by size.
#[derive(Default)]
pub struct Pools {
    by_size: Mutex<BTreeMap<usize, Arc<ThreadPool>>>,
}

impl Pools {
    /// The pool of `threads` workers; 0 means one per core this process may use.
    pub fn get(&self, threads: usize) -> Result<Arc<ThreadPool>, ThreadPoolBuildError> {
        let size = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
        .min(MAX_THREADS);
        let mut pools = self.by_size.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pools.get(&size) {
            return Ok(pool.clone());
        }
        let pool = ThreadPoolBuilder::new()
            .num_threads(size)
            .thread_name(|index| format!("splats-{index}"))
            .build()?;
        let pool = Arc::new(pool);
        pools.insert(size, pool.clone());
        Ok(pool)
    }
}
