//! Device and process; files.

use crate::Verdict::*;
use crate::{Case, line, passes};

/// I.
pub const PROCESS: &[Case] = &[
    Case {
        id: "I1",
        what: "Long dispatches: the system resets the device after 2 s",
        expected: "batches aim at 0.1 s; 1000 scatterings: ≤ 0.25 s",
        verdict: Wider("2 s, on a machine that others share; 0.1 s is the aim"),
        evidence: &[line(
            "stability::numbers::batches_of_long_paths_are_short",
            "longest",
        )],
    },
    Case {
        id: "I2",
        what: "Device lost in the middle",
        expected: "clean end at every submission, the checkpoint loads",
        verdict: Holds,
        evidence: &[
            line(
                "faults::vulkan::the_device_may_be_lost_at_every_submission",
                "each of",
            ),
            passes("faults::program::a_lost_device_loses_no_finished_sample"),
        ],
    },
    Case {
        id: "I3",
        what: "Out of memory of device or host",
        expected: "the k-th allocation fails: one error, nothing leaked",
        verdict: Wider(
            "of the device; memory of the host is asked for before it is taken, and its k-th allocation is not made to fail",
        ),
        evidence: &[
            line(
                "faults::vulkan::every_allocation_of_the_device_may_fail",
                "each of",
            ),
            passes("gpu::buffers::exhausted_memory_is_an_error"),
            passes("work::memory::what_has_no_room_is_refused_with_the_figure"),
        ],
    },
    Case {
        id: "I4",
        what: "Too many triangles, textures, descriptors",
        expected: "an error with the figure",
        verdict: Holds,
        evidence: &[
            passes("gpu::buffers::limits_are_errors_with_the_figure"),
            passes("loader::broken_shading::every_limit_is_enforced_and_named"),
        ],
    },
    Case {
        id: "I5",
        what: "Barriers, scratch alignment",
        expected: "validation on every test; planted faults are seen",
        verdict: Holds,
        evidence: &[
            passes("gpu::validation::validation_sees_a_missing_barrier"),
            passes("gpu::validation::validation_sees_a_leak"),
            passes("gpu::validation::validation_sees_a_copy_past_the_end"),
        ],
    },
    Case {
        id: "I6",
        what: "Killed while writing",
        expected: "old file or new file, never neither",
        verdict: Holds,
        evidence: &[
            passes("work::resume::killed_renders_leave_complete_files"),
            passes("files::a_failing_write_leaves_the_old_file_and_no_rest"),
            passes("files::a_write_cut_short_leaves_the_old_file_and_no_rest"),
        ],
    },
    Case {
        id: "I7",
        what: "Disk full, read-only, long names",
        expected: "probed at the start; an error, the other outputs written",
        verdict: Holds,
        evidence: &[
            passes("cli::ending::a_failing_output_fails_the_render_but_not_the_others"),
            passes("files::probing_changes_nothing"),
            passes("files::links_devices_and_permissions_are_respected"),
        ],
    },
    Case {
        id: "I8",
        what: "Checkpoint of another build, scene or device",
        expected: "refused, with what differs; every flipped bit noticed",
        verdict: Holds,
        evidence: &[
            passes("work::damage::every_cut_and_any_flipped_bit_is_noticed"),
            passes("work::refusals::resume_names_what_differs"),
        ],
    },
    Case {
        id: "I9",
        what: "SIGTERM, Ctrl-C",
        expected: "what is finished is kept",
        verdict: Holds,
        evidence: &[
            passes("work::resume::signals_leave_a_checkpoint_and_what_is_finished"),
            passes("cli::ending::signals_stop_at_a_pass_and_keep_what_is_finished"),
        ],
    },
    Case {
        id: "I10",
        what: "Two processes, one output",
        expected: "one whole version",
        verdict: Holds,
        evidence: &[passes(
            "files::many_writers_of_one_file_leave_one_whole_version",
        )],
    },
    Case {
        id: "I11",
        what: "Quirks of lavapipe: subgroups of four, limits",
        expected: "the suite passes on it",
        verdict: Holds,
        evidence: &[
            passes("traversal::pictures::backends_agree_on_the_scenes"),
            line("cli::selftest::device_passes_its_tests", "loops"),
        ],
    },
    Case {
        id: "I12",
        what: "Drivers change results",
        expected: "no pictures as references; device and driver in every header",
        verdict: Holds,
        evidence: &[passes(
            "cli::render::a_render_writes_every_output_with_its_header",
        )],
    },
];

