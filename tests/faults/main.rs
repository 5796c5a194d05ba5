//! What becomes of a render when a call of Vulkan or a step of writing a file fails, for
//! each of them: an error that says so, nothing leaked, nothing lost that was finished.
//! Takes the feature `faults`. `ETENDUE_NIGHTLY=1` tries every call, not only some.
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a step that fails fails the test; what is skipped or measured is said"
)]

mod files;
mod program;
#[allow(dead_code, reason = "shared with the tests of the program")]
#[path = "../cli/support.rs"]
mod support;
mod vulkan;

/// Whether everything is tried.
fn is_nightly() -> bool {
    std::env::var_os("ETENDUE_NIGHTLY").is_some_and(|value| value == "1")
}
