//! Errors of physics that the test suite must find, planted one at a time. Nothing
//! of it is there without the feature `mutants`, which only scripts/mutants.sh
//! uses; the errors are listed in tests/mutants.

/// SPIR-V that stands in for the kernel of this name: a file of the folder that
/// `ETENDUE_MUTANT_SPIRV` names, if it is there. If not, the folder gets an empty file `NAME.asked`.
#[cfg(feature = "mutants")]
pub(crate) fn spirv(kernel: &str) -> Option<Vec<u8>> {
    let file = std::path::PathBuf::from(std::env::var_os("ETENDUE_MUTANT_SPIRV")?).join(kernel);
    let planted = std::fs::read(file.with_extension("spv")).ok();
    if planted.is_none() {
        std::fs::write(file.with_extension("asked"), "").ok();
    }
    planted
}

/// Whether `ETENDUE_MUTANT` names this error of the host's code.
#[cfg(feature = "mutants")]
pub(crate) fn is(name: &str) -> bool {
    std::env::var_os("ETENDUE_MUTANT").is_some_and(|mutant| mutant == name)
}

#[cfg(not(feature = "mutants"))]
pub(crate) const fn spirv(_kernel: &str) -> Option<Vec<u8>> {
    None
}

#[cfg(not(feature = "mutants"))]
pub(crate) const fn is(_name: &str) -> bool {
    false
}
