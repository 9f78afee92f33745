#include "lights/area_lights.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "lights/emitter_parts.h"
#include "lights/sky_light.h"
#include "lights/surface.h"
#include "scene/model/triangle_order.h"

// Of triangles with maps, in all, if there are not as many triangles.
#define PARTS_ASKED   UINT32_C(131072)
#define PAUSE_EVERY   1024u // triangles
#define PARTS_A_PAUSE 16u   // whose maps are looked at: of 4,096 texels at most

struct making {
    struct bd_area_lights *lights;
    struct bd_render_space space;
    struct bd_triangle_order order;
    enum bd_err (*pause)(void *user);
    void *user;
    float *flux; // of each
};

static bool is_emissive(const struct bd_material *m)
{
    return !m->unlit && (m->emissive[0] > 0 || m->emissive[1] > 0 || m->emissive[2] > 0);
}

// --- what is emitted ----------------------------------------------------------------------------

static f3 emission_at(const struct bd_scene *scene, const struct bd_area_source *source,
                      uint32_t triangle, float u, float v)
{
    const struct bd_primitive *primitive = source->primitive;
    const struct bd_material *material = &scene->materials[primitive->material];
    const uint32_t *index = primitive->index + 3 * (size_t)(triangle - source->first_triangle);
    const f3 factor = f3_of(material->emissive[0], material->emissive[1], material->emissive[2]);
    if (!source->has_map) return factor;
    return f3_mul(factor, bd_map_at(scene, &material->emissive_map, primitive, index, u, v).rgb);
}

// How often it is there.
static float presence_at(const struct bd_area_lights *lights, const struct bd_area_source *source,
                         uint32_t triangle, float u, float v)
{
    const struct bd_primitive *primitive = source->primitive;
    const struct bd_material *material = &lights->scene->materials[primitive->material];
    const uint32_t *index = primitive->index + 3 * (size_t)(triangle - source->first_triangle);
    if (!source->has_alpha) return 1;
    const float alpha = bd_base_color_at(lights->scene, primitive, index, u, v).alpha;
    if (lights->by_coverage && material->alpha_mode == BD_ALPHA_BLEND) return alpha;
    return bd_is_cut_out(material, alpha) ? 0 : 1;
}

f3 bd_area_emission(const struct bd_area_lights *lights, const struct bd_area_light *light, float u,
                    float v, f3 to_viewer)
{
    const struct bd_area_source *source = &lights->sources[light->source];
    if (!source->two_sided && f3_dot(light->normal, to_viewer) <= 0) return f3_of(0, 0, 0);
    return emission_at(lights->scene, source, light->triangle, u, v);
}

f3 bd_area_emission_chosen(const struct bd_area_lights *lights, const struct bd_area_light *light,
                           float u, float v, f3 to_viewer)
{
    const struct bd_area_source *source = &lights->sources[light->source];
    return f3_scale(bd_area_emission(lights, light, u, v, to_viewer),
                    presence_at(lights, source, light->triangle, u, v));
}

// --- triangles ----------------------------------------------------------------------------------

static void add_triangle(struct making *m, const struct bd_area_source *source,
                         const struct bd_instance *instance, bool mirrored, uint32_t t)
{
    const struct bd_primitive *primitive = source->primitive;
    struct bd_area_light whole = {.triangle = source->first_triangle + t,
                                  .source = (uint32_t)(source - m->lights->sources),
                                  .u = {0, 1, 0},
                                  .v = {0, 0, 1}};
    for (int c = 0; c < 3; c++)
        whole.corner[c] = bd_shading_vertex_of(&m->space, instance,
                                               primitive->position +
                                                   3 * (size_t)primitive->index[3 * (size_t)t + c]);
    const f3 across = f3_cross(f3_sub(whole.corner[1], whole.corner[0]),
                               f3_sub(whole.corner[2], whole.corner[0]));
    const float twice = f3_length(across);
    if (!(twice > 0) || !isfinite(twice)) return;
    whole.area = 0.5f * twice;
    whole.normal = f3_scale(across, (mirrored ? -1 : 1) / twice);
    m->lights->lights[m->lights->count++] = whole;
}

// --- all of them --------------------------------------------------------------------------------

static const struct bd_primitive *primitive_of(const struct bd_scene *scene,
                                               const struct bd_triangle_run *run)
{
    return &scene->meshes[run->mesh]->primitives[run->primitive];
}

static struct bd_area_source source_of(const struct bd_scene *scene,
                                       const struct bd_triangle_run *run, uint32_t instance)
{
    const struct bd_primitive *primitive = primitive_of(scene, run);
    const struct bd_material *material = &scene->materials[primitive->material];
    return (struct bd_area_source){
        .primitive = primitive,
        .first_triangle =
            (uint32_t)(run->first_triangle + (uint64_t)instance * run->triangles_per_instance),
        .two_sided = material->double_sided,
        .has_map = material->emissive_map.texture != BD_NONE,
        .has_alpha = material->alpha_mode != BD_ALPHA_OPAQUE,
    };
}

