// Batches of rays: the gate before Embree, what does not count as a hit, and the threads.

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "rays/cutout.h"
#include "rays/structure.h"

// A multiple of 32, so that no two threads write one word of bits.
#define RAYS_PER_PIECE 1024u

// What is known of the ray, behind what Embree needs.
struct context {
    struct RTCIntersectContext embree;
    const struct bd_rays *rays;
    const struct bd_rays_level *level; // that is traced
    enum bd_rays_alpha alpha;
    uint32_t sub_frame; // of BD_RAYS_ALPHA_MASK
    float origin[3], direction[3];
    uint32_t excluded[2];
    float far;
    bool passes_backs;
    struct bd_ray_hit first; // of what was met so far
};

static const struct context *context_of(const struct RTCFilterFunctionNArguments *arguments)
{
    return (const struct context *)(const void *)arguments->context;
}

// --- what does not count ----------------------------------------------------------------------

// What the ray starts or ends on, and what is no more.
static bool is_passed_over(const struct context *context, uint32_t number)
{
    return number == context->excluded[0] || number == context->excluded[1] ||
           number == BD_NO_TRIANGLE;
}

static void filter_occluded(const struct RTCFilterFunctionNArguments *arguments)
{
    const struct context *context = context_of(arguments);
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)arguments->hit;
    if (is_passed_over(context, bd_rays_number(context->rays, context->level, hit)))
        arguments->valid[0] = 0;
}

// The ray is in the space of the triangle: placed, one of a mirrored instance has its winding
// turned round, in its mesh's own frame it has not.
static bool is_passed_back(const struct context *context, const struct RTCRay *ray,
                           const struct RTCHit *hit, uint32_t number)
{
    const bool turned =
        hit->Ng_x * ray->dir_x + hit->Ng_y * ray->dir_y + hit->Ng_z * ray->dir_z > 0;
    uint32_t triangle;
    const struct bd_triangle_run *run = bd_rays_run(context->rays, number, &triangle);
    const bool mirrored = run->mirrored && hit->instID[0] == RTC_INVALID_GEOMETRY_ID;
    const struct bd_scene *scene = context->rays->scene;
    const int32_t material = scene->meshes[run->mesh]->primitives[run->primitive].material;
    return turned != mirrored && !scene->materials[material].double_sided;
}

// A triangle's distance is rounded otherwise than that of the box that it is in: behind a triangle
// that is as near, a box is passed over or not, and which of them comes first is the tree's. So
// rays go on by as much as the two may differ (BD_RAY_BEHIND), and what counts is decided by
// triangles alone.
//
// Of two triangles at one distance the first by number, whichever is come to first.
static void filter_nearest(const struct RTCFilterFunctionNArguments *arguments)
{
    struct context *context = (struct context *)(void *)arguments->context;
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)arguments->hit;
    struct RTCRay *ray = (struct RTCRay *)(void *)arguments->ray;
    const float distance = ray->tfar;
    const uint32_t number = bd_rays_number(context->rays, context->level, hit);
    const struct bd_ray_hit *first = &context->first;
    if (is_passed_over(context, number) || distance > first->distance ||
        (distance == first->distance && number > first->triangle) ||
        (context->passes_backs && is_passed_back(context, ray, hit, number))) {
        arguments->valid[0] = 0;
        return;
    }
    context->first = (struct bd_ray_hit){number, hit->u, hit->v, distance};
    ray->tfar = fminf(distance * (1 + BD_RAY_BEHIND), context->far);
}

void bd_rays_filter_cutout(const struct RTCFilterFunctionNArguments *arguments)
{
    const struct context *context = context_of(arguments);
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)arguments->hit;
    const uint32_t number = bd_rays_number(context->rays, context->level, hit);
    const struct bd_scene *scene = context->rays->scene;
    if (number == BD_NO_TRIANGLE) {
        arguments->valid[0] = 0;
        return;
    }
    uint32_t triangle;
    const struct bd_primitive *primitive = bd_rays_primitive(context->rays, number, &triangle);
    const struct bd_material *material = &scene->materials[primitive->material];
    const float alpha = bd_cutout_alpha(scene, primitive, triangle, hit->u, hit->v);
    const bool blends = material->alpha_mode == BD_ALPHA_BLEND;
    bool is_there = alpha >= bd_scene_least_alpha(scene, primitive->material, context->sub_frame);
    if (blends && context->alpha == BD_RAYS_ALPHA_COVERAGE)
        is_there = bd_rays_chance(context->origin, context->direction, number) < alpha;
    if (blends && context->alpha == BD_RAYS_ALPHA_ANY) is_there = alpha > 0;
    if (!is_there) arguments->valid[0] = 0;
}

