#include "reference/geometry.h"

#include <embree3/rtcore.h>
#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/huge_pages.h"
#include "reference/flatten.h"
#include "reference/sampler.h"
#include "reference/vec3f.h"

// Counted at every ray: not through the loader's general model of such variables.
static _Thread_local uint64_t ray_count __attribute__((tls_model("initial-exec")));
static _Thread_local uint64_t refused_ray_count __attribute__((tls_model("initial-exec")));

uint64_t bd_geometry_ray_count(void)
{
    return ray_count;
}

uint64_t bd_geometry_refused_ray_count(void)
{
    return refused_ray_count;
}

// --- reference space ----------------------------------------------------------------------------

static void set_space(struct bd_geometry *g)
{
    const struct bd_features *f = &g->scene->features;
    int exponent;
    frexp(f->diagonal_m, &exponent);
    g->units_per_m = ldexp(1.0, 1 - exponent);
    g->origin_m = bd_scene_origin_m(f);
    // A margin: the origin is not quite in the middle, and positions are rounded to 32 bits.
    g->radius = 0.5 * f->diagonal_m * g->units_per_m * 1.004;
}

bd_dvec3 bd_geometry_place(const struct bd_geometry *geometry, bd_dvec3 world)
{
    return bd_dvec3_scale(bd_dvec3_sub(world, geometry->origin_m), geometry->units_per_m);
}

// --- shapes -----------------------------------------------------------------------------------

struct bd_shape {
    uint32_t reference_count; // atomic
    struct bd_scene *scene;   // retained: Embree reads the indices of its meshes
    RTCDevice device;
    RTCScene embree;
    struct bd_shape_arrays arrays;
    struct bd_flat_counts counts;
    int64_t embree_bytes; // atomic: what Embree holds
};

// What a part's triangles, their shading corners and Embree's filters are made from.
#define SHAPE_ASPECTS                                                                              \
    (BD_ASPECT_BIT(GEOMETRY) | BD_ASPECT_BIT(TRANSFORMS) | BD_ASPECT_BIT(ALPHA) |                  \
     BD_ASPECT_BIT(NORMALS))

static bool has_same_shape(const struct bd_scene *a, const struct bd_scene *b)
{
    for (uint32_t i = 0; i < BD_ASPECT_COUNT; i++)
        if (SHAPE_ASPECTS >> i & 1 && a->aspects.counter[i] != b->aspects.counter[i]) return false;
    return true;
}

static enum bd_err make_shape(const struct bd_scene *scene, struct bd_shape **out,
                              struct bd_err_detail *detail)
{
    struct bd_shape *shape = *out = calloc(1, sizeof *shape);
    BD_ASSERT(shape);
    shape->reference_count = 1;
    shape->scene = bd_scene_retain((struct bd_scene *)scene);
    const struct bd_flat_counts counts = shape->counts = bd_flatten_count(scene);
    struct bd_shape_arrays *arrays = &shape->arrays;
    // Embree reads 16 bytes at the last vertex.
    arrays->positions = bd_huge_pages_alloc((3 * counts.vertices + 1) * sizeof *arrays->positions);
    arrays->triangles = bd_huge_pages_alloc(counts.triangles * sizeof *arrays->triangles);
    arrays->tangents = bd_huge_pages_alloc(counts.bent_triangles * sizeof *arrays->tangents);
    if (!arrays->positions || !arrays->triangles || !arrays->tangents)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference",
                          "no memory for %zu vertices and %zu triangles", counts.vertices,
                          counts.triangles);
    arrays->positions[3 * counts.vertices] = 0;
    return BD_ERR_OK;
}

static void drop_shape(struct bd_shape **shape)
{
    struct bd_shape *s = *shape;
    *shape = NULL;
    if (!s || __atomic_sub_fetch(&s->reference_count, 1, __ATOMIC_ACQ_REL) > 0) return;
    if (s->embree) rtcReleaseScene(s->embree);
    if (s->device) rtcReleaseDevice(s->device);
    free(s->arrays.positions);
    free(s->arrays.triangles);
    free(s->arrays.tangents);
    bd_scene_release(&s->scene);
    free(s);
}

