// Irradiance of receivers, and what lobes reflect of it, by the density of photons about them
// (lights/photon_map.h): on the processor, whatever the device, but for rays. Caustics are added
// behind the filters of noise: where they are bright is no noise.
//
// Private to pass/ but for the techniques. Thread: render thread, and the pool's.

#ifndef BD_PASS_PHOTON_DENSITY_H
#define BD_PASS_PHOTON_DENSITY_H

#include "lights/photon_map.h"
#include "pass/gather_fragments.h"

struct bd_photon_density_inputs {
    const struct bd_photon_map *map;
    const struct bd_scene *snapshot;
    // Who says what stands on a receiver's disk: rays round it, or light would come through walls.
    // NULL: nobody.
    const struct bd_visibility_inputs *visibility;
    struct bd_pool *pool;
    bool lambert;     // pixels reflect by their base colour alone; else by the whole BRDF
    const char *pass; // in the report
};

// Of pixels. Adds to `irradiance` of `indirect`, and to `glossy` and `rough`, where there are such,
// what lobes reflect of photons whose lamps no ray of theirs meets.
BD_MUST_CHECK
enum bd_err bd_photon_density_run(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail);

// The lobes' part alone, where irradiance is told of fragments.
BD_MUST_CHECK
enum bd_err bd_photon_density_run_lobes(const struct bd_pass_context *context,
                                        const struct bd_photon_density_inputs *inputs,
                                        const struct bd_gather_inputs *gather,
                                        struct bd_indirect *indirect, struct bd_err_detail *detail);

// Of fragments, that have light: adds to it, and to vectors where `gather` has such.
BD_MUST_CHECK
enum bd_err bd_photon_density_add(const struct bd_pass_context *context,
                                  const struct bd_photon_density_inputs *inputs,
                                  const struct bd_gather_fragments_inputs *gather,
                                  struct bd_multires_light *light, struct bd_err_detail *detail);
// Of those that have none: into `gather->into`, or into a light that is made.
BD_MUST_CHECK
enum bd_err bd_photon_density_of_fragments(const struct bd_pass_context *context,
                                           const struct bd_photon_density_inputs *inputs,
                                           const struct bd_gather_fragments_inputs *gather,
                                           struct bd_multires_light **out,
                                           struct bd_err_detail *detail);

#endif
