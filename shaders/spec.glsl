// What a scene needs, frozen when the pipeline is made: the twin of src/spec.rs.
// A feature that is off leaves no instruction behind.

#ifndef SPEC_GLSL
#define SPEC_GLSL

layout(constant_id = 0) const bool HAS_TEXTURES = true;
layout(constant_id = 1) const bool HAS_ALPHA = true;       // cut-outs
layout(constant_id = 2) const bool HAS_BLEND = true;       // partial coverage
layout(constant_id = 3) const bool HAS_SPECULAR = true;    // any material that is not pure Lambert
layout(constant_id = 4) const bool HAS_NORMALS = true;     // shading normals
layout(constant_id = 5) const bool HAS_ATTRIBUTES = true;  // tangents, vertex colours or a second set of coordinates
layout(constant_id = 6) const bool HAS_ENVIRONMENT = true; // a map, not a constant
layout(constant_id = 7) const bool HAS_AREA_LIGHTS = true; // emissive triangles
layout(constant_id = 8) const bool HAS_PUNCTUAL = true;    // point, spot, directional
layout(constant_id = 9) const bool HAS_INSTANCES = true;   // groups that are not in world space
layout(constant_id = 10) const bool HAS_AOVS = true;
layout(constant_id = 12) const bool HAS_PASSAGE = true;    // shadow rays go through surfaces that let light straight through
#ifdef SHARE
// Pixels share in scenes of opaque surfaces only.
const bool HAS_DIELECTRIC = false;
const bool HAS_NESTED = false;
const bool HAS_INSIDE = false;
const bool HAS_MEDIA = false;
const bool HAS_SCATTERING = false;
const bool HAS_EQUIANGULAR = false;
const bool HAS_SENSOR = false;
#else
layout(constant_id = 11) const bool HAS_DIELECTRIC = true; // any material that transmits
layout(constant_id = 13) const bool HAS_NESTED = true;     // solids that may overlap or touch
layout(constant_id = 14) const bool HAS_INSIDE = true;     // the camera may be inside a solid
layout(constant_id = 15) const bool HAS_MEDIA = true;      // anything that absorbs or scatters
layout(constant_id = 16) const bool HAS_SCATTERING = true; // media that scatter
layout(constant_id = 17) const bool HAS_EQUIANGULAR = true; // distances in them are also sampled by the lights
layout(constant_id = 18) const bool HAS_SENSOR = true;      // a light meter that is no camera
#endif
layout(constant_id = 19) const bool HAS_STRATA = false;     // samples of a block are a net, not independent
layout(constant_id = 20) const bool HAS_LIGHT_TREE = false; // lights are chosen by where they are needed
layout(constant_id = 21) const uint STRATEGY = 0u;         // STRATEGY_*
// Flat pieces that are all tested before the own tree is walked (traverse_planes.glsl): the first ones, and the others.
layout(constant_id = 22) const uint PARALLELOGRAM_COUNT = 0u;
layout(constant_id = 23) const uint TRIANGLE_COUNT = 0u;
layout(constant_id = 24) const uint TEXTURE_KINDS = 0xFFFFFFFFu; // which slots are filled, and with what: TEXTURE_KIND_*

layout(constant_id = 25) const bool HAS_BOXES = false; // the device's structures hold boxes, and shaders test the triangles
layout(constant_id = 26) const bool HAS_SMALL_NODES = false;   // of the own tree: all nodes fit a uniform buffer
layout(constant_id = 27) const bool HAS_SMALL_RECORDS = false; // so do its records
layout(constant_id = 28) const bool HAS_ALLOTMENT = false; // pixels take different numbers of samples
#ifdef WGPU
const bool HAS_GUIDE = false;
#else
layout(constant_id = 29) const bool HAS_GUIDE = true;      // photons tell where bent light comes from
#endif

// Pieces whose normals and gradients of coordinates have nothing along an axis, a bit each: what is known costs nothing.
layout(constant_id = 30) const uint NORMAL_WITHOUT_X = 0u;
layout(constant_id = 31) const uint NORMAL_WITHOUT_Y = 0u;
layout(constant_id = 32) const uint NORMAL_WITHOUT_Z = 0u;
layout(constant_id = 33) const uint U_WITHOUT_X = 0u;
layout(constant_id = 34) const uint U_WITHOUT_Y = 0u;
layout(constant_id = 35) const uint U_WITHOUT_Z = 0u;
layout(constant_id = 36) const uint V_WITHOUT_X = 0u;
layout(constant_id = 37) const uint V_WITHOUT_Y = 0u;
layout(constant_id = 38) const uint V_WITHOUT_Z = 0u;

// Traversals ask surface_is_opaque of triangles that are marked.
const bool HAS_CANDIDATES = HAS_ALPHA || HAS_NESTED;

const uint STRATEGY_MIS = 0u;
const uint STRATEGY_LIGHT_ONLY = 1u;
const uint STRATEGY_BSDF_ONLY = 2u;

#endif
