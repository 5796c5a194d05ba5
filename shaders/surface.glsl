// From a hit to what shading needs: position with its error, normals, material
// with its textures. Everything is in world space; normals face the side that
// wo is on.
//
// [Schuessler17] Schüßler et al., Microfacet-based Normal Mapping, on why a
// shading normal can make visible points black.

#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#include "math.glsl"
#include "texture.glsl"
#include "traverse.glsl"

// Roundings in a hit point, relative to the magnitudes that enter it: three in
// the edge form, one in the vertices' own transform, doubled for safety.
const float POSITION_ROUNDINGS = 8.0;
// Smallest cosine of wo to the shading normal, and of its mirror image to the
// geometric one; see surface_bend.
const float MIN_SHADING_COSINE = 1.0e-3;
// Rays that go straight on through a surface start on their own line if its cosine to the normal is larger; see surface_step.
const float MIN_STRAIGHT_COSINE = 0.1;

struct SurfacePoint {
    vec3 position;
    vec3 start;        // of rays: the position, kept within the triangle
    vec3 error;        // bound on the error of each component of position
    uint record;       // of the hit: what a ray that starts here does not meet
    vec3 ng;           // unit geometric normal on the side of wo
    vec3 ns;           // unit shading normal; dot(ns, wo) > 0
    bool is_front;     // wo is on the side that the winding calls front
    float area;        // of the triangle, m²
    float alpha;       // coverage: 1 unless the material blends
    vec3 emission;     // radiance towards wo, cd/m²
    float emission_pdf;
    uint placement;    // of the group, and the triangle in `triangles`; with HAS_LIGHT_TREE, of what emits
    uint triangle;
    vec3 base_color;
    float metallic;
    float roughness;   // perceptual
    vec3 dielectric_f0;
    float dielectric_f90;
    uint material;     // its record
    bool is_solid;     // bounds a solid, whose inside is the back; else a transmissive surface is a sheet
    float edge;        // with HAS_NESTED, metres from the triangle's nearest edge
    float transmission; // share of what is not metal that transmits like a dielectric
    float ior;         // of the solid or the sheet; 0 is infinite
    vec3 strength;     // factor on a dielectric's reflection
};

// World-space corner and edges of a triangle, with the error of points on it.
struct TriangleShape {
    vec3 v0;
    vec3 e1;
    vec3 e2;
    vec3 error;
    bool is_mirrored;
};

// Texture coordinates of the corners.
struct TriangleUv {
    vec2 a;
    vec2 b;
    vec2 c;
};

uvec4 surface_triangle(uint instance, uint primitive)
{
    uint first = HAS_INSTANCES ? scene_instance(instance).first_triangle : 0u;
    return texelFetch(triangles, int(first + primitive));
}

// Corners in the space of their group.
void surface_corners_of(uvec4 triangle, out vec3 a, out vec3 b, out vec3 c)
{
    a = texelFetch(vertices, int(2u * triangle.x)).xyz;
    b = texelFetch(vertices, int(2u * triangle.y)).xyz;
    c = texelFetch(vertices, int(2u * triangle.z)).xyz;
}

void surface_corners(uint instance, uint primitive, out vec3 a, out vec3 b, out vec3 c)
{
    surface_corners_of(surface_triangle(instance, primitive), a, b, c);
}

// Squares of edges over area up to which a triangle is not thin, and beyond which no more is added.
const float PLAIN_THINNESS = 8.0;
const float MAX_THINNESS = 1.0e4;
// Share of a triangle's height by which starts of rays are moved from an edge at most; see surface_within.
const float MAX_INSET = 1.0 / 64.0;

// Bound on the error of each component of a point computed by the edge form,
// where `magnitude` bounds the terms that were summed, and on that of the distance
// at which a traversal meets the triangle. A point may gain as much
// across the plane as the edges are long: the largest component of the edges
// enters everywhere, so that an axis-aligned plane through 0 is left as well.
// The plane of a thin triangle is lost by edge² over area, since weights are: an
// eighth of what that exceeds the plain held for 1.6e7 rays from triangles 5 to 2000 times as long as high.
vec3 surface_error(vec3 magnitude, vec3 e1, vec3 e2)
{
    float edge = max_component(abs(e1) + abs(e2));
    float thinness = smaller(edge * (edge / length(cross(e1, e2))), MAX_THINNESS);
    float share = 0.25 + 0.125 * larger(thinness - PLAIN_THINNESS, 0.0);
    return vec3(POSITION_ROUNDINGS * EPSILON) * (magnitude + share * edge);
}

