//! Threads that share the parts of a job: whoever is free takes the next part.
//!
//! The leading thread takes parts as well, so it waits only for parts that another thread has
//! begun. On a busy machine that thread may be descheduled in the middle of a part. A leader that
//! waits long therefore tries now and then whether it is faster alone. Which thread does a part
//! never changes the result.

use std::{
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard,
        atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
    },
    thread,
    time::{Duration, Instant},
};

/// How long a helper polls for its next part before it sleeps: longer than a step takes, so that no
/// thread has to be woken on an idle machine. Every poll yields to other processes.
const BUSY_WAIT: Duration = Duration::from_micros(500);
/// How long the leader waits for a part before it yields to other processes.
const SPIN: Duration = Duration::from_micros(20);
/// Time over which the leader's pace is measured: many times as long as a scheduler's time slice.
const WINDOW: Duration = Duration::from_millis(40);
/// Number of windows after which the leader tries again whether it is faster the other way: at
/// first, and after many failed attempts.
const PATIENCE: [u32; 2] = [4, 64];
/// Share of its time that a leader may wait for others without wondering whether it pays.
const FAIR_WAIT: f64 = 0.2;

/// Locks a mutex. A panic under the lock ends all work once the threads are joined, so nothing
/// comes of what it left behind.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Locks for reading; see [`locked`].
pub fn read<T>(lock: &RwLock<T>) -> RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}

/// Locks for writing; see [`locked`].
pub fn written<T>(lock: &RwLock<T>) -> RwLockWriteGuard<'_, T> {
    lock.write().unwrap_or_else(PoisonError::into_inner)
}

/// What the leader and its helpers share. `J` describes a job.
#[derive(Debug)]
pub struct Crew<J> {
    job: Mutex<J>,
    /// Number of parts of the job that nobody has taken.
    untaken: AtomicUsize,
    /// Number of parts of the job that are not finished; the job stays the same until it is 0.
    unfinished: AtomicUsize,
    is_dismissed: AtomicBool,
    sleepers: AtomicUsize,
    sleep: Mutex<()>,
    wake: Condvar,
}

/// Counts a part as finished, also if it panics, so that nobody waits for it forever.
struct Finish<'a>(&'a AtomicUsize);

impl Drop for Finish<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, SeqCst);
    }
}

/// Dismisses the helpers when dropped.
pub struct Dismissal<'a, J>(pub &'a Crew<J>);

impl<J> Drop for Dismissal<'_, J> {
    fn drop(&mut self) {
        self.0.is_dismissed.store(true, SeqCst);
        let _sleep = locked(&self.0.sleep);
        self.0.wake.notify_all();
    }
}

impl<J: Clone> Crew<J> {
    /// Creates a crew without helpers. `job` has no parts yet.
    pub fn new(job: J) -> Self {
        Self {
            job: Mutex::new(job),
            untaken: AtomicUsize::new(0),
            unfinished: AtomicUsize::new(0),
            is_dismissed: AtomicBool::new(false),
            sleepers: AtomicUsize::new(0),
            sleep: Mutex::new(()),
            wake: Condvar::new(),
        }
    }

    /// Helps with every job until the crew is dismissed.
    pub fn help(&self, mut run: impl FnMut(&J, usize)) {
        while self.wait_for_part() {
            let Some(mut part) = self.take() else { continue };
            let job = locked(&self.job).clone();
            loop {
                let finish = Finish(&self.unfinished);
                run(&job, part);
                // The next part is of the same job, since this one is not finished yet.
                let Some(next) = self.take() else { break };
                drop(finish);
                part = next;
            }
        }
    }

    fn take(&self) -> Option<usize> {
        self.untaken.fetch_update(SeqCst, SeqCst, |untaken| untaken.checked_sub(1)).ok().map(|untaken| untaken - 1)
    }

    /// Waits until there is a part to take. Returns false once the crew is dismissed.
    fn wait_for_part(&self) -> bool {
        let is_idle = || self.untaken.load(SeqCst) == 0 && !self.is_dismissed.load(SeqCst);
        let started = Instant::now();
        while is_idle() {
            if started.elapsed() < BUSY_WAIT {
                thread::yield_now();
                continue;
            }
            let sleep = locked(&self.sleep);
            self.sleepers.fetch_add(1, SeqCst);
            // Whoever ends the idleness after this check sees the sleeper and waits for the lock.
            if is_idle() {
                drop(self.wake.wait(sleep));
            }
            self.sleepers.fetch_sub(1, SeqCst);
        }
        !self.is_dismissed.load(SeqCst)
    }

    fn offer(&self, job: J, parts: usize) {
        *locked(&self.job) = job;
        self.unfinished.store(parts, SeqCst);
        self.untaken.store(parts, SeqCst);
        if self.sleepers.load(SeqCst) > 0 {
            let _sleep = locked(&self.sleep);
            self.wake.notify_all();
        }
    }
}

