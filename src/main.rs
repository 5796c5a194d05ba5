//! The `etendue` program.

fn main() {}
