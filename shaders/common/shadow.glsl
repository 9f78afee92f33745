// Exact shadows from a map of triangle ids.
//
// The map says which triangle each of its texels sees. A receiver looks up the texels around its
// own direction and intersects the segment to the light with the triangles named there. A
// silhouette falls where the geometry puts it, not where the texel grid does; no bias in depth is
// needed, at any scale (hazard 37). An occluder that is nearest to the light in none of these texels
// is missed, unless all of the inner nine lie before the receiver.
#include "common/array.glsl"
#include "common/light.glsl"

BD_ARRAY(triangles, BD_UNIT_TRIANGLES);
layout(binding = BD_UNIT_SHADOW_IDS) uniform usampler2DArray shadow_ids;

const uint TRIANGLE_MASKED = 0x80000000u;
// Texels looked up: three on each side. On Sponza's colonnade at 1024 texels a face, pixels lit
// through a wall are 5, 2 and 0 in 27,648 for 1, 2 and 3; a lit pixel costs twice as much at 3.
const int SHADOW_TEXELS = 49;
const ivec2 SHADOW_SPIRAL[SHADOW_TEXELS] = ivec2[SHADOW_TEXELS](
    ivec2(0, 0), ivec2(-1, -1), ivec2(0, -1), ivec2(1, -1), ivec2(-1, 0), ivec2(1, 0),
    ivec2(-1, 1), ivec2(0, 1), ivec2(1, 1), ivec2(-2, -2), ivec2(-1, -2), ivec2(0, -2),
    ivec2(1, -2), ivec2(2, -2), ivec2(-2, -1), ivec2(2, -1), ivec2(-2, 0), ivec2(2, 0),
    ivec2(-2, 1), ivec2(2, 1), ivec2(-2, 2), ivec2(-1, 2), ivec2(0, 2), ivec2(1, 2), ivec2(2, 2),
    ivec2(-3, -3), ivec2(-2, -3), ivec2(-1, -3), ivec2(0, -3), ivec2(1, -3), ivec2(2, -3),
    ivec2(3, -3), ivec2(-3, -2), ivec2(3, -2), ivec2(-3, -1), ivec2(3, -1), ivec2(-3, 0),
    ivec2(3, 0), ivec2(-3, 1), ivec2(3, 1), ivec2(-3, 2), ivec2(3, 2), ivec2(-3, 3), ivec2(-2, 3),
    ivec2(-1, 3), ivec2(0, 3), ivec2(1, 3), ivec2(2, 3), ivec2(3, 3));
const float SMALL_TRIANGLE_TEXELS = 4.0;
const float SMALL_TRIANGLE_GAP_TEXELS = 3.0;

// True if the open segment origin .. origin + span meets the triangle (Moeller and Trumbore 1997).
// The edges are widened by a few ulps, so that no light passes between neighbours.
bool segment_meets_triangle(vec3 origin, vec3 span, uint id)
{
    vec3 corner = BD_LOAD(triangles, 3u * id).xyz;
    vec3 edge1 = BD_LOAD(triangles, 3u * id + 1u).xyz;
    vec3 edge2 = BD_LOAD(triangles, 3u * id + 2u).xyz;
    vec3 p = cross(span, edge2);
    float determinant = dot(edge1, p);
    if (determinant == 0.0) return false;
    float inverse = 1.0 / determinant;
    vec3 s = origin - corner;
    float u = dot(s, p) * inverse;
    vec3 q = cross(s, edge1);
    float v = dot(span, q) * inverse;
    float t = dot(edge2, q) * inverse;
    const float slack = 2e-6;
    return u >= -slack && v >= -slack && u + v <= 1.0 + slack && t > 0.0 && t < 1.0;
}

// The longer side of a texel at a distance from the light, render units: a directional light's
// frame fits the scene, and its texels need not be square.
float shadow_texel_side(vec3 from_light)
{
    float side = 2.0 * max(light.axis_x.w, light.axis_y.w) / float(light.kind.z);
    return light.kind.x == BD_LIGHT_KIND_DIRECTIONAL ? side : side * length(from_light);
}

