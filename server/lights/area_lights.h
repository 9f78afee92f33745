// Lights that have a size: emissive triangles and the sky, one description of a snapshot for all
// who sample them. Triangles are in render space (scene/model/render_space.h), numbered as
// everywhere (scene/model/triangle_order.h); light is in cd/m^2.
//
// A triangle whose material has an emissive map is listed in up to 64 parts, fewer where there are
// many such triangles, so that a picture on a screen lights from where it is bright, and none where
// it is black; what is emitted at a point is read from the map itself. A
// surface emits to the front, double-sided ones both ways, unlit ones nothing; where its alpha says
// that it is not there, it emits nothing, and what blends emits as much as it is opaque.
//
// Choices go by the brightest channel, so that no channel is another than the others. The sky is
// chosen from in cells: texels, or blocks of them where the map has
// more than BD_SKY_CELLS_MAX. A constant sky has no cells: nothing finds it better than the cosine.
//
// Memory: 144 bytes a triangle or part; 4 bytes a cell. Deterministic. Thread: built on one, then
// read by all.

#ifndef BD_LIGHTS_AREA_LIGHTS_H
#define BD_LIGHTS_AREA_LIGHTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"
#include "lights/emitter_tree.h"
#include "scene/model/scene.h"

#define BD_AREA_LIGHTS_MAX (UINT32_C(1) << 22) // 816 MiB of them
// So many are weighed one by one at every receiver; of more, there is a tree.
#define BD_AREA_WEIGHED_MAX 64u
#define BD_SKY_CELLS_MAX    (UINT32_C(1) << 23)

struct bd_area_light {
    f3 corner[3];
    f3 normal;       // unit, to the front
    float area;      // > 0, render units
    float brightest; // its brightest channel's mean, cd/m^2; > 0
    uint32_t triangle;
    uint32_t source; // of the triangle, among `sources`
    // The part's corners as barycentrics of the triangle's second and third corner, and which of
    // four it is at each level, two bits each from the highest on.
    float u[3], v[3];
    uint32_t path;
};

// Triangles of one primitive of one instance, side by side.
struct bd_area_source {
    const struct bd_primitive *primitive;
    uint32_t first_triangle;
    bool two_sided, has_map, has_alpha;
};

struct bd_sky_light {
    bool shines;
    f3 radiance; // a factor on the map, or the sky's
    struct bd_sky_map *map;
    bool is_turned;
    bd_dvec3 axes[3];       // of the map, in the world
    uint32_t columns, rows; // of cells; 0: a constant sky
    bool in_blocks;         // cells are blocks of texels; else they lie between texels' middles
    float *cumulated_rows;  // up to and with each, ends at 1
    float *cumulated;       // within each row
};

struct bd_area_lights {
    struct bd_scene *scene;
    bool by_coverage; // what blends is there in part; else there or not
    uint32_t count, source_count;
    struct bd_area_light *lights; // by rising number of their triangles, then by their paths
    struct bd_area_source *sources;
    struct bd_emitter_tree tree; // of more than BD_AREA_WEIGHED_MAX
    struct bd_sky_light sky;
};

// Retains the scene. `pause` is called every millisecond or so; what it returns but BD_ERR_OK ends
// the work and is returned. BD_ERR_LIMIT for more than BD_AREA_LIGHTS_MAX triangles that emit.
BD_MUST_CHECK
enum bd_err bd_area_lights_create(struct bd_scene *scene, bool by_coverage,
                                  enum bd_err (*pause)(void *user), void *user,
                                  struct bd_area_lights **out, struct bd_err_detail *detail);
void bd_area_lights_destroy(struct bd_area_lights **lights);
uint64_t bd_area_lights_bytes(const struct bd_area_lights *lights);

static inline bool bd_area_lights_shine(const struct bd_area_lights *lights)
{
    return lights->count > 0 || lights->sky.shines;
}

// What a triangle emits towards `to_viewer` from the point at barycentrics of its second and third
// corner, cd/m^2. `light` is any part of the triangle. Of points that a ray met, which are there;
// of points that were chosen it is less where those are there in part, or not.
f3 bd_area_emission(const struct bd_area_lights *lights, const struct bd_area_light *light, float u,
                    float v, f3 to_viewer);
f3 bd_area_emission_chosen(const struct bd_area_lights *lights, const struct bd_area_light *light,
                           float u, float v, f3 to_viewer);

// The part at a point of a triangle; NULL if it emits nothing.
const struct bd_area_light *bd_area_light_at(const struct bd_area_lights *lights, uint32_t triangle,
                                             float u, float v);

// From a unit direction, cd/m^2; bilinear, as the map is seen elsewhere.
f3 bd_sky_light_radiance(const struct bd_sky_light *sky, f3 direction);
// The same, and how dense, per steradian, choices lie around there; 0 for a sky without cells.
struct bd_sky_look {
    f3 radiance;
    float pdf;
};
struct bd_sky_look bd_sky_light_look(const struct bd_sky_light *sky, f3 direction);
// Of a sky with cells: a direction for two numbers in [0, 1), and the pdf there, which may be
// NULL.
f3 bd_sky_light_choose(const struct bd_sky_light *sky, const float number[2], float *pdf);

#endif
