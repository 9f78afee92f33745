// Photons of all lights and where they land after surfaces have sent them on: indirect light as
// their density (lights/photon_map.h).
//
// Each lamp sends as many as it has flux; a surface sends one on by its whole BRDF, or takes it, by
// how much of its flux is left (Russian roulette), so that those on their way carry about the same.
// They go on through glass (pass/onward.h). Where they land first is direct light, which others
// tell: kept is what came by a reflection. What comes straight through glass is kept where no
// caustic photons bring it (pass/caustic_photons.h): of the sky.
//
// A function of the snapshot, its lights and these numbers, and not of a camera.
//
// Jensen 1996; Arvo and Kirk 1990; Yao, Wang, Chan, Yong, Paul 2010 (algorithms.md A5.5).
// Cost: 1 to 2 us for each leg of a photon's way, of one core.
//
// Private to pass/. Thread: render thread, and the pool's.

#ifndef BD_PASS_PHOTON_PATHS_H
#define BD_PASS_PHOTON_PATHS_H

#include "lights/area_lights.h"
#include "lights/irradiance_cells.h"
#include "lights/photon_map.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"

struct bd_photon_paths_inputs {
    const struct bd_scene *snapshot;
    const struct bd_visibility_inputs *visibility;
    const struct bd_light_uniform *punctuals; // render space, frame's unit
    uint32_t punctual_count;
    const struct bd_area_lights *lights; // and the sky; NULL: none
    float from_cd_m2;                    // to the frame's unit
    uint32_t count;                      // that are sent, about: 1 to BD_PHOTONS_MAX
    uint32_t reflections;                // of each at most, 1 to 64
    bool lambert;                        // surfaces send on their base colour, evenly
    bool glass;                          // photons go on through it
    bool caustics_apart;                 // what lamps send straight through it is not kept
    float radius;                        // of a place, render units; 0: by the photons' density
    uint64_t seed;
};

// Where flux went, of all channels together: what set out is what left the scene, what surfaces,
// glass and a lamp's range took, what was lost within glass (pass/onward.h), and what was dropped:
// those still on their way after the last reflection, and what roulette takes more than it gives.
struct bd_photon_account {
    double sent, left, absorbed, lost, dropped;
};

// A map of those that land, and cells of it for lobes (pass/photon_cells.h); NULL where surfaces
// have none.
BD_MUST_CHECK
enum bd_err bd_photon_paths_run(const struct bd_pass_context *context,
                                const struct bd_photon_paths_inputs *inputs,
                                struct bd_photon_map **out, struct bd_irradiance_cells **cells,
                                struct bd_photon_account *account, struct bd_err_detail *detail);

#endif
