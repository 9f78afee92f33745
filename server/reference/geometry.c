#include "reference/geometry.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/large.h"
#include "reference/sampler.h"
#include "reference/vec3f.h"

// Counted at every ray: not through the loader's general model of such variables.
static _Thread_local uint64_t ray_count __attribute__((tls_model("initial-exec")));

uint64_t bd_geometry_ray_count(void)
{
    return ray_count;
}

// --- reference space ----------------------------------------------------------------------------

static void set_space(struct bd_geometry *g)
{
    const struct bd_features *f = &g->scene->features;
    int exponent;
    frexp(f->diagonal_m, &exponent);
    g->units_per_m = ldexp(1.0, 1 - exponent);
    g->origin_m = bd_dvec3_scale(bd_dvec3_add(f->bounds_min, f->bounds_max), 0.5);
    // A margin for the rounding of positions to 32 bits.
    g->radius = 0.5 * f->diagonal_m * g->units_per_m * 1.001;
}

bd_dvec3 bd_geometry_place(const struct bd_geometry *geometry, bd_dvec3 world)
{
    return bd_dvec3_scale(bd_dvec3_sub(world, geometry->origin_m), geometry->units_per_m);
}

// Linear part and its cofactors (the inverse transpose up to a factor), scaled by a power of two
// so that neither leaves the range of 32 bits.
struct linear {
    float normal_from_mesh[9], world_from_mesh[9];
};

static struct linear linear_of(const bd_dmat4 *m, bool mirrored)
{
    struct linear out;
    double largest = 0, a[9];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(m->m[4 * c + r]));
    int exponent = 0;
    frexp(largest, &exponent);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) a[3 * r + c] = ldexp(m->m[4 * c + r], -exponent);
    for (int r = 0; r < 3; r++) {
        const double *p = a + 3 * ((r + 1) % 3), *q = a + 3 * ((r + 2) % 3);
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            double cofactor = p[d] * q[e] - p[e] * q[d];
            out.normal_from_mesh[3 * r + c] = (float)(mirrored ? -cofactor : cofactor);
            out.world_from_mesh[3 * r + c] = (float)a[3 * r + c];
        }
    }
    return out;
}

// --- building -----------------------------------------------------------------------------------

static bool is_drawn(const struct bd_primitive *primitive)
{
    return primitive->index_count > 0;
}

static size_t count_parts(const struct bd_scene *scene, size_t *vertex_count,
                          size_t *triangle_count)
{
    size_t parts = 0;
    *vertex_count = *triangle_count = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_mesh *mesh = scene->meshes[scene->instances[i].mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            if (!is_drawn(&mesh->primitives[p])) continue;
            parts++;
            *vertex_count += mesh->primitives[p].vertex_count;
            *triangle_count += mesh->primitives[p].index_count / 3;
        }
    }
    return parts;
}

static float *place_vertices(const struct bd_geometry *g, const struct bd_part *part, float *to)
{
    const struct bd_primitive *primitive = part->primitive;
    for (uint32_t v = 0; v < primitive->vertex_count; v++, to += 3) {
        const float *p = primitive->position + 3 * (size_t)v;
        bd_dvec3 world =
            bd_dmat4_point(&part->instance->world_from_mesh, (bd_dvec3){p[0], p[1], p[2]});
        bd_dvec3 at = bd_geometry_place(g, world);
        bd_vec3f_set(to, (float)at.x, (float)at.y, (float)at.z);
    }
    return to;
}

static struct bd_triangle *shape_triangles(const struct bd_part *part, struct bd_triangle *to)
{
    const struct bd_primitive *primitive = part->primitive;
    for (uint32_t i = 0; i + 2 < primitive->index_count; i += 3) {
        const uint32_t *index = primitive->index + i;
        *to++ = bd_triangle_of(part->position + 3 * (size_t)index[0],
                               part->position + 3 * (size_t)index[1],
                               part->position + 3 * (size_t)index[2], part->mirrored);
    }
    return to;
}

