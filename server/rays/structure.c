#include "rays/structure.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/huge_pages.h"

// --- which triangle that is -------------------------------------------------------------------

uint32_t bd_rays_number(const struct bd_rays *rays, const struct bd_rays_level *level,
                        const struct RTCHit *hit)
{
    if (hit->geomID == RTC_INVALID_GEOMETRY_ID) return BD_NO_TRIANGLE;
    const uint32_t top = hit->instID[0];
    if (top == RTC_INVALID_GEOMETRY_ID) return level->placed[hit->geomID].numbers[hit->primID];
    const struct bd_instance_place *kept = &level->kept[top - BD_PLACED_COUNT];
    if (kept->first_run == BD_NOWHERE) return BD_NO_TRIANGLE;
    const struct bd_triangle_run *run = &rays->order.runs[kept->first_run + hit->geomID];
    return (uint32_t)(run->first_triangle + hit->primID +
                      (uint64_t)(kept->place - run->first_instance) * run->triangles_per_instance);
}

const struct bd_triangle_run *bd_rays_run(const struct bd_rays *rays, uint32_t number,
                                          uint32_t *triangle)
{
    const struct bd_triangle_run *run =
        &rays->order.runs[bd_triangle_order_run(&rays->order, number)];
    *triangle = (uint32_t)((number - run->first_triangle) % run->triangles_per_instance);
    return run;
}

const struct bd_primitive *bd_rays_primitive(const struct bd_rays *rays, uint32_t number,
                                             uint32_t *triangle)
{
    const struct bd_triangle_run *run = bd_rays_run(rays, number, triangle);
    return &rays->scene->meshes[run->mesh]->primitives[run->primitive];
}

// --- parts ------------------------------------------------------------------------------------

// From any of Embree's threads, before it allocates and after it frees.
static bool count_memory(void *user, ssize_t bytes, bool after)
{
    (void)after;
    __atomic_fetch_add((int64_t *)user, bytes, __ATOMIC_RELAXED);
    return true;
}

static struct bd_ray_device *create_device(uint32_t thread_count, struct bd_err_detail *detail)
{
    char config[32];
    struct bd_ray_device *device = calloc(1, sizeof *device);
    BD_ASSERT(device);
    device->reference_count = 1;
    snprintf(config, sizeof config, "threads=%u", thread_count);
    device->embree = rtcNewDevice(config);
    if (device->embree) {
        rtcSetDeviceMemoryMonitorFunction(device->embree, count_memory, &device->bytes);
        return device;
    }
    free(device);
    (void)bd_err_set(detail, BD_ERR_UNSUPPORTED, "rays", "Embree does not start: %d",
                     (int)rtcGetDeviceError(NULL));
    return NULL;
}

static struct bd_ray_device *retain_device(struct bd_ray_device *device)
{
    __atomic_fetch_add(&device->reference_count, 1, __ATOMIC_RELAXED);
    return device;
}

static void release_device(struct bd_ray_device *device)
{
    if (!device || __atomic_sub_fetch(&device->reference_count, 1, __ATOMIC_ACQ_REL)) return;
    rtcReleaseDevice(device->embree);
    free(device);
}

static struct bd_rays_part *retain_part(struct bd_rays_part *part)
{
    if (part) __atomic_fetch_add(&part->reference_count, 1, __ATOMIC_RELAXED);
    return part;
}

static void release_part(struct bd_rays_part *part)
{
    if (!part || __atomic_sub_fetch(&part->reference_count, 1, __ATOMIC_ACQ_REL)) return;
    if (part->top) rtcReleaseScene(part->top);
    for (uint32_t m = 0; m < part->mesh_count; m++) rtcReleaseScene(part->meshes[m].top);
    release_device(part->device);
    release_part(part->lender);
    for (int k = 0; k < BD_PLACED_COUNT; k++) {
        free(part->placed[k].positions);
        free(part->placed[k].indices);
    }
    free(part->shown);
    free(part->pieces);
    free(part->meshes);
    bd_scene_release(&part->scene);
    free(part);
}

