#include "lights/surface_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "lights/sequence.h"
#include "lights/surface.h"
#include "scene/triangle_order.h"

#define PAUSE_EVERY 4096u // triangles

// A primitive of an instance. What has another colour lies elsewhere in the order of triangles, and
// its points shall be the same: parts go by their shape alone.
struct part {
    uint64_t shape; // hash of the primitive's triangles
    const struct bd_instance *instance;
    uint32_t run, index; // of the run's instances
};

struct spreading {
    struct bd_surface_points *points;
    const struct bd_scene *scene;
    struct bd_render_space space;
    struct bd_triangle_order order;
    struct part *parts;
    size_t part_count;
    struct bd_sequence sequence;
    bool lambert;
    enum bd_err (*pause)(void *user);
    void *user;
    double area, passed; // of all; of the triangles so far
    uint32_t asked, next;
};

// A triangle of an instance.
struct place {
    const struct bd_primitive *primitive;
    const struct bd_material *material;
    const uint32_t *index; // of its corners
    struct bd_triangle_place at;
    uint32_t number;
};

typedef void visit_fn(struct spreading *s, const struct place *place);

static const struct bd_primitive *primitive_of(const struct spreading *s,
                                               const struct bd_triangle_run *run)
{
    return &s->scene->meshes[run->mesh]->primitives[run->primitive];
}

static enum bd_err visit_part(struct spreading *s, const struct part *part, visit_fn *visit)
{
    const struct bd_triangle_run *run = &s->order.runs[part->run];
    const struct bd_primitive *primitive = primitive_of(s, run);
    struct place place = {.primitive = primitive,
                          .material = &s->scene->materials[primitive->material]};
    enum bd_err err = BD_ERR_OK;
    if (place.material->unlit) return err;
    for (uint32_t t = 0; !err && t < run->triangles_per_instance; t++) {
        place.index = primitive->index + 3 * (size_t)t;
        place.number = (uint32_t)(run->first_triangle +
                                  (uint64_t)part->index * run->triangles_per_instance + t);
        if (bd_triangle_place_of(&s->space, run, part->instance, primitive, t, &place.at))
            visit(s, &place);
        if (t % PAUSE_EVERY == 0) err = s->pause(s->user);
    }
    return err;
}

static enum bd_err visit_all(struct spreading *s, visit_fn *visit)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < s->part_count; i++) err = visit_part(s, &s->parts[i], visit);
    return err;
}

static uint64_t shape_of(const struct bd_primitive *primitive)
{
    const size_t vertex_bytes = 3 * sizeof *primitive->position, index_bytes = sizeof(uint32_t);
    const uint64_t of_places =
        bd_hash64(primitive->position, primitive->vertex_count * vertex_bytes, 0);
    return bd_hash64(primitive->index, primitive->index_count * index_bytes, of_places);
}

static int compare_parts(const void *a, const void *b)
{
    const struct part *x = a, *y = b;
    if (x->shape != y->shape) return x->shape < y->shape ? -1 : 1;
    const int placed = memcmp(&x->instance->world_from_mesh, &y->instance->world_from_mesh,
                              sizeof x->instance->world_from_mesh);
    if (placed) return placed;
    if (x->run != y->run) return x->run < y->run ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

static enum bd_err list_parts(struct spreading *s)
{
    const struct bd_triangle_order *order = &s->order;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; r < order->run_count; r++) s->part_count += order->runs[r].instance_count;
    s->parts = malloc((s->part_count + 1) * sizeof *s->parts);
    if (!s->parts) return BD_ERR_NO_MEMORY;
    struct part *to = s->parts;
    for (uint32_t r = 0; !err && r < order->run_count; r++) {
        const struct bd_triangle_run *run = &order->runs[r];
        const uint64_t shape = shape_of(primitive_of(s, run));
        for (uint32_t i = 0; i < run->instance_count; i++) {
            const uint32_t place = order->instances[run->first_instance + i];
            *to++ = (struct part){shape, &s->scene->instances[place], r, i};
        }
        err = s->pause(s->user);
    }
    if (!err) qsort(s->parts, s->part_count, sizeof *s->parts, compare_parts);
    return err;
}

static void measure(struct spreading *s, const struct place *place)
{
    s->area += (double)place->at.area * (place->material->double_sided ? 2 : 1);
}

// --- points -------------------------------------------------------------------------------------

static float diffuse_share(const struct spreading *s, const struct place *place, float u, float v)
{
    const struct bd_material *m = place->material;
    if (s->lambert) return 1;
    return 1 - m->metallic * bd_map_data_at(s->scene, &m->metallic_roughness_map, place->primitive,
                                            place->index, u, v)
                                 .rgb.z;
}

// Uniform over the triangle (Osada et al. 2002).
static void add_point(struct spreading *s, const struct place *place, bool is_behind)
{
    float number[2];
    bd_sequence_pair(&s->sequence, s->next, number);
    const float root = sqrtf(number[0]), u = root * (1 - number[1]), v = root * number[1];
    const struct bd_map_texel color =
        bd_base_color_at(s->scene, place->primitive, place->index, u, v);
    if (bd_is_cut_out(place->material, color.alpha)) return;
    s->points->points[s->points->count++] = (struct bd_surface_point){
        .position = bd_triangle_place_at(&place->at, u, v),
        .normal = f3_scale(place->at.normal, is_behind ? -1 : 1),
        .diffuse = f3_scale(color.rgb, diffuse_share(s, place, u, v)),
        .triangle = place->number,
    };
}

// Where the next point lies on the way through all area, before `s->passed` plus this much.
static bool has_next_before(const struct spreading *s, double area)
{
    return s->next < s->asked && (s->next + 0.5) * s->area < (s->passed + area) * s->asked;
}

static void spread(struct spreading *s, const struct place *place)
{
    for (int side = 0; side < (place->material->double_sided ? 2 : 1); side++) {
        for (; has_next_before(s, place->at.area); s->next++) add_point(s, place, side == 1);
        s->passed += place->at.area;
    }
}

enum bd_err bd_surface_points_init(struct bd_surface_points *points, const struct bd_scene *scene,
                                   uint32_t count, bool lambert, enum bd_err (*pause)(void *user),
                                   void *user, struct bd_fault *fault)
{
    BD_ASSERT(count > 0 && count <= BD_SURFACE_POINTS_MAX);
    *points = (struct bd_surface_points){.points = malloc(count * sizeof *points->points)};
    if (!points->points)
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "vpls", "no memory for %u points", count);
    struct spreading s = {
        .points = points,
        .scene = scene,
        .space = bd_render_space_of(scene),
        .sequence = bd_sequence_of(0, 0),
        .lambert = lambert,
        .pause = pause,
        .user = user,
        .asked = count,
    };
    bd_triangle_order_init(&s.order, scene);
    enum bd_err err = list_parts(&s);
    if (!err) err = visit_all(&s, measure);
    points->area = (float)(s.area / count);
    if (!err && s.area > 0) err = visit_all(&s, spread);
    bd_triangle_order_finish(&s.order);
    free(s.parts);
    if (err == BD_ERR_NO_MEMORY)
        bd_fault_set(fault, err, "vpls", "no memory for the scene's parts");
    if (err) bd_surface_points_finish(points);
    return err;
}

void bd_surface_points_finish(struct bd_surface_points *points)
{
    free(points->points);
    *points = (struct bd_surface_points){0};
}
