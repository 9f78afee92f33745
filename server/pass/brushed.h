// Brushed metal that rays come to on their way (pass/onward.h), and what it sends along them of
// light that comes straight to it: by the whole BRDF, where rays that go on from it would find no
// lamp. Its lobe is no narrower than what the ray stands for, or single rays would bring more than
// their share.
//
// Private to pass/. Cost: of each such wall that of first light (pass/first_light.h).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_BRUSHED_H
#define BD_PASS_BRUSHED_H

#include "pass/onward.h"

// Further walls of it send a ray no first light.
#define BD_BRUSHED_WALLS 2u

// Of a ray.
struct bd_brushed_way {
    uint32_t number;  // of its own
    uint32_t told_at; // how many walls it had met before the last of these, or BD_NOT_TOLD
    float spread_sr;  // that it stands for, and what it has met so far adds
    uint32_t count;
    struct bd_brushed_wall {
        struct bd_surface_point place;
        struct bd_ray ray;
        struct bd_ray_hit hit;
        f3 weight;
        float spread_sr;
    } walls[BD_BRUSHED_WALLS];
};
#define BD_NOT_TOLD UINT32_MAX

struct bd_brushed_way bd_brushed_begins(uint32_t number, float spread_sr);
// As struct bd_onward_look has it; `ways`: of all rays.
void bd_brushed_look(void *ways, uint32_t i, const struct bd_interface *at,
                     const struct bd_ray *ray, const struct bd_ray_hit *hit,
                     const struct bd_way *way);

// Whether a ray ended at a wall that tells of first light itself.
static inline bool bd_brushed_ends(const struct bd_brushed_way *brushed, const struct bd_way *way)
{
    return brushed->told_at == way->events;
}

// What they send along each ray, with its weight.
BD_MUST_CHECK
enum bd_err bd_brushed_light(const struct bd_pass_context *context,
                             const struct bd_surface_hits *surfaces,
                             const struct bd_first_light *first,
                             const struct bd_visibility_inputs *visibility, uint64_t seed,
                             const struct bd_brushed_way *ways, uint32_t ray_count, f3 *light,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
