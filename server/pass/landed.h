// Photons that landed, as a map that knows where surfaces end: points of all of them go with it
// (lights/photon_map.h). Private to pass/. Thread: render thread.

#ifndef BD_PASS_LANDED_H
#define BD_PASS_LANDED_H

#include "lights/photon_map.h"
#include "pass/pass.h"

// `how` without `surfaces`; `by_coverage` as in lights/surface_points.h, where photons met them so.
BD_MUST_CHECK
enum bd_err bd_landed_map(const struct bd_pass_context *context, const struct bd_scene *snapshot,
                          bool by_coverage, const struct bd_photon *photons, uint32_t count,
                          const struct bd_photon_map_how *how, struct bd_photon_map **out,
                          struct bd_err_detail *detail);

#endif