// The wanted instances that show something.
static struct bd_rays_part *create_part(const struct bd_rays *rays, const bool *wanted,
                                        struct bd_rays_part *lender)
{
    struct bd_rays_part *part = calloc(1, sizeof *part);
    BD_ASSERT(part);
    part->reference_count = 1;
    part->scene = bd_scene_retain(rays->scene);
    part->lender = retain_part(lender);
    part->shown = calloc((size_t)rays->scene->instance_count + 1, sizeof *part->shown);
    BD_ASSERT(part->shown);
    for (uint32_t i = 0; i < rays->scene->instance_count; i++)
        if ((!wanted || wanted[i]) && rays->places[i].first_run != BD_NOWHERE)
            part->shown[part->shown_count++].instance = i;
    return part;
}

// --- building ---------------------------------------------------------------------------------

static void attach(RTCScene to, uint32_t id, RTCGeometry triangles, bool is_cutout,
                   enum RTCBuildQuality quality)
{
    if (is_cutout) {
        rtcSetGeometryIntersectFilterFunction(triangles, bd_rays_filter_cutout);
        rtcSetGeometryOccludedFilterFunction(triangles, bd_rays_filter_cutout);
    }
    rtcSetGeometryBuildQuality(triangles, quality);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(to, triangles, id);
    rtcReleaseGeometry(triangles);
}

static RTCScene new_scene(const struct bd_rays_part *part, enum RTCBuildQuality quality)
{
    RTCScene scene = rtcNewScene(part->device->embree);
    // Robust: no ray slips between two triangles that share an edge.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcSetSceneBuildQuality(scene, quality);
    return scene;
}

static void attach_placed(struct bd_rays_part *part, enum bd_placed kind,
                          enum RTCBuildQuality quality)
{
    const struct bd_placed_triangles *placed = &part->placed[kind];
    if (placed->triangle_count == 0) return;
    RTCGeometry triangles = rtcNewGeometry(part->device->embree, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               placed->positions, 0, 3 * sizeof(float), placed->vertex_count);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               placed->indices, 0, 3 * sizeof(uint32_t), placed->triangle_count);
    attach(part->top, kind, triangles, kind == BD_PLACED_CUTOUT, quality);
}

// A primitive in its mesh's frame. Embree keeps the copy.
static void attach_in_frame(const struct bd_rays_part *part, RTCScene to, uint32_t id,
                            const struct bd_primitive *primitive, const struct bd_mesh_frame *frame)
{
    RTCGeometry triangles = rtcNewGeometry(part->device->embree, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *position =
        rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), primitive->vertex_count);
    const double centre[3] = {frame->centre.x, frame->centre.y, frame->centre.z};
    for (size_t i = 0; position && i < 3 * (size_t)primitive->vertex_count; i++)
        position[i] = (float)((primitive->position[i] - centre[i % 3]) * frame->scale);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               primitive->index, 0, 3 * sizeof(uint32_t),
                               primitive->index_count / 3);
    attach(to, id, triangles, bd_placed_kind(part->scene, primitive->material) == BD_PLACED_CUTOUT,
           RTC_BUILD_QUALITY_MEDIUM);
}

static RTCScene build_mesh(const struct bd_rays_part *part, const struct bd_mesh *mesh,
                           const struct bd_mesh_frame *frame)
{
    RTCScene scene = new_scene(part, RTC_BUILD_QUALITY_MEDIUM);
    uint32_t id = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        if (mesh->primitives[p].index_count > 0)
            attach_in_frame(part, scene, id++, &mesh->primitives[p], frame);
    rtcCommitScene(scene);
    return scene;
}

bool bd_rays_same_mesh(const struct bd_scene *a, uint32_t mesh_a, const struct bd_scene *b,
                       uint32_t mesh_b)
{
    const struct bd_mesh *left = a->meshes[mesh_a], *right = b->meshes[mesh_b];
    if (left != right && (left->content_hash != right->content_hash ||
                          memcmp(left->sha256, right->sha256, sizeof left->sha256) != 0))
        return false;
    for (uint32_t p = 0; p < left->primitive_count; p++)
        if (bd_placed_kind(a, left->primitives[p].material) !=
            bd_placed_kind(b, right->primitives[p].material))
            return false;
    return true;
}

