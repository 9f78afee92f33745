// Environment maps: the scene as cubes of texels show it from a few places, for rays that ask these
// instead of its triangles (pass/env_rays.h). A texel says which triangle it sees first, and how
// far off that is.
//
// Where they stand is chosen (pass/env_choice.h); of each solid of glass one more stands in its
// middle, where rays within it find its walls (distance impostors, algorithms.md A5.8). A cube is a
// shadow map of its centre (pass/shadow_map.h), drawn or traced as those are, and then the
// processor's.
//
// A function of the snapshot's places and these numbers. Memory: 8 bytes a texel. Cost: six
// drawings of the scene a cube, and 100 ns a texel of one core.
//
// Yao, Wang, Chan, Yong, Paul 2010, 4 (algorithms.md A5.1, A5.2).
//
// Thread: render thread, and the pool's; then read by all.

#ifndef BD_PASS_ENV_MAPS_H
#define BD_PASS_ENV_MAPS_H

#include "kernel/light.h"
#include "lights/surface_hits.h"
#include "pass/first_hits.h"
#include "pass/pass.h"
#include "upload/gpu_scene.h"

#define BD_ENV_FACES        6u
#define BD_ENV_MAPS_MAX     16u // of the largest, 192 MiB
// Of the small ones that the choice is made by, of a face; and of all of it.
#define BD_ENV_CHOICE_SIDE   32u
#define BD_ENV_CHOICE_TEXELS (BD_ENV_FACES * BD_ENV_CHOICE_SIDE * BD_ENV_CHOICE_SIDE)
#define BD_ENV_MAP_SIDE_MIN  16u
#define BD_ENV_MAP_SIDE_MAX  512u

struct bd_env_map {
    f3 centre;           // render space
    float *distances;    // of six faces, row by row; INFINITY where nothing is
    uint32_t *triangles; // BD_NO_TRIANGLE there
};

struct bd_env_maps {
    struct bd_scene *scene; // retained: whose triangles they name
    struct bd_surface_hits hits;
    uint32_t count, side_px;
    struct bd_env_map maps[BD_ENV_MAPS_MAX];
    float covered; // area that some of them sees, render units squared, as they were chosen by it
};

struct bd_env_maps_inputs {
    const struct bd_gpu_scene *scene;
    struct bd_scene *snapshot;
    const struct bd_tracer *tracer;        // who finds what is seen; NULL: all is drawn
    const struct bd_tracer *choice_tracer; // of the small ones that the choice is made by
    uint32_t count;                        // at most: 1 to BD_ENV_MAPS_MAX
    uint32_t side_px;                      // of a face
    uint32_t seed;                         // of the places to choose from
    bool solids;                           // rays go on through those
};

// With the processor's threads.
BD_MUST_CHECK
enum bd_err bd_env_maps_run(const struct bd_pass_context *context,
                            const struct bd_env_maps_inputs *inputs, struct bd_env_maps **out,
                            struct bd_err_detail *detail);
void bd_env_maps_destroy(struct bd_gpu *gpu, struct bd_env_maps **maps);
uint64_t bd_env_maps_bytes(const struct bd_env_maps *maps);

// One cube. What it allocates is the caller's, who frees it if it fails, too.
BD_MUST_CHECK
enum bd_err bd_env_map_look(const struct bd_pass_context *context, const struct bd_gpu_scene *scene,
                            const struct bd_surface_hits *hits, const struct bd_tracer *tracer,
                            f3 centre, uint32_t side_px, struct bd_env_map *out,
                            struct bd_err_detail *detail);
void bd_env_map_free(struct bd_env_map *map);

static inline uint32_t bd_env_map_texels(uint32_t side_px)
{
    return BD_ENV_FACES * side_px * side_px;
}

// Through the middle of a texel, of a length of 1 along its face's axis.
f3 bd_env_texel_direction(uint32_t side_px, uint32_t texel);

// The texel in a direction, of any length but 0.
static inline uint32_t bd_env_texel_towards(uint32_t side_px, f3 direction)
{
    const uint32_t face = face_towards(direction);
    const f3 seen = seen_from_face(direction, face);
    const float side = (float)side_px, half = 0.5f * side, ahead = f_max(seen.z, 1e-30f);
    const float x = f_min(f_max(half + half * seen.x / ahead, 0), side - 1);
    const float y = f_min(f_max(half - half * seen.y / ahead, 0), side - 1);
    return (face * side_px + (uint32_t)y) * side_px + (uint32_t)x;
}

#endif
