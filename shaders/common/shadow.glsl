// Exact shadows from a map of triangle ids.
//
// The map says which triangle each of its texels sees. A receiver looks up the texels around its
// own direction and intersects the segment to the light with the triangles named there. A
// silhouette falls where the geometry puts it, not where the texel grid does; no bias in depth is
// needed, at any scale (hazard 37). An occluder that is nearest to the light in none of these texels
// is missed, unless all of the inner nine lie before the receiver.
#include "common/array.glsl"
#include "common/light.glsl"
#include "kernel/shadow.h"

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

bool segment_intersects_triangle(vec3 origin, vec3 span, uint id)
{
    return segment_intersects(origin, span, BD_LOAD(triangles, 3u * id).xyz,
                         BD_LOAD(triangles, 3u * id + 1u).xyz, BD_LOAD(triangles, 3u * id + 2u).xyz);
}

bool segment_intersects_small_triangle(vec3 origin, vec3 span, uint id, float texel_side)
{
    return segment_intersects_small(origin, span, BD_LOAD(triangles, 3u * id).xyz,
                               BD_LOAD(triangles, 3u * id + 1u).xyz,
                               BD_LOAD(triangles, 3u * id + 2u).xyz, texel_side);
}

float texel_side_at(vec3 from_light)
{
    bool directional = light.kind == BD_LIGHT_KIND_DIRECTIONAL;
    return shadow_texel_side(light.half_width, light.half_height, float(light.face_side_px),
                             directional ? 1.0 : length(from_light));
}

// Texel coordinates (not yet floored) of a point seen from the light, and its face.
vec2 shadow_texel(vec3 from_light, out uint face)
{
    vec3 d = in_light_frame(from_light);
    face = light.face_count == 1u ? 0u : face_towards(d);
    vec3 seen = seen_from_face(d, face_in_frame(face));
    float side = float(light.face_side_px);
    float reach = light.kind == BD_LIGHT_KIND_DIRECTIONAL ? 1.0 : max(seen.z, 1e-20);
    return vec2(shadow_texel_at(seen.x, light.half_width, reach, side),
                shadow_texel_at(-seen.y, light.half_height, reach, side));
}

uint shadow_id(ivec2 texel, uint face)
{
    int last = int(light.face_side_px) - 1;
    return texelFetch(shadow_ids, ivec3(clamp(texel, ivec2(0), ivec2(last)), face), 0).x;
}

// Whether a texel that sees this triangle, or nothing, speaks for light at the receiver.
bool leaves_open(uint id, uint own_id, vec3 origin, vec3 span, float texel_side)
{
    if (id == 0u || id == own_id) return true;
    return triangle_leaves_open(origin, span, BD_LOAD(triangles, 3u * (id - 1u)).xyz,
                                BD_LOAD(triangles, 3u * (id - 1u) + 1u).xyz,
                                BD_LOAD(triangles, 3u * (id - 1u) + 2u).xyz, texel_side);
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
    float texel_side = texel_side_at(from_light);
    if (!some_leaves_open(centre, face, own_id, origin, span, texel_side)) return true;
    uint id, tested = own_id;
    int i = 0; // from the centre outwards, ring by ring
    while (next_named(centre, face, own_id, tested, i, id)) {
        tested = id;
        if (segment_intersects_triangle(origin, span, id - 1u)) return true;
        if (i == 1 && segment_intersects_small_triangle(origin, span, id - 1u, texel_side)) return true;
    }
    return false;
}