// Sources and triangles; whether any is to be split.
static bool count(const struct making *m, uint64_t *sources, uint64_t *triangles)
{
    const struct bd_scene *scene = m->lights->scene;
    bool is_split = false;
    *sources = *triangles = 0;
    for (uint32_t r = 0; r < m->order.run_count; r++) {
        const struct bd_triangle_run *run = &m->order.runs[r];
        if (!is_emissive(&scene->materials[primitive_of(scene, run)->material])) continue;
        const struct bd_area_source source = source_of(scene, run, 0);
        *sources += run->instance_count;
        *triangles += (uint64_t)run->instance_count * run->triangles_per_instance;
        is_split |= source.has_map || source.has_alpha;
    }
    return is_split;
}

static enum bd_err add_instance(struct making *m, const struct bd_triangle_run *run, uint32_t i)
{
    struct bd_area_lights *lights = m->lights;
    struct bd_area_source *source = &lights->sources[lights->source_count++];
    const uint32_t place = m->order.instances[run->first_instance + i];
    enum bd_err err = BD_ERR_OK;
    *source = source_of(lights->scene, run, i);
    for (uint32_t t = 0; !err && t < run->triangles_per_instance; t++) {
        add_triangle(m, source, &lights->scene->instances[place], run->mirrored, t);
        if (t % PAUSE_EVERY == 0) err = m->pause(m->user);
    }
    return err;
}

static enum bd_err add_all(struct making *m)
{
    const struct bd_scene *scene = m->lights->scene;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; !err && r < m->order.run_count; r++) {
        const struct bd_triangle_run *run = &m->order.runs[r];
        if (!is_emissive(&scene->materials[primitive_of(scene, run)->material])) continue;
        for (uint32_t i = 0; !err && i < run->instance_count; i++) err = add_instance(m, run, i);
    }
    return err;
}

static struct bd_emitter_leaf leaf_of(const struct bd_area_light *light, bool two_sided, float flux)
{
    const f3 *c = light->corner;
    struct bd_emitter_node node = bd_emitter_to_all_sides(
        f3_of(fminf(c[0].x, fminf(c[1].x, c[2].x)), fminf(c[0].y, fminf(c[1].y, c[2].y)),
              fminf(c[0].z, fminf(c[1].z, c[2].z))),
        f3_of(fmaxf(c[0].x, fmaxf(c[1].x, c[2].x)), fmaxf(c[0].y, fmaxf(c[1].y, c[2].y)),
              fmaxf(c[0].z, fmaxf(c[1].z, c[2].z))),
        flux);
    if (!two_sided) node.axis = light->normal, node.spread_cos = 1;
    return (struct bd_emitter_leaf){node,
                                    .middle = f3_scale(f3_add(c[0], f3_add(c[1], c[2])), 1.0f / 3)};
}

static enum bd_err make_tree(struct making *m, struct bd_err_detail *detail)
{
    struct bd_area_lights *lights = m->lights;
    if (lights->count <= BD_AREA_WEIGHED_MAX) return BD_ERR_OK;
    struct bd_emitter_leaf *leaves = malloc(lights->count * sizeof *leaves);
    if (!leaves)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for a tree of %u emitters",
                          lights->count);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < lights->count; i++) {
        const struct bd_area_light *light = &lights->lights[i];
        leaves[i] = leaf_of(light, lights->sources[light->source].two_sided, m->flux[i]);
        if (i % PAUSE_EVERY == 0) err = m->pause(m->user);
    }
    if (!err)
        err = bd_emitter_tree_init(&lights->tree, leaves, lights->count, m->pause, m->user, detail);
    free(leaves);
    return err;
}

static enum bd_err weigh_all(struct making *m)
{
    struct bd_area_lights *lights = m->lights;
    uint32_t kept = 0;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < lights->count; i++) {
        struct bd_area_light *part = &lights->lights[kept];
        *part = lights->lights[i];
        part->brightest = bd_emitter_part_brightness(lights, part);
        m->flux[kept] =
            part->brightest * part->area * (lights->sources[part->source].two_sided ? 2 : 1);
        kept += part->brightest > 0 && part->area > 0;
        if (i % PARTS_A_PAUSE == 0) err = m->pause(m->user);
    }
    lights->count = kept;
    return err;
}

static enum bd_err make_room(struct making *m, uint64_t sources, uint64_t room,
                             struct bd_err_detail *detail)
{
    struct bd_area_lights *lights = m->lights;
    lights->sources = calloc(sources + 1, sizeof *lights->sources);
    lights->lights = malloc((room + 1) * sizeof *lights->lights);
    m->flux = malloc((room + 1) * sizeof *m->flux);
    if (lights->sources && lights->lights && m->flux) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for %llu emitters",
                      (unsigned long long)room);
}

