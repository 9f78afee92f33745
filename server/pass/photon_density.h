// Light that lamps send to surfaces through glass: what of it lies on receivers, by the photons
// nearest to each (pass/caustic_photons.h, lights/photon_map.h). On the processor, whatever the
// device. Added behind the filters of noise: where it is bright is no noise.
//
// Private to pass/ but for the techniques. Thread: render thread, and the pool's.

#ifndef BD_PASS_CAUSTICS_H
#define BD_PASS_CAUSTICS_H

#include "lights/photon_map.h"
#include "pass/gather_fragments.h"

// Of pixels, in a pass "caustics". Adds to `irradiance` of `indirect`.
BD_MUST_CHECK
enum bd_err bd_caustics_run(const struct bd_pass_context *context, struct bd_pool *pool,
                            const struct bd_photon_map *map, const struct bd_gather_inputs *gather,
                            struct bd_indirect *indirect, struct bd_err_detail *detail);

// Of fragments, in a pass "caustics". Adds to `light`.
BD_MUST_CHECK
enum bd_err bd_caustics_of_fragments(const struct bd_pass_context *context, struct bd_pool *pool,
                                     const struct bd_photon_map *map,
                                     const struct bd_gather_fragments_inputs *gather,
                                     struct bd_multires_light *light, struct bd_err_detail *detail);

#endif