TriangleShape surface_shape(uint instance, uvec4 triangle)
{
    vec3 a, b, c;
    surface_corners_of(triangle, a, b, c);
    TriangleShape shape;
    shape.is_mirrored = false;
    vec3 magnitude = larger(abs(a), larger(abs(b), abs(c)));
    if (HAS_INSTANCES && scene_instance(instance).is_identity == 0u) {
        Instance placed = scene_instance(instance);
        mat3 m = mat3(placed.world_from_object_x, placed.world_from_object_y, placed.world_from_object_z);
        shape.v0 = m * a + placed.world_from_object_t;
        shape.e1 = m * (b - a);
        shape.e2 = m * (c - a);
        // Roundings of the transform count against its largest terms.
        magnitude = mat3(abs(m[0]), abs(m[1]), abs(m[2])) * magnitude + abs(placed.world_from_object_t);
        shape.is_mirrored = placed.is_mirrored != 0u;
    } else {
        shape.v0 = a;
        shape.e1 = b - a;
        shape.e2 = c - a;
    }
    shape.error = surface_error(magnitude, shape.e1, shape.e2);
    return shape;
}

TriangleUv surface_uv(uvec4 triangle, uint set)
{
    if (HAS_ATTRIBUTES && set == 1u) {
        return TriangleUv(texelFetch(attributes, int(3u * triangle.x + 2u)).xy,
                          texelFetch(attributes, int(3u * triangle.y + 2u)).xy,
                          texelFetch(attributes, int(3u * triangle.z + 2u)).xy);
    }
    return TriangleUv(vec2(texelFetch(vertices, int(2u * triangle.x)).w, texelFetch(vertices, int(2u * triangle.x + 1u)).w),
                      vec2(texelFetch(vertices, int(2u * triangle.y)).w, texelFetch(vertices, int(2u * triangle.y + 1u)).w),
                      vec2(texelFetch(vertices, int(2u * triangle.z)).w, texelFetch(vertices, int(2u * triangle.z + 1u)).w));
}

vec2 surface_uv_at(TriangleUv uv, vec2 bary)
{
    return uv.a + bary.x * (uv.b - uv.a) + bary.y * (uv.c - uv.a);
}

// Value of a texture slot, or 1 where it is empty.
vec4 surface_texture(Material material, uint slot, uvec4 triangle, vec2 bary)
{
    if (!HAS_TEXTURES || !texture_may(slot)) {
        return vec4(1.0);
    }
    // Before any branch: all slots share the first set.
    vec2 uv = surface_uv_at(surface_uv(triangle, 0u), bary);
    if ((material.flags & MATERIAL_HAS_TEXTURES) == 0u) {
        return vec4(1.0);
    }
    TextureUse use = scene_texture_use(material.first_texture + slot);
    if (use.first_texel == NONE) {
        return vec4(1.0);
    }
    if (HAS_ATTRIBUTES && use.uv_set == 1u) {
        uv = surface_uv_at(surface_uv(triangle, 1u), bary);
    }
    return texture_sample(use, slot, uv);
}

vec4 surface_vertex_color(uvec4 triangle, vec2 bary)
{
    if (!HAS_ATTRIBUTES || (triangle.w & TRIANGLE_HAS_COLORS) == 0u) {
        return vec4(1.0);
    }
    vec4 a = texelFetch(attributes, int(3u * triangle.x + 1u));
    vec4 b = texelFetch(attributes, int(3u * triangle.y + 1u));
    vec4 c = texelFetch(attributes, int(3u * triangle.z + 1u));
    return a + bary.x * (b - a) + bary.y * (c - a);
}

// Base colour with alpha before it is interpreted.
vec4 surface_base_color(Material material, uvec4 triangle, vec2 bary)
{
    return vec4(material.base_color, material.alpha)
        * surface_texture(material, TEXTURE_BASE_COLOR, triangle, bary) * surface_vertex_color(triangle, bary);
}

// What a solid's boundary is, without its shading.
struct SurfaceSide {
    uint material;
    bool is_solid;
    float edge;    // metres from the triangle's nearest edge
    bool is_front; // a ray along d comes from the side that the winding calls front
};

