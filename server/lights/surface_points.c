#include "lights/surface_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "lights/sequence.h"
#include "lights/surface.h"
#include "scene/model/triangle_order.h"

#define PAUSE_EVERY 4096u // triangles

// Of render space: where a part's corners differ by less, they are the same.
#define STEPS_PER_UNIT 99991.0
// Of the longest side of a part's box: where parts' corners differ by less, they are of one shape.
// A round number of steps, and no round place between them: corners lie at halves and thirds.
#define STEPS_PER_SIDE 1000.0
#define BETWEEN_STEPS  0.31

// A primitive of an instance. What has another colour lies elsewhere in the order of triangles, and
// its points shall be the same; nor shall the scene's scale and place count, which round positions
// otherwise: parts go by where a few of their corners lie in render space, to a hundred-thousandth.
//
// Where what is moved is to keep its points (is_kept), they go by their shapes, and those of one
// shape by which comes first along an axis that no wall is upright on: who passes none of them
// keeps its place among them.
struct part {
    uint64_t name; // hash of those, or of a few corners in the mesh's box
    double along;  // 0 where places are told apart already
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
    struct bd_surface_points_how how;
    enum bd_err (*pause)(void *user);
    void *user;
    double area, each; // of all; that each point stands for
    uint32_t next;     // of all points that were asked for
    // Of all parts, or where they are kept of this one: its triangles' area so far, where its first
    // point lies, and the next one's number.
    double passed, start;
    uint32_t next_of_part, chance;
    struct bd_sequence sequence;
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

static bool only_hides(const struct spreading *s)
{
    return s->how.sends == BD_SENDS_NOTHING;
}

static int sides_of(const struct spreading *s, const struct bd_material *material)
{
    return material->double_sided && !only_hides(s) && !s->how.once ? 2 : 1;
}

static enum bd_err visit_part(struct spreading *s, const struct part *part, visit_fn *visit)
{
    const struct bd_triangle_run *run = &s->order.runs[part->run];
    const struct bd_primitive *primitive = primitive_of(s, run);
    struct place place = {.primitive = primitive,
                          .material = &s->scene->materials[primitive->material]};
    enum bd_err err = BD_ERR_OK;
    if (place.material->unlit && !only_hides(s) && !s->how.once) return err;
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

// Where they are kept each has numbers of its own, that no other part changes. Those of one shape
// round their shares of points up and down in turn: rounded alike, all leaves of a tree might have
// none.
static void enter_part(struct spreading *s, const struct part *part, uint32_t alike)
{
    const uint32_t shape = (uint32_t)part->name ^ (uint32_t)(part->name >> 32);
    const double golden = 0.61803398874989485, first = bd_stirred(shape) * 0x1p-32;
    const double turns = first + golden * alike;
    s->passed = 0;
    s->start = turns - floor(turns);
    s->next_of_part = 0;
    s->chance = bd_stirred(shape + alike * 0x9e3779b9u);
    s->sequence = bd_sequence_of(s->how.seed, s->chance);
}

static enum bd_err visit_all(struct spreading *s, visit_fn *visit)
{
    enum bd_err err = BD_ERR_OK;
    uint32_t alike = 0;
    for (size_t i = 0; !err && i < s->part_count; i++) {
        alike = i > 0 && s->parts[i].name == s->parts[i - 1].name ? alike + 1 : 0;
        if (s->how.is_kept) enter_part(s, &s->parts[i], alike);
        err = visit_part(s, &s->parts[i], visit);
    }
    return err;
}

#define CORNERS_HASHED 8u

static uint64_t place_of(const struct spreading *s, const struct bd_primitive *primitive,
                         const struct bd_instance *instance)
{
    uint64_t hash = bd_hash64(&primitive->index_count, sizeof primitive->index_count, 0);
    for (uint32_t i = 0; i < CORNERS_HASHED; i++) {
        const uint64_t at = (uint64_t)(primitive->index_count - 1) * i / (CORNERS_HASHED - 1);
        const float *position = primitive->position + 3 * (size_t)primitive->index[at];
        const f3 corner = bd_shading_vertex_of(&s->space, instance, position);
        const int64_t steps[3] = {llround(STEPS_PER_UNIT * corner.x),
                                  llround(STEPS_PER_UNIT * corner.y),
                                  llround(STEPS_PER_UNIT * corner.z)};
        hash = bd_hash64(steps, sizeof steps, hash);
    }
    return hash;
}

static uint64_t shape_of(const struct bd_primitive *primitive)
{
    const float *least = primitive->bounds_min, *most = primitive->bounds_max;
    const double side = fmax(fmax((double)most[0] - least[0], (double)most[1] - least[1]),
                             (double)most[2] - least[2]);
    uint64_t hash = bd_hash64(&primitive->index_count, sizeof primitive->index_count, 0);
    for (uint32_t i = 0; side > 0 && i < CORNERS_HASHED; i++) {
        const uint64_t at = (uint64_t)(primitive->index_count - 1) * i / (CORNERS_HASHED - 1);
        const float *position = primitive->position + 3 * (size_t)primitive->index[at];
        int64_t steps[3];
        for (int a = 0; a < 3; a++)
            steps[a] = (int64_t)floor(((double)position[a] - least[a]) / side * STEPS_PER_SIDE +
                                      BETWEEN_STEPS);
        hash = bd_hash64(steps, sizeof steps, hash);
    }
    return hash;
}

static double place_along(const struct spreading *s, const struct bd_primitive *primitive,
                          const struct bd_instance *instance)
{
    const f3 at = bd_shading_vertex_of(&s->space, instance,
                                       primitive->position + 3 * (size_t)primitive->index[0]);
    return 0.2113 * (double)at.x + 0.5774 * (double)at.y + 0.7887 * (double)at.z;
}

static struct part part_of(const struct spreading *s, const struct bd_primitive *primitive,
                           const struct bd_instance *instance, uint32_t run, uint32_t index)
{
    if (!s->how.is_kept)
        return (struct part){place_of(s, primitive, instance), 0, instance, run, index};
    return (struct part){shape_of(primitive), place_along(s, primitive, instance), instance, run,
                         index};
}

static int compare_parts(const void *a, const void *b)
{
    const struct part *x = a, *y = b;
    if (x->name != y->name) return x->name < y->name ? -1 : 1;
    if (x->along != y->along) return x->along < y->along ? -1 : 1;
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
        const struct bd_primitive *primitive = primitive_of(s, run);
        for (uint32_t i = 0; !err && i < run->instance_count; i++) {
            const uint32_t place = order->instances[run->first_instance + i];
            const struct bd_instance *instance = &s->scene->instances[place];
            *to++ = part_of(s, primitive, instance, r, i);
            if (i % PAUSE_EVERY == 0) err = s->pause(s->user);
        }
    }
    if (!err) qsort(s->parts, s->part_count, sizeof *s->parts, compare_parts);
    return err;
}

static void measure(struct spreading *s, const struct place *place)
{
    s->area += (double)place->at.area * sides_of(s, place->material);
}

// --- points -------------------------------------------------------------------------------------

static bool is_left_out(const struct spreading *s, const struct bd_material *material, float alpha)
{
    const bool by_chance = material->alpha_mode == BD_ALPHA_BLEND && s->how.by_coverage;
    return by_chance ? bd_stirred(s->next_of_part ^ s->chance) * 0x1p-32 >= alpha
                     : bd_is_cut_out(material, alpha);
}

// Every so many of a sequence are no sequence: sets have parts of it.
static uint32_t number_in_sequence(const struct spreading *s)
{
    const uint32_t set = s->next % BD_SURFACE_POINT_SETS, in_set = s->next / BD_SURFACE_POINT_SETS;
    return only_hides(s) ? set * (BD_SURFACE_POINTS_MAX / BD_SURFACE_POINT_SETS) + in_set
                         : s->next_of_part;
}

// Uniform over the triangle (Osada et al. 2002).
static uint32_t number_of_point(const struct spreading *s)
{
    if (only_hides(s)) return s->next;
    return s->how.is_kept ? bd_stirred(s->chance + s->next_of_part) : 0;
}

static void add_point(struct spreading *s, const struct place *place, bool is_behind)
{
    float number[2];
    bd_sequence_pair(&s->sequence, number_in_sequence(s), number);
    const float root = sqrtf(number[0]), u = root * (1 - number[1]), v = root * number[1];
    const struct bd_map_texel color =
        bd_base_color_at(s->scene, place->primitive, place->index, u, v);
    if (is_left_out(s, place->material, color.alpha)) return;
    struct bd_surface_point *to = &s->points->points[s->points->count++];
    *to = (struct bd_surface_point){
        .position = bd_triangle_place_at(&place->at, u, v),
        .normal = f3_scale(place->at.normal, is_behind ? -1 : 1),
        .triangle = place->number,
        .is_two_sided = place->material->double_sided,
        .number = number_of_point(s),
    };
    if (!only_hides(s) && !place->material->unlit)
        to->diffuse =
            bd_sent_beside_interface(s->scene, place->primitive, place->index, u, v, s->how.sends,
                                     bd_diffuse_of(s->scene, place->primitive, place->index, u, v,
                                                   color.rgb, s->how.sends, BD_FROM_EVERYWHERE));
}

// Where the next point lies on the way through all area, or the part's, before `s->passed` plus
// this much.
static bool has_next_before(const struct spreading *s, double area)
{
    const double at = (s->next_of_part + s->start) * s->each;
    return s->next < s->how.count && at < s->passed + area;
}

static void spread(struct spreading *s, const struct place *place)
{
    for (int side = 0; side < sides_of(s, place->material); side++) {
        for (; has_next_before(s, place->at.area); s->next++, s->next_of_part++)
            add_point(s, place, side == 1);
        s->passed += place->at.area;
    }
}

// In steps of less than a sixtieth, up: where one part's area changes a little, others' points are
// as many as before.
#define STEPS_PER_OCTAVE_BITS 17u
static float area_of_each(double area)
{
    const uint32_t last = (1u << STEPS_PER_OCTAVE_BITS) - 1;
    return f_of_bits((f_bits((float)area) + last) & ~last);
}

enum bd_err bd_surface_points_init(struct bd_surface_points *points, const struct bd_scene *scene,
                                   const struct bd_surface_points_how *how,
                                   enum bd_err (*pause)(void *user), void *user,
                                   struct bd_err_detail *detail)
{
    const uint32_t count = how->count;
    BD_ASSERT(count > 0 && count <= BD_SURFACE_POINTS_MAX);
    *points = (struct bd_surface_points){.points = malloc(count * sizeof *points->points)};
    if (!points->points)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u points", count);
    struct spreading s = {
        .points = points,
        .scene = scene,
        .space = bd_render_space_of(scene),
        .how = *how,
        .start = 0.5,
        .sequence = bd_sequence_of(how->seed, 0),
        .pause = pause,
        .user = user,
    };
    bd_triangle_order_init(&s.order, scene);
    enum bd_err err = list_parts(&s);
    if (!err) err = visit_all(&s, measure);
    s.each = how->is_kept ? (double)area_of_each(s.area / count) : s.area / count;
    points->area = (float)s.each;
    if (!err && s.area > 0) err = visit_all(&s, spread);
    bd_triangle_order_finish(&s.order);
    free(s.parts);
    if (err == BD_ERR_NO_MEMORY) bd_err_set(detail, err, "vpls", "no memory for the scene's parts");
    if (err) bd_surface_points_finish(points);
    return err;
}

void bd_surface_points_finish(struct bd_surface_points *points)
{
    free(points->points);
    *points = (struct bd_surface_points){0};
}