// Triangles smaller than the map's texels hide each other from it: the one that the segment meets
// may be named nowhere. Where the texel of the receiver itself names one so small, its plane
// stands for the surface that it is part of, as in a plain shadow map; the gap to the receiver
// must then exceed what the surface can turn within a texel or two.
bool segment_meets_small_triangle(vec3 origin, vec3 span, uint id, float texel_side)
{
    vec3 corner = BD_LOAD(triangles, 3u * id).xyz;
    vec3 edge1 = BD_LOAD(triangles, 3u * id + 1u).xyz;
    vec3 edge2 = BD_LOAD(triangles, 3u * id + 2u).xyz;
    vec3 edge3 = edge2 - edge1;
    float longest = max(dot(edge1, edge1), max(dot(edge2, edge2), dot(edge3, edge3)));
    if (longest > SMALL_TRIANGLE_TEXELS * SMALL_TRIANGLE_TEXELS * texel_side * texel_side)
        return false;
    vec3 n = cross(edge1, edge2);
    float toward = dot(span, n);
    if (toward == 0.0) return false;
    float t = dot(corner - origin, n) / toward;
    float cosine = abs(toward) / (length(span) * length(n));
    return t < 1.0 && t * length(span) * max(cosine, 0.1) > SMALL_TRIANGLE_GAP_TEXELS * texel_side;
}

// Texel coordinates (not yet floored) of a point seen from the light, and its face.
vec2 shadow_texel(vec3 from_light, out uint face)
{
    face = light_face_of(from_light);
    vec3 x, y, z;
    light_face_axes(face, x, y, z);
    vec2 lateral = vec2(dot(from_light, x), dot(from_light, y)) /
                   vec2(light.axis_x.w, light.axis_y.w);
    if (light.kind.x != BD_LIGHT_KIND_DIRECTIONAL) lateral /= max(-dot(from_light, z), 1e-20);
    return (vec2(lateral.x, -lateral.y) * 0.5 + 0.5) * float(light.kind.z);
}

uint shadow_id(ivec2 texel, uint face)
{
    int last = int(light.kind.z) - 1;
    return texelFetch(shadow_ids, ivec3(clamp(texel, ivec2(0), ivec2(last)), face), 0).x;
}

// Whether a texel that sees this triangle, or nothing, speaks for light at the receiver: the
// triangle cannot hide a receiver that lies in its plane, within a texel, or on its lit side.
bool leaves_open(uint id, uint own_id, vec3 origin, vec3 span, float texel_side)
{
    if (id == 0u || id == own_id) return true;
    vec3 corner = BD_LOAD(triangles, 3u * (id - 1u)).xyz;
    vec3 n = cross(BD_LOAD(triangles, 3u * (id - 1u) + 1u).xyz,
                   BD_LOAD(triangles, 3u * (id - 1u) + 2u).xyz);
    float height = dot(origin - corner, n);
    bool lit_side = height * dot(span, n) >= 0.0;
    return lit_side || height * height <= dot(n, n) * texel_side * texel_side;
}

// Whether one of the inner nine texels speaks for light. Where none does, every surface around lies
// before the receiver: a segment that meets none of those threads a gap narrower than a texel, behind
// which something unnamed hides.
bool some_leaves_open(ivec2 centre, uint face, uint own_id, vec3 origin, vec3 span, float texel_side)
{
    bool open = false;
    for (int i = 0; i < 9 && !open; i++) {
        uint id = shadow_id(centre + SHADOW_SPIRAL[i], face) & ~TRIANGLE_MASKED;
        open = leaves_open(id, own_id, origin, span, texel_side);
    }
    return open;
}

// Whether a texel from `i` on names a triangle that is to be tested, and the first that does.
// A masked triangle has holes that only its own texel knows of.
bool next_named(ivec2 centre, uint face, uint own_id, uint tested, inout int i, out uint id)
{
    id = 0u;
    while (i < SHADOW_TEXELS) {
        uint named = shadow_id(centre + SHADOW_SPIRAL[i], face);
        bool counts = i == 0 || (named & TRIANGLE_MASKED) == 0u;
        id = named & ~TRIANGLE_MASKED;
        i++;
        if (counts && id != 0u && id != own_id && id != tested) return true;
    }
    return false;
}

// `own_id` is the receiver's triangle + 1; `origin` lies off its surface.
//
// The same few triangles are named by all the texels around: those are passed over in a loop of
// their own, and the test, which is much longer, is gone through once for each triangle and not
// for each texel (a software device takes every turn of a loop for all of its lanes).
bool segment_is_blocked(vec3 origin, vec3 span, uint own_id)
{
    vec3 from_light = origin - light.position.xyz;
    uint face = 0u;
    ivec2 centre = ivec2(floor(shadow_texel(from_light, face)));
    float texel_side = shadow_texel_side(from_light);
    if (!some_leaves_open(centre, face, own_id, origin, span, texel_side)) return true;
    uint id, tested = own_id;
    int i = 0; // from the centre outwards, ring by ring
    while (next_named(centre, face, own_id, tested, i, id)) {
        tested = id;
        if (segment_meets_triangle(origin, span, id - 1u)) return true;
        if (i == 1 && segment_meets_small_triangle(origin, span, id - 1u, texel_side)) return true;
    }
    return false;
}
