//! The gate and the night: the same tests with more samples.

/// What a test prints that took the counts of the night.
pub const OF_THE_NIGHT: &str = "with the counts of the night";

/// `ETENDUE_NIGHTLY=1`.
pub fn is_night() -> bool {
    std::env::var_os("ETENDUE_NIGHTLY").is_some_and(|value| value == "1")
}

/// A bound in the gate, and the one at night, which more samples can tell.
#[allow(dead_code, reason = "not every test program has two bounds")]
pub fn bound(gate: f64, night: f64) -> f64 {
    if !is_night() {
        return gate;
    }
    println!("{OF_THE_NIGHT}: within {night:e}, in the gate {gate:e}");
    night
}

/// So many in the gate, and so many at night.
pub fn count(gate: u64, night: u64) -> u64 {
    if !is_night() {
        return gate;
    }
    println!("{OF_THE_NIGHT}: {night}, in the gate {gate}");
    night
}