// A mesh of the part in its frame: the lender's, where it has it.
static struct bd_kept_mesh kept_mesh(const struct bd_rays_part *part, uint32_t mesh)
{
    for (uint32_t m = 0; part->lender && m < part->lender->mesh_count; m++) {
        struct bd_kept_mesh lent = part->lender->meshes[m];
        if (!bd_rays_same_mesh(part->lender->scene, lent.mesh, part->scene, mesh)) continue;
        lent.mesh = mesh;
        rtcRetainScene(lent.top);
        return lent;
    }
    struct bd_kept_mesh made = {mesh, bd_mesh_frame_of(part->scene->meshes[mesh]), NULL};
    made.top = build_mesh(part, part->scene->meshes[mesh], &made.frame);
    return made;
}

static void attach_instance(const struct bd_rays_part *part, uint32_t id, RTCScene of,
                            const float matrix[12])
{
    RTCGeometry instance = rtcNewGeometry(part->device->embree, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, of);
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, matrix);
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(part->top, instance, id);
    rtcReleaseGeometry(instance);
}

static void attach_kept(const struct bd_rays *rays, struct bd_rays_part *part)
{
    const struct bd_scene *scene = part->scene;
    part->meshes = calloc((size_t)scene->mesh_count + 1, sizeof *part->meshes);
    uint32_t *slots = calloc((size_t)scene->mesh_count + 1, sizeof *slots); // plus one
    BD_ASSERT(part->meshes && slots);
    for (uint32_t s = 0; s < part->shown_count; s++) {
        if (!part->shown[s].is_kept) continue;
        const struct bd_instance *instance = &scene->instances[part->shown[s].instance];
        uint32_t *slot = &slots[instance->mesh];
        if (!*slot) {
            part->meshes[part->mesh_count] = kept_mesh(part, (uint32_t)instance->mesh);
            *slot = ++part->mesh_count;
        }
        const struct bd_kept_mesh *mesh = &part->meshes[*slot - 1];
        float matrix[12];
        if (!bd_mesh_frame_matrix(&mesh->frame, &rays->space, instance, matrix))
            BD_ASSERT(!"kept although its matrix costs digits");
        attach_instance(part, BD_PLACED_COUNT + part->shown[s].first, mesh->top, matrix);
    }
    free(slots);
}

bool bd_rays_go_on(void *user, double share)
{
    struct bd_rays_watch *watch = user;
    (void)share;
    if (!watch->build->should_stop) return true;
    if (!atomic_load(&watch->stops) && watch->build->should_stop(watch->build->user))
        atomic_store(&watch->stops, true);
    return !atomic_load(&watch->stops);
}

enum bd_err bd_rays_built(const struct bd_rays_part *part, const struct bd_rays_watch *watch,
                          struct bd_err_detail *detail)
{
    const enum RTCError error = rtcGetDeviceError(part->device->embree);
    if (atomic_load(&watch->stops))
        return bd_err_set(detail, BD_ERR_CANCELLED, "rays", "stopped while building");
    if (error == RTC_ERROR_NONE) return BD_ERR_OK;
    return bd_err_set(detail, error == RTC_ERROR_OUT_OF_MEMORY ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL,
                      "rays", "the acceleration structure of %llu triangles: Embree error %d",
                      (unsigned long long)part->triangle_count, (int)error);
}