// Metres from a place on a triangle to its nearest edge.
float surface_edge(TriangleShape shape, float doubled_area, vec2 bary)
{
    vec3 weights = vec3(1.0 - bary.x - bary.y, bary);
    vec3 distances = doubled_area * weights / vec3(length(shape.e2 - shape.e1), length(shape.e2), length(shape.e1));
    return smaller(distances.x, smaller(distances.y, distances.z));
}

SurfaceSide surface_side(Hit hit, vec3 d)
{
    uvec4 triangle = surface_triangle(hit.instance, hit.primitive);
    TriangleShape shape = surface_shape(hit.instance, triangle);
    vec3 cross_edges = cross(shape.e1, shape.e2);
    SurfaceSide side;
    side.material = triangle.w & TRIANGLE_MATERIAL_MASK;
    side.is_solid = (scene_material(side.material).flags & MATERIAL_SOLID) != 0u;
    side.is_front = (dot(cross_edges, d) <= 0.0) != shape.is_mirrored;
    side.edge = surface_edge(shape, length(cross_edges), hit.bary);
    return side;
}

bool surface_is_skipped(uint instance, uint primitive)
{
    if (!surface_skip.is_search) {
        return uvec2(instance, primitive) == surface_skip.triangle;
    }
    uvec4 triangle = surface_triangle(instance, primitive);
    uint material = triangle.w & TRIANGLE_MATERIAL_MASK;
    bool is_solid = (scene_material(material).flags & MATERIAL_SOLID) != 0u;
    return is_solid ? !surface_skip_asks(uvec2(material, instance)) : surface_skip.is_closed;
}

// Whether a triangle's material leaves out this place.
bool surface_is_cut(uint instance, uint primitive, vec2 bary)
{
    if (!HAS_ALPHA) {
        return false;
    }
    uvec4 triangle = surface_triangle(instance, primitive);
    Material material = scene_material(triangle.w & TRIANGLE_MATERIAL_MASK);
    return surface_base_color(material, triangle, bary).a < material.alpha_cutoff;
}

bool surface_is_opaque(uint instance, uint primitive, vec2 bary)
{
    return !(HAS_NESTED && surface_is_skipped(instance, primitive)) && !surface_is_cut(instance, primitive, bary);
}

// Radiance that leaves a point of an emitter, before its side is asked.
vec3 surface_emission(Material material, uvec4 triangle, vec2 bary)
{
    vec3 emission = material.emission * surface_texture(material, TEXTURE_EMISSION, triangle, bary).rgb;
    // Unlit materials show their base colour, of which vertex colours are a part.
    return (material.flags & MATERIAL_UNLIT) != 0u ? emission * surface_vertex_color(triangle, bary).rgb : emission;
}

// The normal n turned until it is visible and mirrors wo to above the surface:
// an interpolated or mapped normal may face away at grazing view, or point its
// lobe below the horizon, and the point would be black. A normal that equals ng
// is left as it is.
vec3 surface_bend(vec3 n, vec3 ng, vec3 wo)
{
    float least = smaller(MIN_SHADING_COSINE, 0.9 * dot(ng, wo));
    float cosine = dot(n, wo);
    if (cosine < least) {
        n = normalize(n + (least - cosine) * wo);
        cosine = dot(n, wo);
    }
    vec3 mirrored = 2.0 * cosine * n - wo;
    float height = dot(mirrored, ng);
    return height >= least ? n : normalize(wo + normalize(mirrored + (least - height) * ng));
}

// Object-space direction of a normal carried to world space, not normalised.
vec3 surface_world_normal(uint instance, vec3 n)
{
    if (HAS_INSTANCES && scene_instance(instance).is_identity == 0u) {
        Instance placed = scene_instance(instance);
        return vec3(dot(placed.object_from_world_x, n), dot(placed.object_from_world_y, n), dot(placed.object_from_world_z, n));
    }
    return n;
}

