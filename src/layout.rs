//! Structs, bindings and tags shared with the shaders: the twin of
//! `shaders/layout.glsl`, in the same order with the same names. Scalar block
//! layout gives GLSL the offsets of `repr(C)` (`vec3` is twelve bytes).
//! `tests/layout.rs` compares every offset, size and constant. Meanings and
//! units stand in the GLSL file.
#![allow(
    missing_docs,
    reason = "each field is documented once, in shaders/layout.glsl"
)]

/// One struct of the shared layout: its fields' names and offsets, and its size in bytes.
pub struct StructLayout {
    pub name: &'static str,
    pub fields: &'static [(&'static str, usize)],
    pub size: usize,
}

macro_rules! shared {
    ($($name:ident { $($field:ident: $ty:ty,)* })*) => {
        $(
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name { $(pub $field: $ty,)* }
        )*
        /// Every shared struct, for the comparison with the shaders.
        pub const STRUCTS: &[StructLayout] = &[$(StructLayout {
            name: stringify!($name),
            fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
            size: size_of::<$name>(),
        },)*];
    };
}

macro_rules! tags {
    ($($name:ident = $value:expr;)*) => {
        $(pub const $name: u32 = $value;)*
        /// Every shared constant, for the comparison with the shaders.
        pub const CONSTANTS: &[(&str, u32)] = &[$((stringify!($name), $name),)*];
    };
}

shared! {
    Params {
        camera_position: [f32; 3],
        camera_kind: u32,
        camera_right: [f32; 3],
        width: u32,
        camera_up: [f32; 3],
        height: u32,
        camera_forward: [f32; 3],
        window_x: u32,
        env_radiance: [f32; 3],
        env_choice: f32,
        planes_center: [f32; 3],
        window_y: u32,
        planes_extent: [f32; 3],
        window_width: u32,
        window_height: u32,
        tiles_x: u32,
        tiles_y: u32,
        seed_low: u32,
        seed_high: u32,
        max_depth: u32,
        light_count: u32,
        light_uniform: f32,
        table_choice: f32,
        env_width: u32,
        env_height: u32,
        env_cos_rotation: f32,
        env_sin_rotation: f32,
        env_shift: u32,
        bvh_root: u32,
        tree_choice: f32,
        light_nodes: u32,
        light_keys: u32,
        light_key_count: u32,
    }
    Batch {
        first_sample_low: u32,
        first_sample_high: u32,
        sample_count: u32,
        first_tile: u32,
        tile_count: u32,
        is_shared: u32,
        film_first_pixel: u32,
        is_together: u32,
        taken: u32,
    }
    Instance {
        world_from_object_x: [f32; 3],
        first_triangle: u32,
        world_from_object_y: [f32; 3],
        bvh_root: u32,
        world_from_object_z: [f32; 3],
        bvh_first_triangle: u32,
        world_from_object_t: [f32; 3],
        is_identity: u32,
        object_from_world_x: [f32; 3],
        is_mirrored: u32,
        object_from_world_y: [f32; 3],
        reserved_0: u32,
        object_from_world_z: [f32; 3],
        reserved_1: u32,
        object_from_world_t: [f32; 3],
        reserved_2: u32,
    }
    Plane {
        normal: [f32; 3],
        offset: f32,
        u: [f32; 3],
        u_offset: f32,
        v: [f32; 3],
        v_offset: f32,
        t_error: f32,
        edge_error: f32,
        record: u32,
        first_triangle: u32,
        second_triangle: u32,
        reserved_0: u32,
        reserved_1: u32,
        reserved_2: u32,
    }
    Material {
        base_color: [f32; 3],
        flags: u32,
        emission: [f32; 3],
        emission_pdf: f32,
        alpha: f32,
        alpha_cutoff: f32,
        metallic: f32,
        roughness: f32,
        specular_color: [f32; 3],
        specular: f32,
        normal_scale: f32,
        first_texture: u32,
        transmission: f32,
        ior: f32,
    }
    Medium {
        sigma_t: [f32; 3],
        phase: u32,
        sigma_s: [f32; 3],
        g: f32,
        ior: f32,
        rank: u32,
        reserved_0: u32,
        reserved_1: u32,
    }
    TextureUse {
        uv_row_u: [f32; 3],
        first_texel: u32,
        uv_row_v: [f32; 3],
        width: u32,
        height: u32,
        format: u32,
        uv_set: u32,
        reserved_0: u32,
    }
    Light {
        kind: u32,
        alias: u32,
        keep: f32,
        choice: f32,
        position: [f32; 3],
        material: u32,
        edge1: [f32; 3],
        triangle: u32,
        edge2: [f32; 3],
        cos_inner: f32,
        direction: [f32; 3],
        cos_outer: f32,
        intensity: [f32; 3],
        emission_pdf: f32,
    }
    EnvCell {
        last: u32,
        cell: u32,
    }
    ProbeRay {
        origin: [f32; 3],
        t_min: f32,
        direction: [f32; 3],
        t_max: f32,
        from: u32,
    }
    ProbeHit {
        t: f32,
        bary: [f32; 2],
        instance: u32,
        primitive: u32,
        record: u32,
        occluded: u32,
    }
    PhotonStart {
        point: [f32; 3],
        weight: f32,
        normal: [f32; 3],
        offset: f32,
    }
    Photon {
        position: [f32; 3],
        weight: f32,
        direction: [f32; 3],
        direct: f32,
    }
    StreamRay {
        origin: [f32; 3],
        t_max: f32,
        direction: [f32; 3],
        from: u32,
        to: u32,
        flags: u32,
        instance: u32,
        primitive: u32,
        t: f32,
        bary: [f32; 2],
        record: u32,
    }
}

