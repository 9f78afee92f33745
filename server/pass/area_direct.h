// Direct light of lights that have a size, emissive surfaces and the sky (lights/area_lights.h),
// and of punctual lights that are too many for maps (pass/punctual_light.h), under the glTF BRDF:
// by rays from every pixel, on the processor, whatever the device.
//
// Of each pixel half of the rays make one picture and half another, which share no random number;
// their difference is the noise, and the filter smooths irradiance, and what lobes reflect beyond
// it, as far as that goes (image/light_filter.h). What emits is chosen by what it would send if
// nothing stood between: all of a few, of many some that were drawn from a tree (Talbot 2005,
// resampling); then points of it, uniform over the solid angle. A sky's directions are drawn by its
// luminance and by the cosine. Receivers with a specular lobe follow some rays of that lobe too.
// All ways to find a direction share by the balance heuristic (Veach 1995), so mirrors show lamps,
// and rough floors near them do not glitter.
//
// Punctual lights have as many rays of their own.
//
// Unbiased before the filter. Cost: some 6 us a pixel and core at 16 rays; 232 bytes a pixel of the
// picture and 16 MiB while it runs.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_AREA_DIRECT_H
#define BD_PASS_AREA_DIRECT_H

#include "lights/area_lights.h"
#include "lights/punctual_tree.h"
#include "pass/gbuffer.h"
#include "pass/visibility.h"

#define BD_LIGHT_RAYS_MAX 1024u

struct bd_area_direct_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_area_lights *lights;      // NULL: none
    const struct bd_punctual_tree *punctuals; // NULL: none, or others have their light
    struct bd_visibility_inputs visibility;   // of the processor
    uint32_t rays;                            // of a pixel: even, 2 to BD_LIGHT_RAYS_MAX
    uint64_t seed;
    bool lambert;
    bool filtered;
    bool irradiance;     // is asked for, too
    float variance_part; // of its noise's, that the filter goes by (image/light_filter.h)
};

// RGBA32F, in the frame's light unit: outgoing radiance and 1, where nothing is lit what the sky
// shines, and 0; the doubt of it (image/light_filter.h); and what falls on the surface, or NULL.
struct bd_area_direct {
    struct bd_tex *radiance, *doubt, *irradiance;
};

BD_MUST_CHECK
enum bd_err bd_area_direct_run(const struct bd_pass_context *context,
                               const struct bd_area_direct_inputs *inputs,
                               struct bd_area_direct **out, struct bd_err_detail *detail);
void bd_area_direct_destroy(struct bd_gpu *gpu, struct bd_area_direct **light);
uint64_t bd_area_direct_bytes(const struct bd_area_direct *light);

#endif
