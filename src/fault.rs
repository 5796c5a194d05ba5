//! Faults on purpose: the n-th call of a kind fails, so that tests can see what becomes of
//! it. Nothing of it is there without the feature `faults`, which only tests/faults uses.

#[cfg(feature = "faults")]
pub use armed::{Kind, Manner, Plan, arm, arm_from_environment, disarm, struck};

#[cfg(feature = "faults")]
pub(crate) use armed::{is_armed, strikes};

/// To be called before a step of writing a file; fails where that is planned.
#[cfg(feature = "faults")]
pub(crate) fn file_step(name: &'static str) -> std::io::Result<()> {
    match strikes(Kind::File, name) {
        None => Ok(()),
        Some(_) => Err(std::io::Error::from(std::io::ErrorKind::StorageFull)),
    }
}

#[cfg(not(feature = "faults"))]
pub(crate) const fn file_step(_name: &'static str) -> std::io::Result<()> {
    Ok(())
}

/// The plan of this thread, for another one.
#[cfg(feature = "faults")]
pub(crate) use armed::{give, take};

#[cfg(not(feature = "faults"))]
pub(crate) struct NoPlan;

#[cfg(not(feature = "faults"))]
pub(crate) const fn take() -> NoPlan {
    NoPlan
}

#[cfg(not(feature = "faults"))]
pub(crate) const fn give(_plan: NoPlan) {}

#[cfg(feature = "faults")]
mod armed {
    use std::cell::RefCell;
    use std::time::Instant;

    /// What fails.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Kind {
        /// Calls of Vulkan that can fail, in the order in which they are made.
        Vulkan,
        /// Steps of writing files.
        File,
    }

    /// How it fails.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Manner {
        /// Memory or space is exhausted this once.
        Once,
        /// … and stays exhausted.
        Lasting,
        /// The device is lost: from then on every call that can say so does.
        Lost,
    }

    /// A fault to come.
    #[derive(Clone, Copy, Debug)]
    pub struct Plan {
        /// What fails.
        pub kind: Kind,
        /// The number of the call, from 1; 0 fails none, to count them.
        pub at: u64,
        /// How.
        pub manner: Manner,
    }

    pub(crate) struct State {
        plan: Plan,
        calls: Vec<&'static str>,
        struck: Option<Instant>,
    }

    // Of each thread, so that tests beside each other do not meet.
    thread_local! {
        static STATE: RefCell<Option<State>> = const { RefCell::new(None) };
    }

    /// From now on calls of this thread are counted, and the planned one fails.
    pub fn arm(plan: Plan) {
        STATE.set(Some(State {
            plan,
            calls: Vec::new(),
            struck: None,
        }));
    }

    /// No more faults; the names of the calls of the planned kind so far.
    pub fn disarm() -> Vec<&'static str> {
        STATE.take().map_or(Vec::new(), |state| state.calls)
    }

    /// When a call last failed on purpose.
    pub fn struck() -> Option<Instant> {
        STATE.with_borrow(|state| state.as_ref()?.struck)
    }

    /// As [`arm`], for programs: `ETENDUE_FAULT` is `vulkan` or `file`, the number of
    /// the call, and `once`, `lasting` or `lost`, with spaces between.
    pub fn arm_from_environment() {
        let Ok(text) = std::env::var("ETENDUE_FAULT") else {
            return;
        };
        let mut words = text.split(' ');
        let kind = match words.next() {
            Some("vulkan") => Kind::Vulkan,
            _ => Kind::File,
        };
        let at = words.next().and_then(|at| at.parse().ok()).unwrap_or(0);
        let manner = match words.next() {
            Some("once") => Manner::Once,
            Some("lost") => Manner::Lost,
            _ => Manner::Lasting,
        };
        arm(Plan { kind, at, manner });
    }

    pub(crate) fn take() -> Option<State> {
        STATE.take()
    }

    pub(crate) fn give(state: Option<State>) {
        STATE.set(state);
    }

    /// Whether faults of this kind are planned in this thread.
    pub(crate) fn is_armed(kind: Kind) -> bool {
        STATE.with_borrow(|state| state.as_ref().is_some_and(|s| s.plan.kind == kind))
    }

    /// Counts a call, and says how it has to fail, if so.
    pub(crate) fn strikes(kind: Kind, name: &'static str) -> Option<Manner> {
        STATE.with_borrow_mut(|state| {
            let state = state.as_mut().filter(|s| s.plan.kind == kind)?;
            state.calls.push(name);
            let (count, plan) = (state.calls.len() as u64, state.plan);
            let is_now = count == plan.at;
            let is_still = plan.at > 0 && count > plan.at && plan.manner != Manner::Once;
            if !(is_now || is_still) {
                return None;
            }
            state.struck = Some(Instant::now());
            Some(plan.manner)
        })
    }
}
