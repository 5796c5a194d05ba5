// Structs, bindings and tags shared with the host: the twin of src/layout.rs.
// Order, names and types must match; tests/layout.rs compares every offset.
// Lengths in metres; positions are relative to Params.origin_* of the host.

#ifndef LAYOUT_GLSL
#define LAYOUT_GLSL

#extension GL_EXT_scalar_block_layout : require

const uint NONE = 0xFFFFFFFFu;

// --- Params: one per render ------------------------------------------------

const uint CAMERA_PERSPECTIVE = 0u;
const uint CAMERA_ORTHOGRAPHIC = 1u;
const uint CAMERA_IRRADIANCE = 2u;  // a white Lambert surface at camera_position that faces camera_forward; HAS_SENSOR
const uint CAMERA_FLUX = 3u;        // everything that leaves a sphere about camera_position; HAS_SENSOR

struct Params {
    vec3 camera_position;    // perspective: pinhole; orthographic: centre of the image plane
    uint camera_kind;        // CAMERA_*
    vec3 camera_right;       // image x axis, scaled to half the image's width (at distance 1 when perspective); sensors: x is the scene's radius
    uint width;              // full frame, pixels
    vec3 camera_up;          // image y axis, scaled to half the height
    uint height;             // full frame, pixels
    vec3 camera_forward;     // unit
    uint window_x;           // first column rendered
    vec3 env_radiance;       // factor on the map, or the constant radiance
    float env_choice;        // probability that direct light samples the map
    vec3 planes_center;      // where coordinates of Plane start
    uint window_y;           // first row rendered
    vec3 planes_extent;      // distance from there, along each axis, at which rays that are tested may start
    uint window_width;       // columns rendered
    uint window_height;      // rows rendered
    uint tiles_x;            // tiles of 8 × 8 pixels across the window
    uint tiles_y;
    uint seed_low;
    uint seed_high;
    uint max_depth;          // NONE: unlimited
    uint light_count;        // entries of the light table
    float light_uniform;     // > 0: every entry of the table is chosen with this probability (textbook)
    float table_choice;      // probability that direct light samples the table; 1 − env_choice, or 0 without lights
    uint env_width;          // 0: constant
    uint env_height;
    float env_cos_rotation;
    float env_sin_rotation;
    uint env_shift;          // log₂ of the places in a run of the table
    uint bvh_root;           // first node of the top level (of the only level without instances)
    // With HAS_LIGHT_TREE:
    float tree_choice;       // probability that direct light samples the tree; table_choice is then for distant lights
    uint light_nodes;        // texels in `lights`: of the root …
    uint light_keys;         // … and of the first key
    uint light_key_count;    // emissive triangles
};

// --- Push constants: one per batch -----------------------------------------

struct Batch {
    uint first_sample_low;   // global sample index
    uint first_sample_high;
    uint sample_count;       // a power of two that divides the first sample's index
    uint first_tile;         // tiles run row by row through the window
    uint tile_count;
    uint is_shared;          // 1: invocations take pixels until none is left; 0: each has one
    uint film_first_pixel;   // the film buffer starts at this pixel of the window
    uint is_together;        // 1: the lanes of a subgroup start their samples together
    uint taken;              // LEDGER_TAKEN before
};

// --- Geometry ----------------------------------------------------------------

// A group is a list of triangles with one acceleration structure: all meshes that
// are placed once (already in world space), or one mesh that is placed often.
struct Instance {
    vec3 world_from_object_x; // columns of the 4 × 3 matrix
    uint first_triangle;      // of the group, in `triangles`
    vec3 world_from_object_y;
    uint bvh_root;            // own BVH: first node of the group
    vec3 world_from_object_z;
    uint bvh_first_triangle;  // own BVH: first record of the group in `bvh_triangles`
    vec3 world_from_object_t;
    uint is_identity;         // 1: the group is in world space
    vec3 object_from_world_x;
    uint is_mirrored;         // 1: the determinant is negative
    vec3 object_from_world_y;
    uint reserved_0;
    vec3 object_from_world_z;
    uint reserved_1;
    vec3 object_from_world_t;
    uint reserved_2;
};
const uint INSTANCE_TEXELS = 8u;

