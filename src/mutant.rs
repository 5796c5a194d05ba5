//! Errors of physics that the test suite must find, planted one at a time. Nothing
//! of it is there without the feature `mutants`, which only scripts/mutants.sh
//! uses; the errors are listed in tests/mutants.

/// SPIR-V that stands in for the kernel of this name: a file of the folder that
/// `ETENDUE_MUTANT_SPIRV` names, if it is there.
#[cfg(feature = "mutants")]
pub(crate) fn spirv(kernel: &str) -> Option<Vec<u8>> {
    let folder = std::env::var_os("ETENDUE_MUTANT_SPIRV")?;
    std::fs::read(std::path::Path::new(&folder).join(format!("{kernel}.spv"))).ok()
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