static void fill_parts(struct bd_geometry *g)
{
    float *next = g->positions;
    struct bd_triangle *next_triangle = g->triangles;
    struct bd_shading_vertex *next_vertex = g->vertices;
    for (uint32_t i = 0; i < g->scene->instance_count; i++) {
        const struct bd_instance *instance = &g->scene->instances[i];
        const struct bd_mesh *mesh = g->scene->meshes[instance->mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            const struct bd_primitive *primitive = &mesh->primitives[p];
            if (!is_drawn(primitive)) continue;
            struct bd_part *part = &g->parts[g->part_count++];
            *part = (struct bd_part){
                .instance = instance,
                .primitive = primitive,
                .material = &g->scene->materials[primitive->material],
                .position = next,
                .triangles = next_triangle,
                .vertices = next_vertex,
                .mirrored = bd_dmat4_determinant3(&instance->world_from_mesh) < 0,
                .first_emitter = UINT32_MAX,
            };
            next = place_vertices(g, part, next);
            next_triangle = shape_triangles(part, next_triangle);
            struct linear linear = linear_of(&instance->world_from_mesh, part->mirrored);
            bd_shading_vertices(primitive, linear.normal_from_mesh, linear.world_from_mesh,
                                part->mirrored, next_vertex);
            next_vertex += primitive->vertex_count;
        }
    }
}