struct bd_shape_arrays bd_shape_arrays_of(const struct bd_shape *shape)
{
    return shape->arrays;
}

uint64_t bd_shape_memory_bytes(const struct bd_shape *shape)
{
    int64_t embree_bytes = __atomic_load_n(&shape->embree_bytes, __ATOMIC_RELAXED);
    return (uint64_t)(embree_bytes > 0 ? embree_bytes : 0) +
           shape->counts.vertices * 3 * sizeof *shape->arrays.positions +
           shape->counts.triangles * sizeof *shape->arrays.triangles +
           shape->counts.bent_triangles * sizeof *shape->arrays.tangents;
}

uint64_t bd_geometry_own_bytes(const struct bd_geometry *geometry)
{
    return geometry->part_count * sizeof *geometry->parts;
}

// --- building -----------------------------------------------------------------------------------

static void set_hit(const struct bd_part *part, uint32_t triangle, float u, float v,
                    struct bd_hit *hit)
{
    *hit = (struct bd_hit){
        .instance = part->instance,
        .primitive = part->primitive,
        .triangle = triangle,
        .u = u,
        .v = v,
        .corners = part->triangles[triangle].shading,
        .tangents = part->tangents ? part->tangents[triangle].corner : NULL,
    };
}

// What the filters need to know of the ray, behind what Embree needs.
struct context {
    struct RTCIntersectContext embree;
    const struct bd_geometry *geometry;
    const struct bd_ray *ray;
};

static const struct context *context_of(const struct RTCFilterFunctionNArguments *args)
{
    return (const struct context *)(const void *)args->context;
}

// Of what is not opaque.
static float presence(const struct bd_geometry *geometry, const struct bd_part *part,
                      const struct bd_hit *hit, enum bd_alpha_reading reading)
{
    const struct bd_material *material = part->material;
    const float alpha = bd_surface_alpha(geometry->scene, hit);
    if (material->alpha_mode == BD_ALPHA_MASK) return alpha >= material->alpha_cutoff ? 1 : 0;
    if (reading == BD_ALPHA_AS_MASK) return alpha >= 0.5f ? 1 : 0;
    return alpha;
}

float bd_geometry_presence(const struct bd_geometry *geometry,
                           const struct bd_intersection *intersection, enum bd_alpha_reading alpha)
{
    const struct bd_part *part = intersection->part;
    if (part->material->alpha_mode == BD_ALPHA_OPAQUE) return 1;
    return presence(geometry, part, &intersection->hit, alpha);
}

static bool is_there(const struct context *context, const struct bd_part *part,
                     const struct RTCHit *at)
{
    struct bd_hit hit;
    set_hit(part, at->primID, at->u, at->v, &hit);
    const float often = presence(context->geometry, part, &hit, context->ray->alpha);
    // By ray and triangle: the order in which Embree asks plays no part.
    uint64_t triangle = (uint64_t)at->geomID << 32 | at->primID;
    uint64_t draw = bd_mix64(bd_mix64(triangle) + context->ray->coverage_seed);
    return (float)(draw >> 40) * 0x1p-24f < often;
}

static void filter_by_alpha(const struct RTCFilterFunctionNArguments *args)
{
    const struct context *context = context_of(args);
    BD_ASSERT_CMP(args->N, ==, 1);
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
    if (*args->valid && !is_there(context, &context->geometry->parts[hit->geomID], hit))
        *args->valid = 0;
}

// Embree's normal follows the winding, as seen in reference space.
static bool is_seen_from_behind(const struct bd_part *part, const struct RTCHit *hit,
                                const struct bd_ray *ray)
{
    if (part->material->double_sided) return false;
    const float normal[3] = {hit->Ng_x, hit->Ng_y, hit->Ng_z};
    return (bd_vec3f_dot(normal, ray->direction) > 0) != part->mirrored;
}

static void filter_backs(const struct RTCFilterFunctionNArguments *args)
{
    const struct context *context = context_of(args);
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
    if (is_seen_from_behind(&context->geometry->parts[hit->geomID], hit, context->ray))
        *args->valid = 0;
}

