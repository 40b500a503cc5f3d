//! A thread that makes frames of one model's live impostor, in the order in which they are asked
//! for.

use crate::{
    Error, Result,
    draw::pages::Pages,
    model::FoliageModel,
    software::{BakeOptions, FrameMaker},
};
use std::{
    collections::{BTreeSet, VecDeque},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::Duration,
};

/// Time after which a waiting caller looks whether the thread still runs.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Makes frames on a thread, which starts with the first request and ends when this is dropped.
pub(super) struct FrameThread {
    shared: Arc<Shared>,
    options: BakeOptions,
    /// The model, until the thread takes it.
    model: Option<FoliageModel>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Frames to make, the most important one first.
    wanted: VecDeque<u32>,
    /// Frames being made.
    busy: BTreeSet<u32>,
    made: VecDeque<(u32, Pages)>,
    failure: Option<Error>,
    is_over: bool,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // A thread that panics leaves the state as it was.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FrameThread {
    /// Keeps a copy of the model.
    pub(super) fn new(model: &FoliageModel, options: BakeOptions) -> Self {
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new() });
        Self { shared, options, model: Some(model.clone()), thread: None }
    }

    /// Asks for these frames, in this order, in place of those asked for before.
    ///
    /// # Errors
    /// [`Error::Gpu`] if no thread can be started.
    pub(super) fn ask(&mut self, frames: &[u32]) -> Result<()> {
        let mut state = self.shared.state();
        let State { busy, made, .. } = &*state;
        let is_open = |frame: &&u32| !busy.contains(*frame) && made.iter().all(|(other, _)| other != *frame);
        let wanted: VecDeque<u32> = frames.iter().filter(is_open).copied().collect();
        let is_asked = !wanted.is_empty();
        state.wanted = wanted;
        drop(state);
        if let Some(model) = self.model.take_if(|_| is_asked) {
            let (shared, options) = (Arc::clone(&self.shared), self.options);
            let thread = std::thread::Builder::new().name("impostor frames".into());
            let started = thread.spawn(move || run(&shared, &model, &options));
            self.thread = Some(started.map_err(|error| Error::gpu(format!("no thread for impostors: {error}")))?);
        }
        self.shared.changed.notify_all();
        Ok(())
    }

    /// Takes one frame that is made; with `waits`, waits until one is or none is asked for.
    ///
    /// # Errors
    /// The error of the frame that could not be made, once.
    pub(super) fn take(&self, waits: bool) -> Result<Option<(u32, Pages)>> {
        let mut state = self.shared.state();
        loop {
            if let Some(error) = state.failure.take() {
                return Err(error);
            }
            let made = state.made.pop_front();
            let is_idle = state.wanted.is_empty() && state.busy.is_empty();
            let has_ended = self.thread.as_ref().is_none_or(JoinHandle::is_finished);
            if made.is_some() || !waits || is_idle || has_ended {
                return Ok(made);
            }
            let waited = self.shared.changed.wait_timeout(state, LOOK_EVERY);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for FrameThread {
    fn drop(&mut self) {
        self.shared.state().is_over = true;
        self.shared.changed.notify_all();
    }
}

/// Makes frames until nobody asks any longer: as many at once as there are processors.
fn run(shared: &Shared, model: &FoliageModel, options: &BakeOptions) {
    let fail = |error| shared.state().failure = Some(error);
    let maker = match FrameMaker::new(model, options) {
        Ok(maker) => maker,
        Err(error) => return fail(error),
    };
    let mut left = maker.framing().lattice.frames() as usize;
    while left > 0 {
        let mut state = shared.state();
        while state.wanted.is_empty() && !state.is_over {
            state = shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.is_over {
            return;
        }
        let count = rayon::current_num_threads().min(state.wanted.len());
        let frames: Vec<u32> = state.wanted.drain(..count).collect();
        state.busy.extend(&frames);
        drop(state);
        let made = maker.make(&frames);
        let mut state = shared.state();
        state.busy.clear();
        match made {
            Ok(made) => state.made.extend(made),
            Err(error) => {
                state.failure = Some(error);
                return;
            }
        }
        drop(state);
        shared.changed.notify_all();
        left -= frames.len();
    }
}