// Mapped normal about the unit normal n of the front side. The bitangent points
// against dp/dv, since v grows downwards in an image and green is up.
vec3 surface_mapped_normal(Material material, uint instance, uvec4 triangle, TriangleShape shape, vec2 bary, vec3 n)
{
    TextureUse use = scene_texture_use(material.first_texture + TEXTURE_NORMAL);
    if (use.first_texel == NONE) {
        return n;
    }
    TriangleUv uv = surface_uv(triangle, use.uv_set);
    vec3 m = texture_sample(use, TEXTURE_NORMAL, surface_uv_at(uv, bary)).xyz * 2.0 - 1.0;
    m.xy *= material.normal_scale;

    vec3 tangent;
    float sign_b;
    if (HAS_ATTRIBUTES && (triangle.w & TRIANGLE_HAS_TANGENTS) != 0u) {
        vec4 a = texelFetch(attributes, int(3u * triangle.x));
        vec4 b = texelFetch(attributes, int(3u * triangle.y));
        vec4 c = texelFetch(attributes, int(3u * triangle.z));
        tangent = a.xyz + bary.x * (b.xyz - a.xyz) + bary.y * (c.xyz - a.xyz);
        if (HAS_INSTANCES && scene_instance(instance).is_identity == 0u) {
            Instance placed = scene_instance(instance);
            tangent = mat3(placed.world_from_object_x, placed.world_from_object_y, placed.world_from_object_z) * tangent;
        }
        sign_b = shape.is_mirrored ? -a.w : a.w;
    } else {
        vec2 d1 = uv.b - uv.a;
        vec2 d2 = uv.c - uv.a;
        float det = d1.x * d2.y - d2.x * d1.y;
        float sign_det = det < 0.0 ? -1.0 : 1.0;
        tangent = sign_det * (d2.y * shape.e1 - d1.y * shape.e2);
        vec3 dpdv = sign_det * (d1.x * shape.e2 - d2.x * shape.e1);
        sign_b = dot(cross(n, tangent), dpdv) > 0.0 ? -1.0 : 1.0;
    }
    tangent -= n * dot(n, tangent);
    float length2 = dot(tangent, tangent);
    if (!(length2 > 0.0)) {
        return n;
    }
    tangent *= inversesqrt(length2);
    vec3 mapped = m.x * tangent + m.y * sign_b * cross(n, tangent) + m.z * n;
    float mapped2 = dot(mapped, mapped);
    return mapped2 > 0.0 ? mapped * inversesqrt(mapped2) : n;
}

// A white Lambert surface, without its place.
SurfacePoint surface_white()
{
    SurfacePoint s;
    s.record = NONE;
    s.is_front = true;
    s.area = 0.0;
    s.alpha = 1.0;
    s.emission = vec3(0.0);
    s.emission_pdf = 0.0;
    s.placement = s.triangle = 0u;
    s.base_color = vec3(1.0);
    s.metallic = 0.0;
    s.roughness = 1.0;
    s.dielectric_f0 = vec3(0.0);
    s.dielectric_f90 = 0.0;
    s.material = NONE;
    s.is_solid = false;
    s.transmission = 0.0;
    s.ior = 1.0;
    s.edge = 0.0;
    s.strength = vec3(1.0);
    return s;
}

// From s to where a ray along d that goes straight on starts: as far off the surface as offset_origin() goes, and on the
// ray's line, so that thousands of such steps do not carry it aside. At grazing incidence the line is near the surface for long, and it starts beside it.
vec3 surface_step(SurfacePoint s, vec3 d)
{
    float height = dot(abs(s.ng), s.error);
    float cosine = -dot(s.ng, d);
    return cosine > MIN_STRAIGHT_COSINE ? (height / cosine) * d : -height * s.ng;
}

// Weights of a place on a triangle, moved from its edges by twice the plain bound on the error: rounding puts places beyond
// an edge and behind the neighbour's plane, where a ray would leave a closed room. Where a triangle is hardly
// higher than that, they are left.
vec2 surface_within(TriangleShape shape, float doubled_area, vec2 bary)
{
    vec3 third = shape.e2 - shape.e1;
    vec3 reach = abs(shape.v0) + abs(shape.e1) + abs(shape.e2);
    float bound = 2.0 * POSITION_ROUNDINGS * EPSILON * max_component(reach);
    vec3 least = bound / doubled_area * vec3(length(third), length(shape.e2), length(shape.e1));
    least = mix(vec3(0.0), least, lessThan(least, vec3(MAX_INSET)));
    vec3 weights = vec3(1.0 - bary.x - bary.y, bary);
    vec3 moved = larger(weights, least);
    return moved == weights ? bary : moved.yz / (moved.x + moved.y + moved.z);
}