float bd_rays_opacity(const struct bd_rays *rays, const struct bd_ray_hit *hit)
{
    uint32_t triangle;
    const struct bd_primitive *primitive = bd_rays_primitive(rays, hit->triangle, &triangle);
    if (rays->scene->materials[primitive->material].alpha_mode != BD_ALPHA_BLEND) return 1;
    return bd_cutout_alpha(rays->scene, primitive, triangle, hit->u, hit->v);
}

static struct context context_for(const struct bd_rays *rays, enum bd_rays_alpha alpha,
                                  const struct RTCRay *ray, uint32_t first, uint32_t second)
{
    struct context context = {.rays = rays,
                              .alpha = alpha,
                              .origin = {ray->org_x, ray->org_y, ray->org_z},
                              .direction = {ray->dir_x, ray->dir_y, ray->dir_z},
                              .excluded = {first, second},
                              .far = ray->tfar,
                              .first = {.triangle = BD_NO_TRIANGLE, .distance = INFINITY}};
    rtcInitIntersectContext(&context.embree);
    return context;
}

// --- the gate ---------------------------------------------------------------------------------

// Embree's FLT_LARGE: builds of it that have their assertions end the process at a ray beyond.
#define EMBREE_REACH 1.844e18f

static float largest(const float v[3])
{
    return fmaxf(fabsf(v[0]), fmaxf(fabsf(v[1]), fabsf(v[2])));
}

// False for what is no number, too: fmaxf passes over those.
static bool is_within_reach(const float v[3])
{
    return fabsf(v[0]) <= EMBREE_REACH && fabsf(v[1]) <= EMBREE_REACH &&
           fabsf(v[2]) <= EMBREE_REACH;
}

// False for rays that nothing can lie on: such as cannot be traced, have no length, or are no
// longer than what is left out at their ends.
static bool make_ray(const float origin[3], const float direction[3], float near, float far,
                     struct RTCRay *out)
{
    if (!is_within_reach(origin) || !is_within_reach(direction) || !(near < far)) return false;
    *out = (struct RTCRay){
        .org_x = origin[0],
        .org_y = origin[1],
        .org_z = origin[2],
        .tnear = near,
        .dir_x = direction[0],
        .dir_y = direction[1],
        .dir_z = direction[2],
        .tfar = far,
        .mask = UINT32_MAX,
    };
    return near >= 0 && near <= FLT_MAX;
}

// --- segments ---------------------------------------------------------------------------------