// `triangles` holds (vertex, vertex, vertex, material | TRIANGLE_* flags).
const uint TRIANGLE_MATERIAL_MASK = 0x00FFFFFFu;
const uint TRIANGLE_HAS_NORMALS = 0x80000000u;
const uint TRIANGLE_HAS_TANGENTS = 0x40000000u;
const uint TRIANGLE_HAS_COLORS = 0x20000000u;
// With HAS_CANDIDATES: traversal asks surface_is_opaque of this triangle, which may be cut out or skipped.
const uint TRIANGLE_IS_MASKED = 0x10000000u;

// `vertices` holds two texels each: (position, u), (normal, v).
// `attributes`, when present, three texels for each vertex: tangent, colour, (u1, v1, 0, 0).

// A parallelogram or a triangle of the own BVH, whose rays are tested against all of them (traverse_planes.glsl).
// A position, from Params.planes_center, is on it where normal · p + offset = 0 and its coordinates u · p + u_offset and
// v · p + v_offset are between -1 and 1, or are weights of the second and third corner.
struct Plane {
    vec3 normal;              // unit
    float offset;             // metres
    vec3 u;                   // 1/m
    float u_offset;
    vec3 v;                   // 1/m
    float v_offset;
    float t_error;            // bound on the error of a distance, for rays along the normal, metres
    float edge_error;         // the same of coordinates
    uint record;              // names what lies in its plane, as Hit.record
    uint first_triangle;      // of the group …
    uint second_triangle;     // … and the other half; the same where there is none
    uint reserved_0;
    uint reserved_1;
    uint reserved_2;
};
const uint PLANE_TEXELS = 5u;
const uint PLANES_MAX = 32u;
const uint SMALL_TEXELS = 4096u; // of a uniform buffer of 64 KiB

// --- Materials ---------------------------------------------------------------

const uint MATERIAL_DOUBLE_SIDED = 1u;
const uint MATERIAL_MASK = 2u;
const uint MATERIAL_BLEND = 4u;
const uint MATERIAL_HAS_TEXTURES = 8u;
const uint MATERIAL_UNLIT = 16u;
const uint MATERIAL_EMISSIVE = 32u;     // emission_pdf > 0
const uint MATERIAL_SOLID = 64u;        // bounds a solid: its back is the inside

// Read as five texels (scene.glsl), so every fourth word starts a group.
struct Material {
    vec3 base_color;
    uint flags;                 // MATERIAL_*
    vec3 emission;              // radiance, cd/m²
    float emission_pdf;         // probability density of a point on it among all points of the light table, 1/m²
    float alpha;
    float alpha_cutoff;
    float metallic;
    float roughness;            // perceptual
    vec3 specular_color;        // tint of the dielectric reflection
    float specular;             // strength: scales F0 and is F90
    float normal_scale;
    uint first_texture;         // of TEXTURE_SLOTS entries in `texture_uses`; only with MATERIAL_HAS_TEXTURES
    float transmission;         // share of what is not metal that transmits like a dielectric
    float ior;                  // index of refraction; 0: infinite
};
const uint MATERIAL_TEXELS = 5u;

// Slots of a textured material, in order.
const uint TEXTURE_BASE_COLOR = 0u;
const uint TEXTURE_METALLIC_ROUGHNESS = 1u;
const uint TEXTURE_NORMAL = 2u;
const uint TEXTURE_EMISSION = 3u;
const uint TEXTURE_SPECULAR = 4u;
const uint TEXTURE_SPECULAR_COLOR = 5u;
const uint TEXTURE_TRANSMISSION = 6u;
const uint TEXTURE_SLOTS = 7u;

// --- Media ---------------------------------------------------------------------

const uint PHASE_HENYEY_GREENSTEIN = 0u; // g = 0: isotropic
const uint PHASE_RAYLEIGH = 1u;

// What fills a solid, and how the solid takes part: entry 0 is the space outside
// all solids, entry 1 + m the inside of solids with material m. Read as three texels.
struct Medium {
    vec3 sigma_t;               // extinction coefficient σ_a + σ_s, 1/m
    uint phase;                 // PHASE_*
    vec3 sigma_s;               // scattering coefficient, 1/m
    float g;                    // mean cosine
    float ior;                  // index of refraction; 0: infinite
    uint rank;                  // where solids overlap, the highest fills the space; above 0
    uint reserved_0;
    uint reserved_1;
};
const uint MEDIUM_TEXELS = 3u;