static void give_room_back(struct bd_area_lights *lights)
{
    struct bd_area_light *kept =
        realloc(lights->lights, ((size_t)lights->count + 1) * sizeof *lights->lights);
    if (kept) lights->lights = kept;
}

static enum bd_err make_emitters(struct making *m, struct bd_err_detail *detail)
{
    uint64_t sources, triangles;
    const bool is_split = count(m, &sources, &triangles) && triangles < PARTS_ASKED;
    const uint64_t room = is_split ? PARTS_ASKED : triangles;
    if (room > BD_AREA_LIGHTS_MAX)
        return bd_err_set(detail, BD_ERR_LIMIT, "scene", "%llu triangles emit; %u can light",
                          (unsigned long long)room, BD_AREA_LIGHTS_MAX);
    enum bd_err err = make_room(m, sources, room, detail);
    if (!err) err = add_all(m);
    if (!err) err = bd_emitter_parts_split(m->lights, (uint32_t)room, m->pause, m->user);
    if (!err) err = weigh_all(m);
    if (!err) give_room_back(m->lights);
    return err ? err : make_tree(m, detail);
}

enum bd_err bd_area_lights_create(struct bd_scene *scene, bool by_coverage,
                                  enum bd_err (*pause)(void *user), void *user,
                                  struct bd_area_lights **out, struct bd_err_detail *detail)
{
    struct bd_area_lights *lights = *out = calloc(1, sizeof *lights);
    BD_ASSERT(lights);
    lights->scene = bd_scene_retain(scene);
    lights->by_coverage = by_coverage;
    struct making m = {
        .lights = lights, .space = bd_render_space_of(scene), .pause = pause, .user = user};
    bd_triangle_order_init(&m.order, scene);
    enum bd_err err = make_emitters(&m, detail);
    bd_triangle_order_finish(&m.order);
    free(m.flux);
    if (!err) err = bd_sky_light_init(&lights->sky, &scene->environment, pause, user, detail);
    if (err) bd_area_lights_destroy(out);
    return err;
}

void bd_area_lights_destroy(struct bd_area_lights **lights)
{
    struct bd_area_lights *own = *lights;
    *lights = NULL;
    if (!own) return;
    bd_sky_light_finish(&own->sky);
    free(own->lights);
    free(own->sources);
    bd_emitter_tree_finish(&own->tree);
    bd_scene_release(&own->scene);
    free(own);
}

uint64_t bd_area_lights_bytes(const struct bd_area_lights *lights)
{
    const struct bd_sky_light *sky = &lights->sky;
    const struct bd_emitter_tree *tree = &lights->tree;
    const uint64_t of_leaf = 2 * sizeof *tree->nodes + sizeof *tree->order + sizeof *tree->place;
    return sizeof *lights + lights->count * sizeof *lights->lights + tree->count * of_leaf +
           lights->source_count * sizeof *lights->sources +
           sizeof(float) * ((uint64_t)sky->columns + 1) * sky->rows;
}

// --- finding ------------------------------------------------------------------------------------

// Whether a point lies in a part, or as near as rounding.
static bool holds(const struct bd_area_light *part, float u, float v)
{
    const float least_u = fminf(part->u[0], fminf(part->u[1], part->u[2]));
    const float least_v = fminf(part->v[0], fminf(part->v[1], part->v[2]));
    const float most_u = fmaxf(part->u[0], fmaxf(part->u[1], part->u[2]));
    const float most_v = fmaxf(part->v[0], fmaxf(part->v[1], part->v[2]));
    const float slack = 1e-6f;
    return u >= least_u - slack && u <= most_u + slack && v >= least_v - slack &&
           v <= most_v + slack;
}

// The place of the first part of a triangle, or behind it, at or behind a path.
static uint32_t place_of(const struct bd_area_lights *lights, uint32_t triangle, uint64_t path)
{
    uint32_t low = 0, high = lights->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        const struct bd_area_light *at = &lights->lights[middle];
        if (at->triangle < triangle || (at->triangle == triangle && at->path < path))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// The last whose path is not beyond the point's; between parts some were left out.
const struct bd_area_light *bd_area_light_at(const struct bd_area_lights *lights, uint32_t triangle,
                                             float u, float v)
{
    const uint32_t first = place_of(lights, triangle, 0);
    if (first == lights->count || lights->lights[first].triangle != triangle) return NULL;
    const uint32_t behind = place_of(lights, triangle, (uint64_t)bd_emitter_path_of(u, v) + 1);
    if (behind == first) return NULL;
    const struct bd_area_light *found = &lights->lights[behind - 1];
    return holds(found, u, v) ? found : NULL;
}
