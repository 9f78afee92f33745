#include "rays/structure.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

// --- which triangle that is -------------------------------------------------------------------

uint32_t bd_rays_number(const struct bd_rays *rays, const struct RTCHit *hit)
{
    if (hit->geomID == RTC_INVALID_GEOMETRY_ID) return BD_NO_TRIANGLE;
    const uint32_t top = hit->instID[0];
    if (top == RTC_INVALID_GEOMETRY_ID) return rays->placed[hit->geomID].numbers[hit->primID];
    const struct bd_kept_instance *kept = &rays->kept[top - BD_PLACED_COUNT];
    const struct bd_triangle_run *run = &rays->order.runs[kept->first_run + hit->geomID];
    return (uint32_t)(run->first_triangle + hit->primID +
                      (uint64_t)(kept->place - run->first_instance) * run->triangles_per_instance);
}

const struct bd_primitive *bd_rays_primitive(const struct bd_rays *rays, uint32_t number,
                                             uint32_t *triangle)
{
    uint32_t begin = 0, end = rays->order.run_count;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2;
        *(rays->order.runs[middle].first_triangle <= number ? &begin : &end) = middle;
    }
    const struct bd_triangle_run *run = &rays->order.runs[begin];
    *triangle = (uint32_t)((number - run->first_triangle) % run->triangles_per_instance);
    return &rays->scene->meshes[run->mesh]->primitives[run->primitive];
}

// --- building ---------------------------------------------------------------------------------

static void attach(RTCScene to, uint32_t id, RTCGeometry triangles, bool is_cutout)
{
    if (is_cutout) {
        rtcSetGeometryIntersectFilterFunction(triangles, bd_rays_filter_cutout);
        rtcSetGeometryOccludedFilterFunction(triangles, bd_rays_filter_cutout);
    }
    rtcSetGeometryBuildQuality(triangles, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(to, triangles, id);
    rtcReleaseGeometry(triangles);
}

static RTCScene new_scene(RTCDevice device)
{
    RTCScene scene = rtcNewScene(device);
    // Robust: no ray slips between two triangles that share an edge.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    return scene;
}

static void attach_placed(struct bd_rays *rays, enum bd_placed kind)
{
    const struct bd_placed_triangles *placed = &rays->placed[kind];
    if (placed->triangle_count == 0) return;
    RTCGeometry triangles = rtcNewGeometry(rays->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               placed->positions, 0, 3 * sizeof(float), placed->vertex_count);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               placed->indices, 0, 3 * sizeof(uint32_t), placed->triangle_count);
    attach(rays->top, kind, triangles, kind == BD_PLACED_CUTOUT);
}

// A primitive in its mesh's frame. Embree keeps the copy.
static void attach_in_frame(const struct bd_rays *rays, RTCScene to, uint32_t id,
                            const struct bd_primitive *primitive, const struct bd_mesh_frame *frame)
{
    RTCGeometry triangles = rtcNewGeometry(rays->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *position =
        rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), primitive->vertex_count);
    const double centre[3] = {frame->centre.x, frame->centre.y, frame->centre.z};
    for (size_t i = 0; position && i < 3 * (size_t)primitive->vertex_count; i++)
        position[i] = (float)((primitive->position[i] - centre[i % 3]) * frame->scale);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               primitive->index, 0, 3 * sizeof(uint32_t),
                               primitive->index_count / 3);
    const struct bd_material *material = &rays->scene->materials[primitive->material];
    attach(to, id, triangles, material->alpha_mode != BD_ALPHA_OPAQUE);
}

static RTCScene build_mesh(const struct bd_rays *rays, const struct bd_mesh *mesh,
                           const struct bd_mesh_frame *frame)
{
    RTCScene scene = new_scene(rays->device);
    uint32_t id = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        if (mesh->primitives[p].index_count > 0)
            attach_in_frame(rays, scene, id++, &mesh->primitives[p], frame);
    rtcCommitScene(scene);
    return scene;
}

static void attach_instance(const struct bd_rays *rays, uint32_t id, RTCScene of,
                            const float matrix[12])
{
    RTCGeometry instance = rtcNewGeometry(rays->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, of);
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, matrix);
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(rays->top, instance, id);
    rtcReleaseGeometry(instance);
}

// Instances of one mesh follow one another but for their winding.
static void attach_kept(const struct bd_rays *rays)
{
    const struct bd_mesh *current = NULL;
    struct bd_mesh_frame frame = {0};
    RTCScene scene = NULL;
    for (uint32_t k = 0; k < rays->kept_count; k++) {
        const struct bd_kept_instance *kept = &rays->kept[k];
        const struct bd_mesh *mesh = rays->scene->meshes[rays->order.runs[kept->first_run].mesh];
        if (mesh != current) {
            if (scene) rtcReleaseScene(scene);
            current = mesh;
            frame = bd_mesh_frame_of(mesh);
            scene = build_mesh(rays, mesh, &frame);
        }
        float matrix[12];
        const uint32_t place = rays->order.instances[kept->place];
        if (!bd_mesh_frame_matrix(&frame, &rays->space, &rays->scene->instances[place], matrix))
            BD_ASSERT(!"kept although its matrix costs digits");
        attach_instance(rays, BD_PLACED_COUNT + k, scene, matrix);
    }
    if (scene) rtcReleaseScene(scene);
}

