// Photons of all lights where they landed, in two maps that share none: what surfaces have sent on
// (pass/photon_paths.h), and what lamps send straight through glass (pass/caustic_photons.h).
//
// A function of the snapshot, its lights and these numbers, and not of a camera.
//
// Jensen 1996. Cost: that of both.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_PHOTONS_H
#define BD_PASS_PHOTONS_H

#include "lights/area_lights.h"
#include "lights/irradiance_cells.h"
#include "lights/photon_map.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"
#include "upload/gpu_scene.h"

struct bd_photons_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_scene *snapshot;
    struct bd_visibility_inputs visibility;
    const struct bd_env_view *images;         // that rays ask instead; NULL: triangles
    const struct bd_light_uniform *punctuals; // render space, frame's unit
    uint32_t punctual_count;
    const struct bd_area_lights *lights; // and the sky; NULL: none
    uint32_t count;                      // of either map: 1 to BD_PHOTONS_MAX
    uint32_t reflections;                // of each at most, 1 to 64
    bool lambert;                        // surfaces send on their base colour, evenly
    bool glass;                          // light goes through it
    bool caustics;                       // lamps' does
    double radius_m;                     // of a place; 0: by the photons' density
    uint64_t seed;
};

struct bd_photons {
    struct bd_photon_map *global;
    struct bd_irradiance_cells *cells; // of the former; NULL: no lobe looks
    struct bd_photon_map *caustics; // NULL: not asked for, or nobody sends any
    double flux_sent, flux_lost;    // of the former; what met nothing, in the end
};

BD_MUST_CHECK
enum bd_err bd_photons_run(const struct bd_pass_context *context,
                           const struct bd_photons_inputs *inputs, struct bd_photons **out,
                           struct bd_err_detail *detail);
void bd_photons_destroy(struct bd_gpu *gpu, struct bd_photons **photons);
uint64_t bd_photons_bytes(const struct bd_photons *photons);

#endif
