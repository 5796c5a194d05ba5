//! The program as its users meet it: exit codes, messages, files.
#![allow(clippy::unwrap_used, reason = "a step that fails fails the test")]
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a test that is skipped says so, others print figures"
)]

mod bench;
mod compare;
mod ending;
mod info;
mod measure;
mod render;
mod selftest;
mod support;
mod usage;
