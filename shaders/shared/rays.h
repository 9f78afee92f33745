// Segments whose ends see each other or not, as they lie in a buffer (rays/rays.h).
#ifndef BD_SHARED_RAYS_H
#define BD_SHARED_RAYS_H

#include "shared/types.h"

// Two uvec4s: bits of xyz and a triangle's number, for each of the two ends.
#define BD_SEGMENT_UVEC4S 2
#define BD_NO_TRIANGLE    0xffffffffu

// What lies nearer to an end than this many times the larger of the ends' coordinates does not
// block: sixteen units in the last place.
#define BD_RAY_BIAS 1.9073486e-6f

#ifndef BD_GLSL
struct bd_segment {
    float from[3];
    uint32_t from_triangle; // or BD_NO_TRIANGLE: neither end's triangle blocks
    float to[3];
    uint32_t to_triangle;
};
_Static_assert(sizeof(struct bd_segment) == 16 * BD_SEGMENT_UVEC4S, "std430 size");
#endif

#endif
