//! Every call of Vulkan may fail.

use std::time::Duration;

use etendue::fault::{Kind, Manner, Plan, arm, disarm, struck};
use etendue::film::Film;
use etendue::gpu::shim;
use etendue::render::{Control, DeviceOptions, Renderer};
use etendue::scene::{Scene, gltf};
use etendue::settings::{BackendChoice, Settings};
use etendue::{Error, Result};

use super::is_nightly;
use super::support::has_device;

/// After the call that failed a render ends within.
const LIMIT: Duration = Duration::from_secs(5);

/// By day one call in so many is tried, and after the kernel is compiled, which is what
/// takes long, one in so many. Primes: calls come in groups, of which none is then left out.
const STEP: u64 = 3;
const STEP_COMPILED: u64 = 17;

struct Ending {
    result: Result<Film>,
    /// From the failure to the error.
    delay: Duration,
    calls: Vec<&'static str>,
    messages: Vec<String>,
}

/// A small render under validation, with a fault.
fn render(scene: &Scene, backend: BackendChoice, at: u64, manner: Manner) -> Ending {
    let settings = Settings {
        width: 16,
        height: 16,
        samples: 0..2,
        backend,
        ..Settings::default()
    };
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    arm(Plan {
        kind: Kind::Vulkan,
        at,
        manner,
    });
    let rendered = || Renderer::new(scene, &settings, &options)?.render(&mut |_| Control::Continue);
    let result = rendered();
    let delay = match (&result, struck()) {
        (Err(_), Some(at)) => at.elapsed(),
        _ => Duration::ZERO,
    };
    let calls = disarm();
    let logs = shim::take_logs();
    let messages = logs.iter().flat_map(|log| log.messages()).collect();
    Ending {
        result,
        delay,
        calls,
        messages,
    }
}

fn cornell() -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.gltf");
    gltf::load(path.as_ref()).unwrap()
}

/// All sums, as bits.
fn bits(film: &Film) -> Vec<u32> {
    let values = film.nodes().flat_map(|(_, _, values)| values);
    values.map(|value| value.to_bits()).collect()
}

/// Calls whose failure a render may survive: names are for debuggers, smaller blocks of
/// memory are tried, and the last wait is for work that has ended.
const HARMLESS: [&str; 4] = [
    "vkSetDebugUtilsObjectNameEXT",
    "vkAllocateMemory",
    "vkMapMemory",
    "vkDeviceWaitIdle",
];

/// Calls that tell of a lost device while it is in use.
const TELLING: [&str; 4] = [
    "vkCreateDevice",
    "vkQueueSubmit",
    "vkWaitForFences",
    "vkGetQueryPoolResults",
];

fn check(at: u64, manner: Manner, whole: &Ending, ending: &Ending) {
    let struck = ending.calls.get(at as usize - 1);
    let about = format!("call {at} ({struck:?}, {manner:?})");
    assert_eq!(struck, whole.calls.get(at as usize - 1), "{about}");
    assert_eq!(ending.messages, Vec::<String>::new(), "{about}");
    let after = &whole.calls[at as usize - 1..];
    let is_fatal = match manner {
        Manner::Once => !HARMLESS.contains(&after[0]),
        Manner::Lasting => after.iter().any(|call| !HARMLESS.contains(call)),
        Manner::Lost => after.iter().any(|call| TELLING.contains(call)),
    };
    match (&ending.result, manner) {
        (Ok(film), _) => {
            assert!(!is_fatal, "{about} went unnoticed");
            let wanted = whole.result.as_ref().unwrap();
            assert!(bits(film) == bits(wanted), "{about} changed the picture");
        }
        (Err(Error::DeviceLost { .. }), Manner::Lost) => {}
        (Err(Error::OutOfMemory { .. } | Error::Vulkan { .. }), Manner::Once | Manner::Lasting) => {
        }
        // the layer could not be asked for
        (Err(Error::Unsupported { what, .. }), _) if what == "Vulkan validation" => {}
        (Err(error), _) => panic!("{about}: {error:?}"),
    }
}

/// Lets calls fail, one render each.
fn every_call_fails_cleanly(backend: BackendChoice) {
    if !has_device() {
        return;
    }
    let scene = cornell();
    let whole = render(&scene, backend, 0, Manner::Once);
    if let Err(Error::Unsupported { what, missing }) = &whole.result {
        eprintln!("skipped: {what}: {missing}");
        return;
    }
    assert_eq!(whole.messages, Vec::<String>::new());
    let is_compilation = |call: &&str| call.contains("Pipelines");
    let compiled = whole.calls.iter().position(is_compilation);
    let compiled = compiled.expect("every render compiles") as u64 + 1;
    let manners = [Manner::Once, Manner::Lasting, Manner::Lost];
    let mut longest = Duration::ZERO;
    for at in 1..=whole.calls.len() as u64 {
        let step = if at <= compiled { STEP } else { STEP_COMPILED };
        let chosen = match at % step {
            _ if is_nightly() => &manners[..],
            0 => &manners[(at / step) as usize % 3..][..1],
            _ => &[],
        };
        for &manner in chosen {
            let ending = render(&scene, backend, at, manner);
            longest = longest.max(ending.delay);
            check(at, manner, &whole, &ending);
        }
    }
    eprintln!("{} calls, at most {longest:?}", whole.calls.len());
    assert!(longest < LIMIT, "{longest:?}");
}

#[test]
fn every_call_of_a_render_with_our_tree_may_fail() {
    every_call_fails_cleanly(BackendChoice::Bvh);
}

#[test]
fn every_call_of_a_render_by_ray_query_may_fail() {
    every_call_fails_cleanly(BackendChoice::RayQuery);
}

#[test]
fn every_call_of_a_render_by_the_pipeline_may_fail() {
    every_call_fails_cleanly(BackendChoice::RayPipeline);
}

/// Lets each call of these names fail, in a render of several submissions; returns how many there are.
fn each_fails_cleanly(names: &[&str], manners: &[Manner]) -> Option<usize> {
    if !has_device() {
        return None;
    }
    let scene = cornell();
    let whole = render(&scene, BackendChoice::Bvh, 0, Manner::Once);
    assert_eq!(whole.messages, Vec::<String>::new());
    let (mut count, mut longest) = (0, Duration::ZERO);
    for (i, call) in whole.calls.iter().enumerate() {
        if !names.contains(call) {
            continue;
        }
        for &manner in manners {
            let ending = render(&scene, BackendChoice::Bvh, i as u64 + 1, manner);
            longest = longest.max(ending.delay);
            check(i as u64 + 1, manner, &whole, &ending);
        }
        count += 1;
    }
    println!("each of {count} calls of {names:?} failed: an error within {longest:.1?}");
    assert!(longest < LIMIT, "{longest:?}");
    Some(count)
}

#[test]
fn the_device_may_be_lost_at_every_submission() {
    let count = each_fails_cleanly(&["vkQueueSubmit", "vkWaitForFences"], &[Manner::Lost]);
    assert!(count.is_none_or(|n| n >= 6), "{count:?}");
}

#[test]
fn every_allocation_of_the_device_may_fail() {
    let names = ["vkAllocateMemory", "vkCreateBuffer", "vkMapMemory"];
    let count = each_fails_cleanly(&names, &[Manner::Once, Manner::Lasting]);
    assert!(count.is_none_or(|n| n >= 6), "{count:?}");
}
