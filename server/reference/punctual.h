// Punctual lights (KHR_lights_punctual) in reference space: what they give to a point, and rays
// from them for light vertices.
//
// Built on one thread, then read by all.

#ifndef BD_REFERENCE_PUNCTUALS_H
#define BD_REFERENCE_PUNCTUALS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "reference/geometry.h"
#include "reference/light_tree.h"

struct bd_punctual {
    enum bd_light_kind kind;
    bd_dvec3 position;                 // of a directional light: none
    float axis_x[3], axis_y[3];        // across the axis
    float axis[3];                     // along which it shines
    float intensity[3];                // per steradian in reference units; directional: illuminance
    float range_inverse;               // 0: unlimited
    float cos_outer, cos_ramp_inverse; // of a spot
    float steradians;                  // of a spot: integral of its falloff
    float probability, cumulated;      // in proportion to flux
};

struct bd_punctuals {
    struct bd_punctual *punctuals; // those that shine at all, directional lights last
    uint32_t count;
    uint32_t near_count;       // those that have a place
    float radius;              // of the scene: directional lights start from a disc as large
    struct bd_light_tree tree; // of those that have a place, by their indices
};

// `unit_cd_m2`: reference unit of luminance, a power of two.
BD_MUST_CHECK
enum bd_err bd_punctuals_init(struct bd_punctuals *punctuals, const struct bd_geometry *geometry,
                              double unit_cd_m2, struct bd_err_detail *detail);
void bd_punctuals_finish(struct bd_punctuals *punctuals);

// The largest illuminance at one reference unit, in cd/m^2 per unit: for choosing the unit.
double bd_punctuals_strongest(const struct bd_geometry *geometry);

// What a punctual light gives to a point, were nothing in the way.
struct bd_illumination {
    float direction[3]; // unit, towards the punctual light
    float distance;     // INFINITY for a directional light
    float normal_illuminance[3];
    float pdf; // of light rays per area across them: see bd_punctual_pdf
};

// False if the point is out of the punctual light's cone or range.
bool bd_punctual_illuminates(const struct bd_punctuals *punctuals,
                             const struct bd_punctual *punctual, const float position[3],
                             struct bd_illumination *out);

// One punctual light in proportion to flux, by a uniform number in [0, 1).
const struct bd_punctual *bd_punctuals_choose(const struct bd_punctuals *punctuals, float choice);
uint64_t bd_punctuals_bytes(const struct bd_punctuals *punctuals);

// One punctual light chosen in proportion to flux, and a ray from it in proportion to its
// intensity. The pdf with which such a ray meets a surface is bd_illumination.pdf x |cos| there.
const struct bd_punctual *bd_punctuals_sample_ray(const struct bd_punctuals *punctuals,
                                                  float choice, const float u[2], float origin[3],
                                                  float direction[3]);

#endif