tags! {
    NONE = 0xFFFFFFFF;
    CAMERA_PERSPECTIVE = 0;
    CAMERA_ORTHOGRAPHIC = 1;
    CAMERA_IRRADIANCE = 2;
    CAMERA_FLUX = 3;
    INSTANCE_TEXELS = 8;
    TRIANGLE_MATERIAL_MASK = 0x00FFFFFF;
    TRIANGLE_HAS_NORMALS = 0x80000000;
    TRIANGLE_HAS_TANGENTS = 0x40000000;
    TRIANGLE_HAS_COLORS = 0x20000000;
    TRIANGLE_IS_MASKED = 0x10000000;
    PLANE_TEXELS = 5;
    PLANES_MAX = 32;
    SMALL_TEXELS = 4096;
    MATERIAL_DOUBLE_SIDED = 1;
    MATERIAL_MASK = 2;
    MATERIAL_BLEND = 4;
    MATERIAL_HAS_TEXTURES = 8;
    MATERIAL_UNLIT = 16;
    MATERIAL_EMISSIVE = 32;
    MATERIAL_SOLID = 64;
    MATERIAL_TEXELS = 5;
    TEXTURE_BASE_COLOR = 0;
    TEXTURE_METALLIC_ROUGHNESS = 1;
    TEXTURE_NORMAL = 2;
    TEXTURE_EMISSION = 3;
    TEXTURE_SPECULAR = 4;
    TEXTURE_SPECULAR_COLOR = 5;
    TEXTURE_TRANSMISSION = 6;
    TEXTURE_SLOTS = 7;
    PHASE_HENYEY_GREENSTEIN = 0;
    PHASE_RAYLEIGH = 1;
    MEDIUM_TEXELS = 3;
    TEXTURE_USE_TEXELS = 3;
    FORMAT_RGBA8 = 0;
    FORMAT_SRGB8 = 1;
    FORMAT_RGBA16 = 2;
    WRAP_REPEAT = 0;
    WRAP_MIRROR = 1;
    WRAP_CLAMP = 2;
    FILTER_NEAREST = 0;
    FILTER_LINEAR = 1;
    TEXTURE_KIND_SRGB = 8;
    TEXTURE_KIND_RGBA16 = 16;
    TEXTURE_KIND_MIRROR = 17;
    TEXTURE_KIND_CLAMP = 18;
    TEXTURE_KIND_NEAREST = 19;
    TEXTURE_KIND_LINEAR = 20;
    SRGB_TABLE = 256;
    LIGHT_TRIANGLE = 0;
    LIGHT_POINT = 1;
    LIGHT_SPOT = 2;
    LIGHT_DIRECTIONAL = 3;
    LIGHT_TEXELS = 6;
    LIGHT_NODE_TEXELS = 4;
    LIGHT_LEAF = 0x80000000;
    LIGHT_LEAF_COUNT_SHIFT = 28;
    LIGHT_LEAF_FIRST_MASK = 0x0FFFFFFF;
    LIGHT_PLAIN = 0x80000000;
    LIGHT_DOUBLE_SIDED = 0x40000000;
    LIGHT_MIRRORED = 0x20000000;
    GUIDE_AXIS_MASK = 3;
    GUIDE_LEAF = 3;
    GUIDE_LINK_SHIFT = 2;
    GUIDE_DEPTH = 32;
    GUIDE_LOBES = 4;
    STREAM_RAY_TEXELS = 4;
    STREAM_IS_FIRST = 1;
    STREAM_IS_SHADOW = 2;
    FILM_FLOATS = 9;
    FILM_FLOATS_AOV = 18;
    LEDGER_NON_FINITE = 0;
    LEDGER_TRUNCATED = 1;
    LEDGER_RAYS_LOW = 2;
    LEDGER_RAYS_HIGH = 3;
    LEDGER_THROUGHPUT_LOW = 4;
    LEDGER_THROUGHPUT_HIGH = 5;
    LEDGER_INTERIOR_OVERFLOWS = 6;
    LEDGER_NODES_LOW = 7;
    LEDGER_RECORDS_LOW = 9;
    LEDGER_STEPS_LOW = 11;
    LEDGER_LANES_LOW = 13;
    LEDGER_TAKEN = 15;
    LEDGER_DIFFERENT = 16;
    LEDGER_SIZE = 17;
    TILE = 8;
    SHARE_WIDTH = 4;
    SHARE_HEIGHT = 2;
    SHARE_COUNT = 8;
    BLOCK_LEVEL = 4;
    NET_LEVEL = 8;
    BIND_PARAMS = 0;
    BIND_FILM = 1;
    BIND_LEDGER = 2;
    BIND_INSTANCES = 3;
    BIND_TRIANGLES = 4;
    BIND_VERTICES = 5;
    BIND_ATTRIBUTES = 6;
    BIND_MATERIALS = 7;
    BIND_TEXTURE_USES = 8;
    BIND_TEXELS = 9;
    BIND_LIGHTS = 10;
    BIND_ENV_MAP = 11;
    BIND_ENV_TABLE = 12;
    BIND_SCENE = 13;
    BIND_BVH_NODES = 14;
    BIND_BVH_TRIANGLES = 15;
    BIND_MEDIA = 16;
    BIND_PROBE_RAYS = 17;
    BIND_PROBE_HITS = 18;
    BIND_PLANES = 19;
    BIND_SMALL_NODES = 20;
    BIND_SMALL_RECORDS = 21;
    BIND_ALLOTMENT = 22;
    BIND_ADDRESSES = 23;
    BIND_STREAM = 24;
    BIND_STREAM_STARTS = 25;
    BIND_STREAM_COUNTS = 26;
    BIND_GUIDE = 27;
    BIND_PHOTON_STARTS = 28;
    BIND_PHOTONS = 29;
    ADDRESSES_SIZE = 30;
}
