//! Worker threads, kept between pictures, one set per number of threads asked for.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// More threads than this are never started.
pub const MAX_THREADS: usize = 256;

thread_local! {
    /// A pool whose only worker is this thread: nothing is handed over, nobody waited for.
    static HERE: OnceCell<Option<Arc<ThreadPool>>> = const { OnceCell::new() };
}

/// The pool of this thread alone; None where it works for another one.
fn here() -> Option<Arc<ThreadPool>> {
    let build = || {
        let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        alone.build().ok().map(Arc::new)
    };
    HERE.with(|pool| pool.get_or_init(build).clone())
}

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
        if let (1, Some(pool)) = (size, here()) {
            return Ok(pool);
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thread_is_the_one_that_asks() {
        let pools = Pools::default();
        let asking = std::thread::current().id();
        let one = pools.get(1).expect("a pool of this thread");
        assert_eq!(one.install(|| std::thread::current().id()), asking);
        let other = std::thread::spawn(move || {
            let one = Pools::default().get(1).expect("a pool of that thread");
            one.install(|| std::thread::current().id()) == std::thread::current().id()
        });
        assert!(other.join().expect("the other thread ends well"));
        // A thread that has its own pool can still ask others.
        let two = pools.get(2).expect("a pool of two");
        assert_ne!(two.install(|| std::thread::current().id()), asking);
        assert_eq!(two.install(rayon::current_num_threads), 2);
    }
}