// Within reach nothing overflows; what is shorter than 1e-19 has none.
static float length_of(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static bool is_occluded(const struct bd_rays *rays, enum bd_rays_alpha alpha,
                        const struct bd_segment *s)
{
    const float direction[3] = {s->to[0] - s->from[0], s->to[1] - s->from[1],
                                s->to[2] - s->from[2]};
    const float bias = BD_RAY_BIAS * fmaxf(largest(s->from), largest(s->to)) / length_of(direction);
    struct RTCRay ray;
    if (!make_ray(s->from, direction, bias, 1 - bias, &ray)) return false;
    struct context context = context_for(rays, alpha, &ray, s->from_triangle, s->to_triangle);
    const bool has_ends = s->from_triangle != BD_NO_TRIANGLE || s->to_triangle != BD_NO_TRIANGLE;
    for (uint32_t l = 0; l < rays->level_count && ray.tfar >= 0; l++) {
        context.level = &rays->levels[l];
        context.embree.filter = has_ends || context.level->has_stale ? filter_occluded : NULL;
        rtcOccluded1(context.level->part->top, &context.embree, &ray);
    }
    return ray.tfar < 0;
}

struct occluded {
    const struct bd_rays *rays;
    enum bd_rays_alpha alpha;
    const struct bd_segment *segments;
    size_t count;
    uint32_t *bits;
    _Atomic uint64_t asked;
};

static bool has_length(const struct bd_segment *s)
{
    return s->from[0] != s->to[0] || s->from[1] != s->to[1] || s->from[2] != s->to[2];
}

static void occlude_piece(void *user, uint32_t piece)
{
    struct occluded *batch = user;
    const size_t begin = (size_t)piece * RAYS_PER_PIECE;
    const size_t left = batch->count - begin,
                 end = begin + (left < RAYS_PER_PIECE ? left : RAYS_PER_PIECE);
    uint64_t asked = 0;
    for (size_t word = begin; word < end; word += 32) {
        uint32_t bits = 0;
        for (size_t i = word; i < end && i < word + 32; i++) {
            const struct bd_segment *segment = &batch->segments[i];
            if (!has_length(segment)) continue;
            bits |= (uint32_t)is_occluded(batch->rays, batch->alpha, segment) << (i - word);
            asked++;
        }
        batch->bits[word / 32] = bits;
    }
    atomic_fetch_add(&batch->asked, asked);
}

static void run_pieces(struct bd_pool *pool, size_t count, void (*work)(void *user, uint32_t piece),
                       void *user)
{
    const size_t pieces = (count + RAYS_PER_PIECE - 1) / RAYS_PER_PIECE;
    if (!pool) {
        for (size_t i = 0; i < pieces; i++) work(user, (uint32_t)i);
        return;
    }
    if (bd_pool_run(pool, (uint32_t)pieces, work, NULL, user)) return; // nobody stops it
}

uint64_t bd_rays_occluded(const struct bd_rays *rays, struct bd_pool *pool,
                          enum bd_rays_alpha alpha, const struct bd_segment *segments, size_t count,
                          uint32_t *bits)
{
    struct occluded batch = {rays, alpha, segments, count, bits, 0};
    run_pieces(pool, count, occlude_piece, &batch);
    return batch.asked;
}

// --- rays -------------------------------------------------------------------------------------

static struct bd_ray_hit nearest(const struct bd_rays *rays, enum bd_rays_alpha alpha,
                                 uint32_t sub_frame, const struct bd_ray *q)
{
    const struct bd_ray_hit none = {.triangle = BD_NO_TRIANGLE};
    const float bias = BD_RAY_BIAS * largest(q->origin) / length_of(q->direction);
    struct RTCRayHit query = {.hit.geomID = RTC_INVALID_GEOMETRY_ID,
                              .hit.instID = {RTC_INVALID_GEOMETRY_ID}};
    const float near = q->near > 0 ? q->near : bias;
    if (!make_ray(q->origin, q->direction, near, q->far, &query.ray)) return none;
    struct context context = context_for(rays, alpha, &query.ray, q->from_triangle, BD_NO_TRIANGLE);
    context.sub_frame = sub_frame;
    context.passes_backs = q->passes_backs;
    context.embree.filter = filter_nearest;
    for (uint32_t l = 0; l < rays->level_count; l++) {
        context.level = &rays->levels[l];
        rtcIntersect1(context.level->part->top, &context.embree, &query);
    }
    return context.first.triangle == BD_NO_TRIANGLE ? none : context.first;
}

struct nearest {
    const struct bd_rays *rays;
    enum bd_rays_alpha alpha;
    uint32_t sub_frame;
    const struct bd_ray *queries;
    size_t count;
    struct bd_ray_hit *hits;
};

static void trace_piece(void *user, uint32_t piece)
{
    const struct nearest *batch = user;
    const size_t begin = (size_t)piece * RAYS_PER_PIECE;
    for (size_t i = begin; i < batch->count && i < begin + RAYS_PER_PIECE; i++)
        batch->hits[i] = nearest(batch->rays, batch->alpha, batch->sub_frame, &batch->queries[i]);
}

void bd_rays_nearest(const struct bd_rays *rays, struct bd_pool *pool, enum bd_rays_alpha alpha,
                     const struct bd_ray *queries, size_t count, struct bd_ray_hit *hits)
{
    struct nearest batch = {rays, alpha, 0, queries, count, hits};
    run_pieces(pool, count, trace_piece, &batch);
}

void bd_rays_nearest_seen(const struct bd_rays *rays, struct bd_pool *pool, uint32_t sub_frame,
                          const struct bd_ray *queries, size_t count, struct bd_ray_hit *hits)
{
    struct nearest batch = {rays, BD_RAYS_ALPHA_MASK, sub_frame, queries, count, hits};
    run_pieces(pool, count, trace_piece, &batch);
}