// A texture applied to a slot, read as three texels. `first_texel` is NONE where the slot is empty.
struct TextureUse {
    vec3 uv_row_u;              // u' = row · (u, v, 1)
    uint first_texel;           // in `texels`
    vec3 uv_row_v;
    uint width;
    uint height;
    uint format;                // FORMAT_* | WRAP_* << 4 (u) | WRAP_* << 8 (v) | filter << 12
    uint uv_set;
    uint reserved_0;
};
const uint TEXTURE_USE_TEXELS = 3u;

const uint FORMAT_RGBA8 = 0u;
const uint FORMAT_SRGB8 = 1u;
const uint FORMAT_RGBA16 = 2u;
const uint WRAP_REPEAT = 0u;
const uint WRAP_MIRROR = 1u;
const uint WRAP_CLAMP = 2u;
const uint FILTER_NEAREST = 0u;
const uint FILTER_LINEAR = 1u;
// Bits of TEXTURE_KINDS (spec.glsl): one for each slot that a material fills, one from here on for each that holds FORMAT_SRGB8 …
const uint TEXTURE_KIND_SRGB = 8u;
// … and what any of the textures is.
const uint TEXTURE_KIND_RGBA16 = 16u;
const uint TEXTURE_KIND_MIRROR = 17u;
const uint TEXTURE_KIND_CLAMP = 18u;
const uint TEXTURE_KIND_NEAREST = 19u;
const uint TEXTURE_KIND_LINEAR = 20u;
// `texels` starts with the 256 decoded sRGB values as float bits.
const uint SRGB_TABLE = 256u;

// --- Lights ------------------------------------------------------------------

const uint LIGHT_TRIANGLE = 0u;
const uint LIGHT_POINT = 1u;
const uint LIGHT_SPOT = 2u;
const uint LIGHT_DIRECTIONAL = 3u;

// One entry of the alias table over all lights but the environment; read as six texels.
struct Light {
    uint kind;                  // LIGHT_*
    uint alias;                 // entry to take instead …
    float keep;                 // … with probability 1 − keep
    float choice;               // probability of this light, given that a light of the table is chosen
    vec3 position;              // triangle: its first corner; point, spot: where it is. Metres
    uint material;              // triangle: its material | LIGHT_* flags
    vec3 edge1;                 // triangle: to the second corner
    uint triangle;              // triangle: its index in `triangles`
    vec3 edge2;                 // triangle: to the third corner
    float cos_inner;            // spot
    vec3 direction;             // spot, directional: where it shines to, unit
    float cos_outer;            // spot
    vec3 intensity;             // cd, or lx when directional; triangle: radiance without its texture, cd/m²
    float emission_pdf;         // triangle: as Material's
};
const uint LIGHT_TEXELS = 6u;
// With HAS_LIGHT_TREE the lights of the tree follow those of the table, leaf by leaf with an alias table each, then nodes of four
// texels, two for each child: (centre, radius | sine), (axis x | y << 16, axis z | cosine << 16, intensity, link). Sine and cosine are
// those of half the cone's angle, 16 bits as packUnorm2x16 and packSnorm2x16 have them; the radius has upper bits alone, and is what
// the whole word says at most; the intensity is negative where nothing goes beyond the cone. A link
// is a node or LIGHT_LEAF | lights of the leaf − 1 (three bits) | its first light. Keys of one texel, sorted: placement, triangle,
// the way to the leaf (a bit for each step, the first one lowest), power of the leaf.
const uint LIGHT_NODE_TEXELS = 4u;
const uint LIGHT_LEAF = 0x80000000u;
const uint LIGHT_LEAF_COUNT_SHIFT = 28u;
const uint LIGHT_LEAF_FIRST_MASK = 0x0FFFFFFFu;
const uint LIGHT_PLAIN = 0x80000000u;        // `intensity` is all: no texture, vertex colour or alpha enters
const uint LIGHT_DOUBLE_SIDED = 0x40000000u; // emits from both sides
const uint LIGHT_MIRRORED = 0x20000000u;     // the front sees its corners clockwise