/// The leading thread's side of a crew.
#[derive(Debug, Default)]
pub struct Lead {
    is_alone: bool,
    window: Option<Window>,
    /// Latest parts per second with help and alone; 0 if not measured yet.
    paces: [f64; 2],
    patience: u32,
    /// Number of windows since the other way was tried.
    settled: u32,
}

/// Measurements of a window.
#[derive(Debug)]
struct Window {
    started: Instant,
    parts: usize,
    waited: Duration,
}

impl Lead {
    /// Runs all parts of a job, with the help of the crew unless that takes longer.
    pub fn share<J: Clone>(&mut self, crew: &Crew<J>, job: J, parts: usize, mut run: impl FnMut(&J, usize)) {
        let new = || Window { started: Instant::now(), parts: 0, waited: Duration::ZERO };
        let window = self.window.get_or_insert_with(new);
        if self.is_alone {
            (0..parts).for_each(|part| run(&job, part));
        } else {
            crew.offer(job.clone(), parts);
            while let Some(part) = crew.take() {
                let _finish = Finish(&crew.unfinished);
                run(&job, part);
            }
            let worked = Instant::now();
            while crew.unfinished.load(SeqCst) > 0 {
                if worked.elapsed() < SPIN { std::hint::spin_loop() } else { thread::yield_now() }
            }
            window.waited += worked.elapsed();
        }
        window.parts += parts;
        let seconds = window.started.elapsed().as_secs_f64();
        if seconds >= WINDOW.as_secs_f64() {
            let (pace, wait) = (window.parts as f64 / seconds, window.waited.as_secs_f64() / seconds);
            self.end_window(pace, wait);
        }
    }

    /// Decides whether the leader works alone from now on, by its pace in parts per second and the
    /// share of the time that it waited.
    fn end_window(&mut self, pace: f64, wait: f64) {
        self.window = None;
        let [now, other] = [self.is_alone, !self.is_alone].map(usize::from);
        let known = self.paces[now];
        self.paces[now] = if known > 0.0 { 0.5 * (known + pace) } else { pace };
        self.settled += 1;
        let [least, most] = PATIENCE;
        if self.paces[other] > self.paces[now] {
            self.patience = if self.settled == 1 { (self.patience * 2).min(most) } else { least };
            self.change();
        } else if (self.is_alone || wait > FAIR_WAIT) && self.settled >= self.patience {
            self.patience = self.patience.max(least);
            self.change();
        }
    }

    fn change(&mut self) {
        self.is_alone = !self.is_alone;
        self.settled = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `jobs` jobs of 7 parts with 3 helpers and returns how often each part ran.
    fn runs(jobs: u32, mut lead: Lead) -> Vec<u32> {
        let crew = Crew::new(0_u32);
        let counts: Vec<Mutex<u32>> = (0..7).map(|_| Mutex::new(0)).collect();
        let count = |job: &u32, part: usize| {
            let mut count = locked(&counts[part]);
            // Every part of the job before is finished.
            assert_eq!(*count, *job);
            *count += 1;
        };
        thread::scope(|scope| {
            let _dismissal = Dismissal(&crew);
            (0..3).for_each(|_| drop(scope.spawn(|| crew.help(count))));
            (0..jobs).for_each(|job| lead.share(&crew, job, 7, count));
        });
        counts.iter().map(|count| *locked(count)).collect()
    }

    #[test]
    fn every_part_of_every_job_runs_once_before_the_next_job() {
        assert_eq!(runs(20_000, Lead::default()), [20_000; 7]);
        assert_eq!(runs(20, Lead { is_alone: true, ..Lead::default() }), [20; 7]);
    }

    /// Number of windows of 1000 that a leader spends alone where its paces with help and alone
    /// are these.
    fn windows_alone(paces: [f64; 2], wait: f64) -> u32 {
        let mut lead = Lead::default();
        let window = |_| {
            let is_alone = lead.is_alone;
            lead.end_window(paces[usize::from(is_alone)], if is_alone { 0.0 } else { wait });
            u32::from(is_alone)
        };
        (0..1000).map(window).sum()
    }

    #[test]
    fn a_leader_settles_for_the_faster_way_and_seldom_tries_the_other() {
        assert_eq!(windows_alone([2.0, 1.0], 0.1), 0);
        assert!((1..40).contains(&windows_alone([2.0, 1.0], 0.5)));
        assert!((960..1000).contains(&windows_alone([1.0, 2.0], 0.5)));
    }

    #[test]
    fn a_panic_in_a_part_reaches_the_caller() {
        let panics = std::panic::catch_unwind(|| {
            let crew = Crew::new(());
            thread::scope(|scope| {
                let _dismissal = Dismissal(&crew);
                scope.spawn(|| crew.help(|(), _| panic!("of the part")));
                crew.offer((), 1);
                while crew.untaken.load(SeqCst) > 0 {
                    thread::yield_now();
                }
            });
        });
        assert!(panics.is_err());
    }
}