// Everything about the point that a ray from direction −wo met.
SurfacePoint surface_point(Hit hit, vec3 wo)
{
    uvec4 triangle = surface_triangle(hit.instance, hit.primitive);
    TriangleShape shape = surface_shape(hit.instance, triangle);
    Material material = scene_material(triangle.w & TRIANGLE_MATERIAL_MASK);

    SurfacePoint s = surface_white();
    vec4 base_color = surface_base_color(material, triangle, hit.bary);
    s.base_color = base_color.rgb;
    vec3 cross_edges = cross(shape.e1, shape.e2);
    float doubled_area = length(cross_edges);
    // Edge form: it stays in the plane to two roundings, unlike a + b + c weighted.
    s.position = shape.v0 + hit.bary.x * shape.e1 + hit.bary.y * shape.e2;
    // Rays that pass faces of touching solids stay on their line (interior.glsl).
    vec2 place = HAS_NESTED ? hit.bary : surface_within(shape, doubled_area, hit.bary);
    s.start = shape.v0 + place.x * shape.e1 + place.y * shape.e2;
    s.edge = HAS_NESTED ? surface_edge(shape, doubled_area, hit.bary) : 0.0;
    s.error = shape.error;
    s.record = hit.record;
    vec3 front = cross_edges / doubled_area * (shape.is_mirrored ? -1.0 : 1.0);
    s.area = 0.5 * doubled_area;
    s.is_front = dot(front, wo) >= 0.0;
    s.ng = s.is_front ? front : -front;
    s.ns = s.ng;
    if (HAS_NORMALS) {
        vec3 n = front;
        if ((triangle.w & TRIANGLE_HAS_NORMALS) != 0u) {
            vec3 a = texelFetch(vertices, int(2u * triangle.x + 1u)).xyz;
            vec3 b = texelFetch(vertices, int(2u * triangle.y + 1u)).xyz;
            vec3 c = texelFetch(vertices, int(2u * triangle.z + 1u)).xyz;
            vec3 interpolated = surface_world_normal(hit.instance, a + hit.bary.x * (b - a) + hit.bary.y * (c - a));
            float length2 = dot(interpolated, interpolated);
            n = length2 > 0.0 ? interpolated * inversesqrt(length2) : front;
        }
        if (HAS_TEXTURES && texture_may(TEXTURE_NORMAL) && (material.flags & MATERIAL_HAS_TEXTURES) != 0u) {
            n = surface_mapped_normal(material, hit.instance, triangle, shape, hit.bary, n);
        }
        s.ns = surface_bend(s.is_front ? n : -n, s.ng, wo);
    }
    s.alpha = HAS_BLEND && (material.flags & MATERIAL_BLEND) != 0u ? limited(base_color.a, 0.0, 1.0) : 1.0;
    if (HAS_AREA_LIGHTS && (material.flags & MATERIAL_EMISSIVE) != 0u && (s.is_front || (material.flags & MATERIAL_DOUBLE_SIDED) != 0u)) {
        s.emission = surface_emission(material, triangle, hit.bary);
        s.emission_pdf = material.emission_pdf;
        s.placement = hit.instance;
        s.triangle = hit.primitive + (HAS_INSTANCES ? scene_instance(hit.instance).first_triangle : 0u);
    }
    if (HAS_SPECULAR) {
        vec4 factors = surface_texture(material, TEXTURE_METALLIC_ROUGHNESS, triangle, hit.bary);
        s.roughness = material.roughness * factors.g;
        s.metallic = material.metallic * factors.b;
        s.dielectric_f90 = material.specular * surface_texture(material, TEXTURE_SPECULAR, triangle, hit.bary).a;
        vec3 tint = surface_texture(material, TEXTURE_SPECULAR_COLOR, triangle, hit.bary).rgb;
        s.strength = material.specular_color * tint * s.dielectric_f90;
        float f0 = material.ior == 0.0 ? 1.0 : square((material.ior - 1.0) / (material.ior + 1.0));
        s.dielectric_f0 = smaller(f0 * material.specular_color * tint, vec3(1.0)) * s.dielectric_f90;
        s.ior = material.ior;
    }
    if (HAS_DIELECTRIC) {
        s.material = triangle.w & TRIANGLE_MATERIAL_MASK;
        s.is_solid = (material.flags & MATERIAL_SOLID) != 0u;
        s.transmission = (1.0 - s.metallic) * material.transmission
            * surface_texture(material, TEXTURE_TRANSMISSION, triangle, hit.bary).r;
    }
    return s;
}

#endif