static enum bd_err commit(const struct bd_rays *rays, struct bd_rays_part *part,
                          enum RTCBuildQuality quality, const struct bd_rays_build *build,
                          struct bd_err_detail *detail)
{
    struct bd_rays_watch watch = {.build = build};
    const int64_t before = __atomic_load_n(&part->device->bytes, __ATOMIC_RELAXED);
    part->top = new_scene(part, quality);
    rtcSetSceneProgressMonitorFunction(part->top, bd_rays_go_on, &watch);
    for (enum bd_placed k = 0; k < BD_PLACED_COUNT; k++) attach_placed(part, k, quality);
    attach_kept(rays, part);
    rtcCommitScene(part->top);
    rtcSetSceneProgressMonitorFunction(part->top, NULL, NULL);
    const int64_t after = __atomic_load_n(&part->device->bytes, __ATOMIC_RELAXED);
    if (after > before) part->embree_bytes = (uint64_t)(after - before);
    return bd_rays_built(part, &watch, detail);
}

// --- levels -----------------------------------------------------------------------------------

static bool make_numbers(struct bd_rays_level *level)
{
    level->kept = calloc((size_t)level->part->kept_count + 1, sizeof *level->kept);
    for (int k = 0; k < BD_PLACED_COUNT; k++) {
        struct bd_placed_triangles *placed = &level->placed[k];
        *placed = level->part->placed[k];
        placed->numbers = bd_huge_pages_alloc((placed->triangle_count + 1) * sizeof(uint32_t));
    }
    return level->kept && level->placed[0].numbers && level->placed[1].numbers;
}

// Of one of the part's instances; `at` is where it is now.
static void number_shown(const struct bd_rays *rays, struct bd_rays_level *level,
                         const struct bd_shown *shown, const struct bd_instance_place *at)
{
    const struct bd_scene *scene = level->part->scene;
    const struct bd_mesh *mesh = scene->meshes[scene->instances[shown->instance].mesh];
    const size_t *piece = level->part->pieces + shown->first;
    const struct bd_triangle_run *run =
        at->first_run == BD_NOWHERE ? NULL : &rays->order.runs[at->first_run];
    for (uint32_t p = 0; p < mesh->primitive_count; p++) {
        const struct bd_primitive *primitive = &mesh->primitives[p];
        if (primitive->index_count == 0) continue;
        uint32_t *numbers =
            level->placed[bd_placed_kind(scene, primitive->material)].numbers + *piece++;
        for (uint32_t t = 0; !run && t < primitive->index_count / 3; t++)
            numbers[t] = BD_NO_TRIANGLE;
        if (!run) continue;
        const uint32_t first =
            (uint32_t)(run->first_triangle +
                       (uint64_t)(at->place - run->first_instance) * run->triangles_per_instance);
        for (uint32_t t = 0; t < run->triangles_per_instance; t++) numbers[t] = first + t;
        run++;
    }
}

enum bd_err bd_rays_add_shared(struct bd_rays *rays, struct bd_rays_part *part, const uint32_t *now,
                               struct bd_err_detail *detail)
{
    static const struct bd_instance_place nowhere = {BD_NOWHERE, BD_NOWHERE, false};
    BD_ASSERT_CMP(rays->level_count, <, BD_RAYS_LEVELS_MAX);
    struct bd_rays_level *level = &rays->levels[rays->level_count++];
    level->part = retain_part(part);
    if (!make_numbers(level))
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for %llu numbers",
                          (unsigned long long)part->triangle_count);
    for (uint32_t s = 0; s < part->shown_count; s++) {
        const struct bd_shown *shown = &part->shown[s];
        if (now[s] == BD_NOWHERE) level->has_stale = true;
        const struct bd_instance_place *at =
            now[s] == BD_NOWHERE ? &nowhere : &rays->places[now[s]];
        if (shown->is_kept)
            level->kept[shown->first] = *at;
        else
            number_shown(rays, level, shown, at);
    }
    return BD_ERR_OK;
}

static enum bd_err add_whole(struct bd_rays *rays, struct bd_rays_part *part,
                             struct bd_err_detail *detail)
{
    uint32_t *now = calloc((size_t)part->shown_count + 1, sizeof *now);
    BD_ASSERT(now);
    for (uint32_t s = 0; s < part->shown_count; s++) now[s] = part->shown[s].instance;
    enum bd_err err = bd_rays_add_shared(rays, part, now, detail);
    free(now);
    return err;
}

