// Which triangles a shadow map names around pixels' own texels, and what they say
// (shaders/common/shadow.glsl): lookups, one by one. What is arithmetic is a loop's (pass/native).
//
// Thread: any; a group is one thread's.

#ifndef BD_PASS_DIRECT_LOOK_H
#define BD_PASS_DIRECT_LOOK_H

#include "pass/native/native.h"

#define BD_DIRECT_FACES 6

// Rows of a face, from `first` to before `end`; none if that is not behind.
struct bd_shadow_rows {
    uint32_t first, end;
};

// A copy of a shadow map (pass/shadow_map.h), of which there are the rows that pixels look at, and
// the scene's triangles. That of a light of one face is LIGHT_ONE_FACE (kernel/light.h).
struct bd_shadow_copy {
    const uint32_t *faces[BD_DIRECT_FACES];
    uint32_t side_px;
    const struct bd_vec4 *triangles;
};

// Rows that a group of pixels looks at.
void bd_direct_rows_of(const struct bd_native_aim *aim, uint32_t side_px,
                       struct bd_shadow_rows rows[BD_DIRECT_FACES]);
// Adds what arrives to the light of a group. a becomes 1.
void bd_direct_look(const struct bd_native_loops *loops, const struct bd_native_aim *aim,
                    const struct bd_shadow_copy *shadows, struct bd_vec4 *radiance,
                    struct bd_vec4 *irradiance);

#endif