// The cells between the centres of four texels of the environment map, env_height + 1 rows, of which each has its share of the
// places from 0 to 2³² − 1. Neighbours on the map are neighbours there. Read as two words.
struct EnvCell {
    uint last;               // of its places; the next cell begins after it
    uint cell;
};

// Before them stand two words for each of 2^(32 − env_shift) equal runs of places: a cell and NONE where it holds the whole
// run, else the entries that hold the run's first place and its last.

// --- Probe: rays in, hits out (tests, identity layers) -------------------------

struct ProbeRay {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
    uint from;                  // record of the hit that the ray leaves, or NONE
};

struct ProbeHit {
    float t;                    // metres; < 0 on a miss
    vec2 bary;                  // weights of the second and third vertex
    uint instance;
    uint primitive;             // within the group
    uint record;                // for `from` of rays that leave the hit
    uint occluded;              // what trace_occluded says of the same ray
};

// --- Guide: where bent light comes from ---------------------------------------------

// Where light may be bent: a point of a mirror or an interface.
struct PhotonStart {
    vec3 point;
    float weight;               // area that it stands for, m²
    vec3 normal;                // of the triangle, unit
    float offset;               // metres, off the surface
};

// Where it is scattered then.
struct Photon {
    vec3 position;
    float weight;               // watts, up to a common factor; 0: it did not arrive
    vec3 direction;             // that it came from, unit
    float direct;               // irradiance by direct light there, one sample of it
};

// A tree over positions, RGBA32UI: the root, then pairs of children, leaves between them. A node is (plane, link << GUIDE_LINK_SHIFT |
// axis, lobes of a leaf, 0). A link is the texel of the first child, below the plane; that of a leaf, with
// the axis GUIDE_LEAF, its box, two texels, and for each lobe (point that it aims at, κ), (weight, 0, 0, 0).
const uint GUIDE_AXIS_MASK = 3u;
const uint GUIDE_LEAF = 3u;
const uint GUIDE_LINK_SHIFT = 2u;
const uint GUIDE_DEPTH = 32u; // of the tree, at most
const uint GUIDE_LOBES = 4u;  // of a leaf, at most

// --- Stream: the rays of a render and what they met (limit report) ---------------

struct StreamRay {
    vec3 origin;
    float t_max;
    vec3 direction;
    uint from;
    uint to;                    // triangle that emits the light, or NONE
    uint flags;                 // STREAM_IS_…
    uint instance;
    uint primitive;             // NONE on a miss
    float t;
    vec2 bary;
    uint record;
};

const uint STREAM_RAY_TEXELS = 4u;
const uint STREAM_IS_FIRST = 1u;  // a sample begins with it
const uint STREAM_IS_SHADOW = 2u; // asked if it meets anything

// --- Film ------------------------------------------------------------------------

// Per pixel of the window, FILM_FLOATS (with HAS_AOVS FILM_FLOATS_AOV) floats: sum of radiance, sum of squared
// deviations from the mean over the batch's samples and what the two nets differ by, then sums of albedo, normal, depth
// and coverage of the first hit, and the number of samples that were dropped.
const uint FILM_FLOATS = 9u;
const uint FILM_FLOATS_AOV = 18u;
// Counters of the ledger.
const uint LEDGER_NON_FINITE = 0u;
const uint LEDGER_TRUNCATED = 1u;
const uint LEDGER_RAYS_LOW = 2u;
const uint LEDGER_RAYS_HIGH = 3u;
// Throughput that truncated paths still carried, mean of the channels, in units of 2⁻¹⁶.
const uint LEDGER_THROUGHPUT_LOW = 4u;
const uint LEDGER_THROUGHPUT_HIGH = 5u;
// Solids that were entered while INTERIOR_SIZE others already held the point.
const uint LEDGER_INTERIOR_OVERFLOWS = 6u;
// Of the kernel that counts (TRACE_COUNTS), two words each: nodes visited, leaf records read, steps of lanes, and
// steps that all lanes of the subgroups had time for.
const uint LEDGER_NODES_LOW = 7u;
const uint LEDGER_RECORDS_LOW = 9u;
const uint LEDGER_STEPS_LOW = 11u;
const uint LEDGER_LANES_LOW = 13u;
// Pixels that have been taken, where they are shared, and one more for each invocation that found none.
const uint LEDGER_TAKEN = 15u;
// Rays of a replay that met something else than is recorded.
const uint LEDGER_DIFFERENT = 16u;
const uint LEDGER_SIZE = 17u;