enum bd_err bd_rays_add_built(struct bd_rays *rays, const struct bd_rays_wish *wish,
                              const struct bd_rays_build *build, struct bd_err_detail *detail)
{
    struct bd_rays_part *part = create_part(rays, wish->wanted, wish->lender);
    enum bd_err err = bd_rays_place(rays, part, detail);
    if (!err && wish->lender) part->device = retain_device(wish->lender->device);
    if (!err && !wish->lender) part->device = create_device(build->thread_count, detail);
    if (!err && !part->device) err = BD_ERR_UNSUPPORTED;
    if (!err && !wish->is_only_placed) err = commit(rays, part, wish->quality, build, detail);
    if (!err) err = add_whole(rays, part, detail);
    if (!err) rays->levels[rays->level_count - 1].is_its_own = true;
    release_part(part);
    return err;
}

// --- structures -------------------------------------------------------------------------------

enum bd_err bd_rays_begin(struct bd_scene *scene, const struct bd_rays_build *build,
                          struct bd_rays **out, struct bd_err_detail *detail)
{
    struct bd_rays *rays = *out = calloc(1, sizeof *rays);
    BD_ASSERT(rays);
    rays->scene = bd_scene_retain(scene);
    rays->space = bd_render_space_of(scene);
    bd_triangle_order_init(&rays->order, scene);
    rays->places = calloc((size_t)scene->instance_count + 1, sizeof *rays->places);
    if (!rays->places)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for %u instances",
                          scene->instance_count);
    bd_rays_decide(rays, build->repeated_max);
    if (rays->order.triangle_count < BD_NO_TRIANGLE) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "scene",
                      "%llu triangles, instanced; rays take %u at most",
                      (unsigned long long)rays->order.triangle_count, BD_NO_TRIANGLE - 1);
}

enum bd_err bd_rays_create(struct bd_scene *scene, const struct bd_rays_build *build,
                           struct bd_rays **out, struct bd_err_detail *detail)
{
    const struct bd_rays_wish all = {.quality = RTC_BUILD_QUALITY_MEDIUM};
    struct bd_rays *rays;
    enum bd_err err = bd_rays_begin(scene, build, &rays, detail);
    if (!err) err = bd_rays_add_built(rays, &all, build, detail);
    if (err) bd_rays_destroy(&rays);
    *out = rays;
    return err;
}

void bd_rays_destroy(struct bd_rays **rays)
{
    struct bd_rays *r = *rays;
    *rays = NULL;
    if (!r) return;
    for (uint32_t l = 0; l < r->level_count; l++) {
        for (int k = 0; k < BD_PLACED_COUNT; k++) free(r->levels[l].placed[k].numbers);
        free(r->levels[l].kept);
        release_part(r->levels[l].part);
    }
    free(r->places);
    bd_triangle_order_finish(&r->order);
    bd_scene_release(&r->scene);
    free(r);
}

static uint64_t part_bytes(const struct bd_rays_part *part)
{
    uint64_t bytes = part->embree_bytes;
    for (int k = 0; k < BD_PLACED_COUNT; k++)
        bytes += 3 * sizeof(float) * part->placed[k].vertex_count +
                 3 * sizeof(uint32_t) * part->placed[k].triangle_count;
    return bytes + part->shown_count * sizeof *part->shown +
           part->piece_count * sizeof *part->pieces;
}

uint64_t bd_rays_bytes(const struct bd_rays *rays)
{
    uint64_t bytes =
        rays->order.run_count * sizeof *rays->order.runs +
        rays->order.instance_count * (sizeof *rays->order.instances + sizeof *rays->places);
    for (uint32_t l = 0; l < rays->level_count; l++) {
        if (rays->levels[l].is_its_own) bytes += part_bytes(rays->levels[l].part);
        for (int k = 0; k < BD_PLACED_COUNT; k++)
            bytes += sizeof(uint32_t) * rays->levels[l].placed[k].triangle_count;
    }
    return bytes;
}
