//! The cases, a file for each few groups.

mod geometry;
mod light;
mod matter;
mod numbers;
mod outside;

use crate::Case;

/// Cases of one kind.
pub struct Group {
    pub letter: char,
    pub name: &'static str,
    pub count: usize,
    pub cases: &'static [Case],
}

const fn group(letter: char, name: &'static str, count: usize, cases: &'static [Case]) -> Group {
    Group {
        letter,
        name,
        count,
        cases,
    }
}

/// All groups, in the order of the page.
pub const GROUPS: &[Group] = &[
    group(
        'A',
        "Geometry, rays, acceleration structures",
        23,
        geometry::CASES,
    ),
    group('B', "Fresnel and interfaces", 15, matter::INTERFACES),
    group('C', "Media", 14, matter::MEDIA),
    group('D', "Integrator", 9, light::INTEGRATOR),
    group('E', "Surfaces", 9, light::SURFACES),
    group('F', "Lights", 10, light::LIGHTS),
    group('G', "Numbers and accumulation", 8, numbers::ACCUMULATION),
    group('H', "Random numbers and samplers", 8, numbers::RANDOM),
    group('I', "Device and process", 12, outside::PROCESS),
    group('J', "glTF, images, security", 18, outside::FILES),
];

/// All cases.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    GROUPS.iter().flat_map(|group| group.cases)
}