const uint TILE = 8u;
// Pixels that share what their paths find: a block of the frame, in tiles and in the order of their pixels.
const uint SHARE_WIDTH = 4u;
const uint SHARE_HEIGHT = 2u;
const uint SHARE_COUNT = 8u;
// With HAS_STRATA log₂ of the samples of a block, and of those of a whole net; see rng_key.
const uint BLOCK_LEVEL = 4u;
const uint NET_LEVEL = 8u;

// --- Bindings: one descriptor set ---------------------------------------------------

const uint BIND_PARAMS = 0u;         // uniform buffer: Params
const uint BIND_FILM = 1u;           // storage: float[]
const uint BIND_LEDGER = 2u;         // storage: uint[LEDGER_SIZE]
const uint BIND_INSTANCES = 3u;      // texel buffer RGBA32UI: Instance[]
const uint BIND_TRIANGLES = 4u;      // texel buffer RGBA32UI
const uint BIND_VERTICES = 5u;       // texel buffer RGBA32F
const uint BIND_ATTRIBUTES = 6u;     // texel buffer RGBA32F
const uint BIND_MATERIALS = 7u;      // texel buffer RGBA32UI: Material[]
const uint BIND_TEXTURE_USES = 8u;   // texel buffer RGBA32UI: TextureUse[]
const uint BIND_TEXELS = 9u;         // texel buffer R32UI
const uint BIND_LIGHTS = 10u;        // texel buffer RGBA32UI: Light[]
const uint BIND_ENV_MAP = 11u;       // texel buffer RGBA32F
const uint BIND_ENV_TABLE = 12u;     // runs and EnvCell[], two words each
const uint BIND_SCENE = 13u;         // acceleration structure (ray query)
const uint BIND_BVH_NODES = 14u;     // texel buffer RGBA32UI, five texels a node (own BVH)
const uint BIND_BVH_TRIANGLES = 15u; // texel buffer RGBA32UI, three texels a triangle (own BVH)
const uint BIND_MEDIA = 16u;         // texel buffer RGBA32UI: Medium[]
const uint BIND_PROBE_RAYS = 17u;    // storage: ProbeRay[] (probe kernel)
const uint BIND_PROBE_HITS = 18u;    // storage: ProbeHit[] (probe kernel)
const uint BIND_PLANES = 19u;        // texel buffer RGBA32UI: Plane[], PLANES_MAX at most (own BVH)
const uint BIND_SMALL_NODES = 20u;   // uniform buffer: SMALL_TEXELS of BIND_BVH_NODES, with HAS_SMALL_NODES
const uint BIND_SMALL_RECORDS = 21u; // uniform buffer: SMALL_TEXELS of BIND_BVH_TRIANGLES, with HAS_SMALL_RECORDS
const uint BIND_ALLOTMENT = 22u;     // texel buffer R32UI: an exponent for each pixel of the window, with HAS_ALLOTMENT
const uint BIND_ADDRESSES = 23u;     // uniform buffer: addresses of buffers by their bindings (ADDRESSES)
const uint BIND_STREAM = 24u;        // texel buffer RGBA32UI: StreamRay[]; storage in the kernel that records
const uint BIND_STREAM_STARTS = 25u; // texel buffer R32UI: where the rays of each pixel begin and, one more, where they end
const uint BIND_STREAM_COUNTS = 26u; // storage: rays of each pixel (kernel that records)
const uint BIND_GUIDE = 27u;         // texel buffer RGBA32UI: the tree, with HAS_GUIDE
const uint BIND_PHOTON_STARTS = 28u; // storage: PhotonStart[] (photon kernel)
const uint BIND_PHOTONS = 29u;       // storage: Photon[] (photon kernel)
const uint ADDRESSES_SIZE = 30u;

#endif
