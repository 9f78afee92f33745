// Where the rays of a pixel go that look for lights with a size, and what each brings if nothing is
// in its way. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_AREA_SAMPLES_H
#define BD_PASS_AREA_SAMPLES_H

#include "lights/area_lights.h"
#include "lights/sequence.h"
#include "rays/rays.h"

// Of a picture.
struct bd_area_sampling {
    const struct bd_area_lights *lights;
    uint32_t rays;    // of half a pixel
    uint32_t lobes;   // of those, how many more a half follows where there is a lobe
    uint32_t stride;  // a power of two from `rays` on
    float reach;      // of a sphere about the origin that holds all there is
    float from_cd_m2; // to the frame's unit
    bool lambert;
    uint32_t seed;
};
static inline bool bd_area_all_are_weighed(const struct bd_area_sampling *sampling)
{
    return sampling->lights->count <= BD_AREA_WEIGHED_MAX;
}
struct bd_area_sampling bd_area_sampling_of(const struct bd_area_lights *lights, uint32_t rays,
                                            uint64_t seed);

struct bd_area_receiver {
    f3 position, normal, normal_geometric, viewer, base_color;
    float metallic, roughness, f0_dielectric;
    bool has_lobe;
    uint32_t triangle;
    uint32_t place; // among receivers, neighbours side by side (lights/sequence.h)
    uint32_t x_px, y_px;
    const struct bd_emitter_cut *cut; // of many emitters, for it; NULL: it is made when it is asked
};

// In the frame's unit: irradiance, and radiance beyond diffuse albedo / pi times it.
struct bd_area_light_found {
    f3 irradiance, beyond;
};
#define BD_AREA_LIGHT_PARTS (sizeof(struct bd_area_light_found) / sizeof(f3))

// How a half's rays are shared out, and what is asked of a direction that a lobe found.
struct bd_area_shares {
    uint32_t emitters, map, cosine, lobes;
    float weight; // of all emitters together, where all are weighed
};

// A ray of the specular lobe: what it brings for each unit of radiance over its density.
struct bd_area_lobe {
    struct bd_ray ray;
    float density; // of all the half's lobe rays together, per steradian
    f3 irradiance, beyond;
};

// Of one half of a receiver, or of both, side by side: of each `rays` segments with what they
// bring, `lobes` of its lobe, and its shares. Segments without a length bring nothing; of lobe rays
// without a direction likewise. Who has no lobe may ask for none: NULL.
#define BD_AREA_HALVES 2u
void bd_area_sample(const struct bd_area_sampling *sampling, const struct bd_area_receiver *at,
                    uint32_t halves, struct bd_segment *segments, struct bd_area_light_found *found,
                    struct bd_area_lobe *lobes, struct bd_area_shares *shares);

// What a ray of the lobe brings that met this, or the sky.
struct bd_area_light_found bd_area_lobe_light(const struct bd_area_sampling *sampling,
                                              const struct bd_area_receiver *at,
                                              const struct bd_area_shares *shares,
                                              const struct bd_area_lobe *lobe,
                                              const struct bd_ray_hit *hit);

#endif
