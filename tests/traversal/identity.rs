//! The layers `instance` and `material` against brute force in double precision.

use etendue::render::Identities;
use etendue::scene::{AlphaMode, Projection, Scene};
use etendue::settings::{BackendChoice, Crop, Settings};
use glam::{DAffine3, DVec3};

use crate::backends::offered;
use crate::brute::{Brute, nearest};
use crate::pictures::{SIZE, primary_rays};
use crate::scenes::{checker, cut_out, fan, scaled};
use crate::two_level::{from_flat, lamps};
use crate::{Levels, finish, open};

/// Pixels whose numbers may differ, as a share: those whose middle is on an edge.
const MOST_OTHER: f64 = 1e-3;

/// Placed meshes behind a checker that is cut out, seen askew.
fn fenced() -> Scene {
    let mut scene = lamps();
    scene.textures.push(checker());
    let mut fence = scaled(fan(), 2.0);
    fence.uvs[0] = fence
        .positions
        .iter()
        .map(|p| 0.25 * p.truncate() + 0.5)
        .collect();
    fence.material = scene.materials.len() as u32;
    scene
        .materials
        .push(cut_out(AlphaMode::Mask { cutoff: 0.5 }));
    let mut place = scene.instances[0].clone();
    place.mesh = scene.meshes.len() as u32;
    place.world_from_object = DAffine3::from_translation(DVec3::new(0.5, -2.0, 2.0));
    scene.meshes.push(fence);
    scene.instances.insert(2, place);
    scene
}

/// What double precision says covers the middle of each pixel.
fn expected(scene: &Scene) -> Identities {
    let brute = Brute::new(scene, Levels::Flat);
    let mut identities = Identities::default();
    for ray in primary_rays(scene, SIZE) {
        let candidates = brute.trace(&ray);
        let instance = nearest(&candidates).map(|hit| from_flat(scene, hit.primitive).0);
        let material =
            instance.map(|i| scene.meshes[scene.instances[i as usize].mesh as usize].material);
        let number = |id: Option<u32>| id.map_or(-1.0, |id| id as f32);
        identities.instances.push(number(instance));
        identities.materials.push(number(material));
    }
    identities
}

fn rendered(
    scene: &Scene,
    backend: BackendChoice,
    levels: Levels,
    crop: Option<Crop>,
) -> Option<Identities> {
    let settings = Settings {
        width: SIZE.0,
        height: SIZE.1,
        crop,
        samples: 0..1,
        backend,
        ..Settings::default()
    };
    let renderer = open(scene, &settings, levels)?;
    let identities = renderer.identities().unwrap();
    finish(&renderer);
    Some(identities)
}

#[test]
fn layers_number_what_covers_the_middle_of_each_pixel() {
    let mut scene = fenced();
    for parallel in [false, true] {
        if parallel {
            scene.cameras[0].projection = Projection::Orthographic {
                xmag: 4.0,
                ymag: 3.0,
            };
        }
        let expected = expected(&scene);
        for id in 0..scene.instances.len() {
            let seen = expected.instances.contains(&(id as f32));
            assert!(seen, "instance {id} is not in view");
        }
        assert!(expected.instances.contains(&-1.0));
        // rays are made before any traversal has them
        let backends = if parallel {
            vec![BackendChoice::Bvh]
        } else {
            offered()
        };
        for backend in backends {
            // the groups are the same for all, and each kernel takes seconds to compile
            let levels = match backend {
                BackendChoice::Bvh => vec![Levels::Flat, Levels::Two],
                _ => vec![Levels::Two],
            };
            for levels in levels {
                let Some(met) = rendered(&scene, backend, levels, None) else {
                    return;
                };
                let pairs = [
                    (&met.instances, &expected.instances),
                    (&met.materials, &expected.materials),
                ];
                for (met, expected) in pairs {
                    assert_eq!(met.len(), expected.len());
                    let others = met.iter().zip(expected).filter(|(a, b)| a != b).count();
                    let share = others as f64 / met.len() as f64;
                    println!(
                        "{}, {levels:?}: {others} of {} numbers differ",
                        backend.name(),
                        met.len()
                    );
                    assert!(share <= MOST_OTHER);
                }
            }
        }
    }
}

#[test]
fn layers_of_a_crop_are_a_part_of_the_whole() {
    let scene = fenced();
    let crop = Crop {
        x0: 13,
        y0: 7,
        x1: 50,
        y1: 31,
    };
    let of = |crop| rendered(&scene, BackendChoice::Bvh, Levels::Two, crop);
    let (Some(whole), Some(part)) = (of(None), of(Some(crop))) else {
        return;
    };
    let rows = crop.y0..crop.y1;
    let at = |row: u32, column: u32| whole.instances[(row * SIZE.0 + column) as usize];
    let cut: Vec<f32> = rows
        .flat_map(|row| (crop.x0..crop.x1).map(move |column| at(row, column)))
        .collect();
    assert_eq!(part.instances, cut);
}