/// J.
pub const FILES: &[Case] = &[
    Case {
        id: "J1",
        what: "URIs that leave the folder",
        expected: "refused before anything is opened",
        verdict: Holds,
        evidence: &[
            passes("loader::hostile::hostile_uris_are_refused"),
            passes(
                "loader::hostile::links_out_of_the_folder_are_refused_and_links_inside_followed",
            ),
        ],
    },
    Case {
        id: "J2",
        what: "Bad percent escapes: panic",
        expected: "an error",
        verdict: Holds,
        evidence: &[passes("loader::hostile::hostile_uris_are_refused")],
    },
    Case {
        id: "J3",
        what: "GLB lengths below 12 or huge",
        expected: "an error at once",
        verdict: Holds,
        evidence: &[passes(
            "loader::hostile::truncated_and_lying_glb_are_refused",
        )],
    },
    Case {
        id: "J4",
        what: "Accessors overflow",
        expected: "checked arithmetic: errors at every boundary",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_buffers_and_accessors_are_refused"),
            passes("loader::hostile::claims_without_data_take_no_memory"),
        ],
    },
    Case {
        id: "J5",
        what: "Views past their buffer",
        expected: "an error",
        verdict: Holds,
        evidence: &[passes(
            "loader::broken::broken_buffers_and_accessors_are_refused",
        )],
    },
    Case {
        id: "J6",
        what: "Indices beyond the vertices",
        expected: "an error",
        verdict: Holds,
        evidence: &[passes("loader::broken::broken_numbers_are_refused")],
    },
    Case {
        id: "J7",
        what: "NaN and infinity in buffers",
        expected: "an error or a rebuilt attribute",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_numbers_are_refused"),
            passes("loader::geometry::normals_and_tangents_are_unit_and_bad_normals_are_rebuilt"),
        ],
    },
    Case {
        id: "J8",
        what: "Cycles, two parents, own child",
        expected: "an error",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_structure_is_refused"),
            passes("loader::hostile::a_chain_of_a_million_nodes_loads"),
        ],
    },
    Case {
        id: "J9",
        what: "1e6 nodes deep: stack overflow",
        expected: "loads in 5 s",
        verdict: Holds,
        evidence: &[passes("loader::hostile::a_chain_of_a_million_nodes_loads")],
    },
    Case {
        id: "J10",
        what: "JSON bombs, duplicate keys",
        expected: "refused within 5 s of work",
        verdict: Holds,
        evidence: &[
            passes("loader::hostile::json_bombs_are_refused_at_once"),
            passes("loader::hostile::unreadable_scenes_are_refused"),
        ],
    },
    Case {
        id: "J11",
        what: "Images that claim 60 000²",
        expected: "refused by their header",
        verdict: Holds,
        evidence: &[passes(
            "loader::shading::image_bombs_are_refused_by_their_header",
        )],
    },
    Case {
        id: "J12",
        what: "Missing, cut or mislabelled textures",
        expected: "an error that names the image",
        verdict: Holds,
        evidence: &[
            passes("loader::broken_shading::broken_materials_and_textures_are_refused"),
            line("loader::shading::truncated_images_are_refused", "cuts"),
        ],
    },
    Case {
        id: "J13",
        what: "No camera, scene, mesh or lamp",
        expected: "a framing camera, or an error",
        verdict: Holds,
        evidence: &[
            passes("loader::world::framing_camera_has_the_whole_box_in_view_and_fills_it"),
            passes("loader::hostile::unreadable_scenes_are_refused"),
        ],
    },
    Case {
        id: "J14",
        what: "Cameras: zfar ≤ znear, yfov ≥ π, aspect 0, NaN",
        expected: "errors",
        verdict: Holds,
        evidence: &[passes("loader::broken_shading::broken_cameras_are_refused")],
    },
    Case {
        id: "J15",
        what: "Sparse, strided, normalised accessors",
        expected: "values as specified",
        verdict: Holds,
        evidence: &[
            passes("loader::geometry::sparse_accessors_replace_values_with_and_without_a_base"),
            passes("loader::geometry::interleaved_and_offset_attributes_are_read"),
            passes("loader::geometry::quantized_positions_of_every_type_are_read"),
        ],
    },
    Case {
        id: "J16",
        what: "Unknown required extensions",
        expected: "refused by name",
        verdict: Holds,
        evidence: &[passes(
            "loader::shading::optional_extensions_are_named_and_required_ones_refused",
        )],
    },
    Case {
        id: "J17",
        what: "Data URIs: size, bad base64",
        expected: "an error, memory bounded",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_buffers_and_accessors_are_refused"),
            passes("loader::hostile::hostile_uris_are_refused"),
        ],
    },
    Case {
        id: "J18",
        what: "KTX2, WebP, Draco",
        expected: "refused by name",
        verdict: Holds,
        evidence: &[
            passes("loader::shading::optional_extensions_are_named_and_required_ones_refused"),
            passes("loader::broken_shading::broken_materials_and_textures_are_refused"),
        ],
    },
];
