//! Ctrl-C and SIGTERM: stop at the next pass and write what is finished. Before
//! there is anything to write they end the program at once; while files are
//! being written they wait.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use super::failure::{FAILED, Failure, INTERRUPTED};
use super::write_stderr;

// What the program is doing, as far as signals are concerned.
const PREPARING: u8 = 0;
const RENDERING: u8 = 1;
const STOPPING: u8 = 2;
const WRITING: u8 = 3;

/// Knows whether the user wants to stop.
pub struct Interrupt(Arc<AtomicU8>);

impl Interrupt {
    /// Takes over the signals; once per process.
    pub fn install() -> Result<Self, Failure> {
        let state = Arc::new(AtomicU8::new(PREPARING));
        let shared = Arc::clone(&state);
        ctrlc::set_handler(move || {
            let stop =
                shared.compare_exchange(RENDERING, STOPPING, Ordering::SeqCst, Ordering::SeqCst);
            match stop {
                Ok(_) => write_stderr("interrupted: finishing; once more to give up"),
                Err(WRITING) => {}
                Err(_) => std::process::exit(INTERRUPTED.into()),
            }
        })
        .map_err(|error| Failure::new(FAILED, error, "watch for Ctrl-C"))?;
        Ok(Self(state))
    }

    /// From now on a signal asks to stop instead of ending the program.
    pub fn begin_rendering(&self) {
        self.0.store(RENDERING, Ordering::SeqCst);
    }

    /// From now on signals wait.
    pub fn begin_writing(&self) {
        self.0.store(WRITING, Ordering::SeqCst);
    }

    /// Whether a signal came while rendering.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst) == STOPPING
    }
}