static void attach(struct bd_geometry *g, uint32_t index)
{
    const struct bd_part *part = &g->parts[index];
    RTCGeometry triangles = rtcNewGeometry(g->shape->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               part->position, 0, 3 * sizeof(float), part->primitive->vertex_count);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               part->primitive->index, 0, 3 * sizeof(uint32_t),
                               part->primitive->index_count / 3);
    if (part->material->alpha_mode != BD_ALPHA_OPAQUE) {
        rtcSetGeometryIntersectFilterFunction(triangles, filter_by_alpha);
        rtcSetGeometryOccludedFilterFunction(triangles, filter_by_alpha);
    }
    rtcSetGeometryBuildQuality(triangles, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(g->embree, triangles, index);
    rtcReleaseGeometry(triangles);
}

// From any of Embree's threads, before it allocates and after it frees.
static bool count_memory(void *user, ssize_t bytes, bool after)
{
    (void)after;
    __atomic_fetch_add((int64_t *)user, bytes, __ATOMIC_RELAXED);
    return true;
}

// Whom to ask whether to go on, and the answer that was not to.
struct watch {
    bd_reference_should_stop should_stop;
    void *user;
    _Atomic enum bd_err answer;
};

// From any of Embree's threads, several at once, between blocks of triangles.
static bool go_on(void *user, double share)
{
    struct watch *watch = user;
    (void)share;
    if (!watch->should_stop) return true;
    if (atomic_load(&watch->answer)) return false;
    enum bd_err err = watch->should_stop(watch->user);
    if (err) atomic_store(&watch->answer, err);
    return !err;
}