static void set_hit(const struct bd_part *part, uint32_t triangle, float u, float v,
                    struct bd_hit *hit)
{
    *hit = (struct bd_hit){
        .instance = part->instance,
        .primitive = part->primitive,
        .triangle = triangle,
        .u = u,
        .v = v,
        .vertices = part->vertices,
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

static bool is_there(const struct context *context, const struct bd_part *part,
                     const struct RTCHit *at)
{
    struct bd_hit hit;
    set_hit(part, at->primID, at->u, at->v, &hit);
    const struct bd_material *material = part->material;
    float alpha = bd_surface_alpha(context->geometry->scene, &hit);
    if (material->alpha_mode == BD_ALPHA_MASK) return alpha >= material->alpha_cutoff;
    if (context->ray->alpha == BD_ALPHA_AS_MASK) return alpha >= 0.5f;
    // By ray and triangle: the order in which Embree asks plays no part.
    uint64_t triangle = (uint64_t)at->geomID << 32 | at->primID;
    uint64_t draw = bd_mix64(bd_mix64(triangle) + context->ray->coverage_seed);
    return (float)(draw >> 40) * 0x1p-24f < alpha;
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
    RTCGeometry triangles = rtcNewGeometry(g->device, RTC_GEOMETRY_TYPE_TRIANGLE);
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

uint64_t bd_geometry_memory_bytes(const struct bd_geometry *geometry)
{
    int64_t embree_bytes = __atomic_load_n(&geometry->embree_bytes, __ATOMIC_RELAXED);
    return (uint64_t)(embree_bytes > 0 ? embree_bytes : 0) +
           geometry->part_count * sizeof *geometry->parts +
           geometry->vertex_count * (3 * sizeof(float) + sizeof *geometry->vertices) +
           geometry->triangle_count * sizeof *geometry->triangles;
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
                         struct bd_fault *fault)
{
    char config[32];
    snprintf(config, sizeof config, "threads=%u", thread_count);
    g->device = rtcNewDevice(config);
    if (!g->device)
        return bd_fault_set(fault, BD_ERR_UNSUPPORTED, "reference", "Embree does not start: %d",
                            (int)rtcGetDeviceError(NULL));
    rtcSetDeviceMemoryMonitorFunction(g->device, count_memory, &g->embree_bytes);
    g->embree = rtcNewScene(g->device);
    // Robust: no ray slips between two triangles that share an edge.
    rtcSetSceneFlags(g->embree, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcSetSceneBuildQuality(g->embree, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneProgressMonitorFunction(g->embree, go_on, watch);
    for (uint32_t p = 0; p < g->part_count; p++) attach(g, p);
    rtcCommitScene(g->embree);
    rtcSetSceneProgressMonitorFunction(g->embree, NULL, NULL);
    enum RTCError error = rtcGetDeviceError(g->device);
    if (atomic_load(&watch->answer)) return atomic_load(&watch->answer);
    if (error == RTC_ERROR_NONE) return BD_ERR_OK;
    return bd_fault_set(
        fault, error == RTC_ERROR_OUT_OF_MEMORY ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL, "reference",
        "the acceleration structure of %llu triangles: Embree error %d",
        (unsigned long long)g->scene->features.triangle_count, (int)error);
}

enum bd_err bd_geometry_init(struct bd_geometry *geometry, const struct bd_scene *scene,
                             uint32_t thread_count, bd_reference_should_stop should_stop,
                             void *user, struct bd_fault *fault)
{
    size_t vertex_count, triangle_count;
    *geometry = (struct bd_geometry){.scene = scene};
    set_space(geometry);
    size_t part_count = count_parts(scene, &vertex_count, &triangle_count);
    geometry->vertex_count = vertex_count;
    geometry->triangle_count = triangle_count;
    geometry->parts = calloc(part_count + 1, sizeof *geometry->parts);
    // Embree reads 16 bytes at the last vertex.
    geometry->positions = bd_large_alloc((3 * vertex_count + 1) * sizeof *geometry->positions);
    geometry->vertices = bd_large_alloc((vertex_count + 1) * sizeof *geometry->vertices);
    geometry->triangles = bd_large_alloc((triangle_count + 1) * sizeof *geometry->triangles);
    if (!geometry->parts || !geometry->positions || !geometry->vertices || !geometry->triangles)
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "reference",
                            "no memory for %zu vertices and %zu triangles", vertex_count,
                            triangle_count);
    geometry->positions[3 * vertex_count] = 0;
    fill_parts(geometry);
    struct watch watch = {.should_stop = should_stop, .user = user};
    if (!go_on(&watch, 0)) return atomic_load(&watch.answer);
    return build(geometry, thread_count, &watch, fault);
}

void bd_geometry_finish(struct bd_geometry *geometry)
{
    if (geometry->embree) rtcReleaseScene(geometry->embree);
    if (geometry->device) rtcReleaseDevice(geometry->device);
    free(geometry->parts);
    free(geometry->positions);
    free(geometry->vertices);
    free(geometry->triangles);
    *geometry = (struct bd_geometry){0};
}

// --- points of triangles ------------------------------------------------------------------------

void bd_geometry_point(const struct bd_part *part, uint32_t triangle, float u, float v,
                       struct bd_meeting *out)
{
    out->part = part;
    set_hit(part, triangle, u, v, &out->hit);
    const struct bd_triangle *shape = &part->triangles[triangle];
    bd_vec3f_copy(out->hit.normal_geometric, shape->normal);
    bd_triangle_point(shape, u, v, out->position, &out->clearance);
}

bool bd_meeting_is_behind(const struct bd_meeting *meeting, const float direction[3])
{
    if (meeting->part->material->double_sided) return false;
    return bd_vec3f_dot(meeting->hit.normal_geometric, direction) > 0;
}

// --- rays ---------------------------------------------------------------------------------------

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

bool bd_geometry_meet(const struct bd_geometry *geometry, const struct bd_ray *ray,
                      enum bd_sight sight, struct bd_meeting *out)
{
    struct context context = {.geometry = geometry, .ray = ray};
    rtcInitIntersectContext(&context.embree);
    if (sight == BD_SIGHT_FRONTS_ONLY) context.embree.filter = filter_backs;
    struct RTCRayHit query = {.ray = embree_ray(ray)};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(geometry->embree, &context.embree, &query);
    ray_count++;
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    bd_geometry_point(&geometry->parts[query.hit.geomID], query.hit.primID, query.hit.u,
                      query.hit.v, out);
    out->distance = query.ray.tfar;
    return true;
}

bool bd_geometry_is_blocked(const struct bd_geometry *geometry, const struct bd_ray *ray)
{
    struct context context = {.geometry = geometry, .ray = ray};
    rtcInitIntersectContext(&context.embree);
    struct RTCRay query = embree_ray(ray);
    rtcOccluded1(geometry->embree, &context.embree, &query);
    ray_count++;
    return query.tfar < 0;
}