// From any of Embree's threads, before it allocates and after it frees.
static bool count_memory(void *user, ssize_t bytes, bool after)
{
    (void)after;
    __atomic_fetch_add((int64_t *)user, bytes, __ATOMIC_RELAXED);
    return true;
}

struct watch {
    const struct bd_rays_build *build;
    _Atomic bool stops;
};

// From any of Embree's threads, several at once, between blocks of triangles.
static bool go_on(void *user, double share)
{
    struct watch *watch = user;
    (void)share;
    if (!watch->build->should_stop) return true;
    if (!atomic_load(&watch->stops) && watch->build->should_stop(watch->build->user))
        atomic_store(&watch->stops, true);
    return !atomic_load(&watch->stops);
}

static enum bd_err build_all(struct bd_rays *rays, const struct bd_rays_build *build,
                             struct bd_fault *fault)
{
    char config[32];
    snprintf(config, sizeof config, "threads=%u", build->thread_count);
    rays->device = rtcNewDevice(config);
    if (!rays->device)
        return bd_fault_set(fault, BD_ERR_UNSUPPORTED, "rays", "Embree does not start: %d",
                            (int)rtcGetDeviceError(NULL));
    rtcSetDeviceMemoryMonitorFunction(rays->device, count_memory, &rays->embree_bytes);
    rays->top = new_scene(rays->device);
    struct watch watch = {.build = build};
    rtcSetSceneProgressMonitorFunction(rays->top, go_on, &watch);
    for (enum bd_placed k = 0; k < BD_PLACED_COUNT; k++) attach_placed(rays, k);
    attach_kept(rays);
    rtcCommitScene(rays->top);
    rtcSetSceneProgressMonitorFunction(rays->top, NULL, NULL);
    const enum RTCError error = rtcGetDeviceError(rays->device);
    if (atomic_load(&watch.stops))
        return bd_fault_set(fault, BD_ERR_CANCELLED, "rays", "stopped while building");
    if (error == RTC_ERROR_NONE) return BD_ERR_OK;
    return bd_fault_set(fault,
                        error == RTC_ERROR_OUT_OF_MEMORY ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL,
                        "rays", "the acceleration structure of %llu triangles: Embree error %d",
                        (unsigned long long)rays->order.triangle_count, (int)error);
}

enum bd_err bd_rays_create(struct bd_scene *scene, const struct bd_rays_build *build,
                           struct bd_rays **out, struct bd_fault *fault)
{
    struct bd_rays *rays = calloc(1, sizeof *rays);
    BD_ASSERT(rays);
    *out = NULL;
    rays->scene = bd_scene_retain(scene);
    rays->space = bd_render_space_of(scene);
    bd_triangle_order_init(&rays->order, scene);
    enum bd_err err = BD_ERR_OK;
    if (rays->order.triangle_count >= BD_NO_TRIANGLE)
        err = bd_fault_set(fault, BD_ERR_LIMIT, "scene",
                           "%llu triangles, instanced; rays take %u at most",
                           (unsigned long long)rays->order.triangle_count, BD_NO_TRIANGLE - 1);
    if (!err) err = bd_rays_place(rays, build->repeated_max, fault);
    if (!err) err = build_all(rays, build, fault);
    if (err) bd_rays_destroy(&rays);
    *out = rays;
    return err;
}

void bd_rays_destroy(struct bd_rays **rays)
{
    struct bd_rays *r = *rays;
    *rays = NULL;
    if (!r) return;
    if (r->top) rtcReleaseScene(r->top);
    if (r->device) rtcReleaseDevice(r->device);
    for (int k = 0; k < BD_PLACED_COUNT; k++) {
        free(r->placed[k].positions);
        free(r->placed[k].indices);
        free(r->placed[k].numbers);
    }
    free(r->kept);
    bd_triangle_order_finish(&r->order);
    bd_scene_release(&r->scene);
    free(r);
}

uint64_t bd_rays_bytes(const struct bd_rays *rays)
{
    const int64_t embree_bytes = __atomic_load_n(&rays->embree_bytes, __ATOMIC_RELAXED);
    uint64_t bytes = embree_bytes > 0 ? (uint64_t)embree_bytes : 0;
    for (int k = 0; k < BD_PLACED_COUNT; k++)
        bytes += 3 * sizeof(float) * rays->placed[k].vertex_count +
                 4 * sizeof(uint32_t) * rays->placed[k].triangle_count;
    return bytes + rays->order.run_count * sizeof *rays->order.runs +
           rays->order.instance_count * (sizeof *rays->order.instances + sizeof *rays->kept);
}