static enum bd_err build(struct bd_geometry *g, uint32_t thread_count, struct watch *watch,
                         struct bd_err_detail *detail)
{
    char config[32];
    snprintf(config, sizeof config, "threads=%u", thread_count);
    struct bd_shape *shape = g->shape;
    shape->device = rtcNewDevice(config);
    if (!shape->device)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "reference", "Embree does not start: %d",
                          (int)rtcGetDeviceError(NULL));
    rtcSetDeviceMemoryMonitorFunction(shape->device, count_memory, &shape->embree_bytes);
    g->embree = shape->embree = rtcNewScene(shape->device);
    // Robust: no ray slips between two triangles that share an edge.
    rtcSetSceneFlags(g->embree, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcSetSceneBuildQuality(g->embree, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneProgressMonitorFunction(g->embree, go_on, watch);
    for (uint32_t p = 0; p < g->part_count; p++) attach(g, p);
    rtcCommitScene(g->embree);
    rtcSetSceneProgressMonitorFunction(g->embree, NULL, NULL);
    enum RTCError error = rtcGetDeviceError(shape->device);
    if (atomic_load(&watch->answer)) return atomic_load(&watch->answer);
    if (error == RTC_ERROR_NONE) return BD_ERR_OK;
    return bd_err_set(detail, error == RTC_ERROR_OUT_OF_MEMORY ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL,
                      "reference", "the acceleration structure of %llu triangles: Embree error %d",
                      (unsigned long long)g->scene->features.triangle_count, (int)error);
}

static enum bd_err make_parts(struct bd_geometry *geometry, struct bd_err_detail *detail)
{
    const size_t count = geometry->shape->counts.parts;
    geometry->parts = calloc(count + 1, sizeof *geometry->parts);
    if (geometry->parts) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for %zu primitives", count);
}

enum bd_err bd_geometry_init(struct bd_geometry *geometry, const struct bd_scene *scene,
                             uint32_t thread_count, bd_reference_should_stop should_stop,
                             void *user, struct bd_err_detail *detail)
{
    *geometry = (struct bd_geometry){.scene = scene};
    set_space(geometry);
    enum bd_err err = make_shape(scene, &geometry->shape, detail);
    if (!err) err = make_parts(geometry, detail);
    if (err) return err;
    bd_flatten(geometry);
    struct watch watch = {.should_stop = should_stop, .user = user};
    if (!go_on(&watch, 0)) return atomic_load(&watch.answer);
    return build(geometry, thread_count, &watch, detail);
}

bool bd_geometry_init_like(struct bd_geometry *geometry, const struct bd_scene *scene,
                           const struct bd_geometry *like)
{
    *geometry = (struct bd_geometry){.scene = scene};
    if (!has_same_shape(scene, like->scene)) return false;
    geometry->shape = like->shape;
    __atomic_add_fetch(&geometry->shape->reference_count, 1, __ATOMIC_RELAXED);
    set_space(geometry);
    geometry->embree = geometry->shape->embree;
    if (make_parts(geometry, NULL)) {
        bd_geometry_finish(geometry);
        return false;
    }
    bd_flatten_like(geometry, like);
    return true;
}

void bd_geometry_finish(struct bd_geometry *geometry)
{
    drop_shape(&geometry->shape);
    free(geometry->parts);
    *geometry = (struct bd_geometry){0};
}

// --- points of triangles ------------------------------------------------------------------------

void bd_geometry_point(const struct bd_part *part, uint32_t triangle, float u, float v,
                       struct bd_intersection *out)
{
    out->part = part;
    set_hit(part, triangle, u, v, &out->hit);
    const struct bd_triangle *shape = &part->triangles[triangle];
    bd_vec3f_copy(out->hit.normal_geometric, shape->normal);
    bd_triangle_point(shape, u, v, out->position, &out->clearance);
}

bool bd_intersection_is_behind(const struct bd_intersection *intersection, const float direction[3])
{
    if (intersection->part->material->double_sided) return false;
    return bd_vec3f_dot(intersection->hit.normal_geometric, direction) > 0;
}

// --- rays ---------------------------------------------------------------------------------------

// Embree's FLT_LARGE: it computes with squares and products of two such numbers. Builds of it that
// have their assertions end the process at a ray beyond.
#define EMBREE_REACH 1.844e18f

static bool is_within_reach(const float v[3])
{
    return fabsf(v[0]) <= EMBREE_REACH && fabsf(v[1]) <= EMBREE_REACH &&
           fabsf(v[2]) <= EMBREE_REACH;
}

// The gate: no ray goes to Embree but through here. Cameras, punctual lights and their distances
// may be as large beside the scene as two numbers of a file allow, and what is computed of them may
// be no number at all. Imports and edits bound what cameras and lights are made of, but journals of
// earlier versions hold larger numbers, and quotients of two allowed ones are as large (a punctual
// light 1e15 m away beside a scene of 1e-6 m). Each comparison is false for NaN. What begins at
// infinity is no fault: it is empty. Triangles with such vertices are left out by Embree's builder
// itself.
static bool admit(const struct bd_ray *ray)
{
    ray_count++;
    bool is_within = is_within_reach(ray->origin) && is_within_reach(ray->direction) &&
                     ray->near >= 0 && !isnan(ray->far);
    if (!is_within) refused_ray_count++;
    return is_within && ray->near <= FLT_MAX;
}

static struct RTCRay embree_ray(const struct bd_ray *ray)
{
    return (struct RTCRay){
        .org_x = ray->origin[0],
        .org_y = ray->origin[1],
        .org_z = ray->origin[2],
        .tnear = ray->near,
        .dir_x = ray->direction[0],
        .dir_y = ray->direction[1],
        .dir_z = ray->direction[2],
        .tfar = ray->far,
        .mask = UINT32_MAX,
    };
}

bool bd_geometry_intersect(const struct bd_geometry *geometry, const struct bd_ray *ray,
                           enum bd_sight sight, struct bd_intersection *out)
{
    if (!admit(ray)) return false;
    struct context context = {.geometry = geometry, .ray = ray};
    rtcInitIntersectContext(&context.embree);
    if (sight == BD_SIGHT_FRONTS_ONLY) context.embree.filter = filter_backs;
    struct RTCRayHit query = {.ray = embree_ray(ray)};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(geometry->embree, &context.embree, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    bd_geometry_point(&geometry->parts[query.hit.geomID], query.hit.primID, query.hit.u,
                      query.hit.v, out);
    out->distance = query.ray.tfar;
    return true;
}

bool bd_geometry_is_blocked(const struct bd_geometry *geometry, const struct bd_ray *ray)
{
    if (!admit(ray)) return false;
    struct context context = {.geometry = geometry, .ray = ray};
    rtcInitIntersectContext(&context.embree);
    struct RTCRay query = embree_ray(ray);
    rtcOccluded1(geometry->embree, &context.embree, &query);
    return query.tfar < 0;
}
