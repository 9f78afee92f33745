#include "upload/gpu_scene.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "upload/gpu_mesh.h"

// --- draws ---------------------------------------------------------------------------------

static void build_draws(struct bd_gpu_scene *to)
{
    const struct bd_scene *scene = to->scene;
    bd_triangle_order_init(&to->order, scene);
    to->draws = calloc(to->order.run_count + 1, sizeof *to->draws);
    BD_ASSERT(to->draws);
    for (uint32_t d = 0; d < to->order.run_count; d++) {
        const struct bd_triangle_run *run = &to->order.runs[d];
        to->draws[d] = (struct bd_scene_draw){
            .run = run,
            .mesh = to->meshes[run->mesh],
            .primitive = &to->meshes[run->mesh]->primitives[run->primitive],
            .material =
                &scene->materials[scene->meshes[run->mesh]->primitives[run->primitive].material],
        };
    }
}

// --- triangles -----------------------------------------------------------------------------

#define TRIANGLE_FLOATS   12
#define STAGING_TRIANGLES 8192u

// Triangles on their way to the device, piece by piece.
struct staging {
    struct bd_uploader *uploader;
    struct bd_buf *to;
    uint64_t sent; // triangles
    uint32_t count;
    float *triangles;
};

static enum bd_err send_staging(struct staging *staging)
{
    const size_t triangle_bytes = TRIANGLE_FLOATS * sizeof(float);
    if (staging->count == 0) return BD_ERR_OK;
    bd_buf_upload(staging->uploader->gpu, staging->to, staging->sent * triangle_bytes,
                  staging->triangles, staging->count * triangle_bytes);
    staging->sent += staging->count;
    staging->count = 0;
    return bd_uploader_pause(staging->uploader);
}

static void store_vec3(float to[4], bd_dvec3 v)
{
    to[0] = (float)v.x, to[1] = (float)v.y, to[2] = (float)v.z, to[3] = 0;
}

// Edges are subtracted in double precision, so that a small triangle keeps its normal however
// far from the scene's origin it lies.
static enum bd_err stage_triangle(struct staging *staging, const bd_dvec3 corner[3])
{
    float *to = staging->triangles + (size_t)staging->count * TRIANGLE_FLOATS;
    store_vec3(to, corner[0]);
    store_vec3(to + 4, bd_dvec3_sub(corner[1], corner[0]));
    store_vec3(to + 8, bd_dvec3_sub(corner[2], corner[0]));
    return ++staging->count == STAGING_TRIANGLES ? send_staging(staging) : BD_ERR_OK;
}

static enum bd_err stage_instance(const struct bd_gpu_scene *scene,
                                  const struct bd_primitive *primitive, uint32_t instance,
                                  struct staging *staging)
{
    const bd_dmat4 *world_from_mesh = &scene->scene->instances[instance].world_from_mesh;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t t = 0; !err && t < primitive->index_count; t += 3) {
        bd_dvec3 corner[3];
        for (int k = 0; k < 3; k++) {
            const float *p = primitive->position + 3 * (size_t)primitive->index[t + k];
            bd_dvec3 world = bd_dmat4_point(world_from_mesh, (bd_dvec3){p[0], p[1], p[2]});
            corner[k] = bd_render_from_world(&scene->space, world);
        }
        err = stage_triangle(staging, corner);
    }
    return err;
}

static enum bd_err stage_run(const struct bd_gpu_scene *scene, const struct bd_triangle_run *run,
                             struct staging *staging)
{
    const struct bd_primitive *primitive =
        &scene->scene->meshes[run->mesh]->primitives[run->primitive];
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < run->instance_count; i++)
        err = stage_instance(scene, primitive, scene->order.instances[run->first_instance + i],
                             staging);
    return err;
}

static enum bd_err upload_triangles(struct bd_uploader *uploader, const struct bd_gpu_scene *scene)
{
    struct staging staging = {.uploader = uploader, .to = scene->triangles};
    staging.triangles = malloc(STAGING_TRIANGLES * TRIANGLE_FLOATS * sizeof(float));
    BD_ASSERT(staging.triangles);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; !err && r < scene->order.run_count; r++)
        err = stage_run(scene, &scene->order.runs[r], &staging);
    if (!err) err = send_staging(&staging);
    free(staging.triangles);
    return err;
}

// Beyond what a shader can index, reads are undefined: holes in shadows, wrong normals.
static enum bd_err build_triangles(struct bd_uploader *uploader, struct bd_gpu_scene *scene,
                                   struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = uploader->gpu;
    const size_t triangle_bytes = TRIANGLE_FLOATS * sizeof(float);
    uint64_t count = scene->order.triangle_count,
             most = bd_gpu_caps(gpu)->array_max_bytes / triangle_bytes;
    if (count > most)
        return bd_err_set(detail, BD_ERR_LIMIT, "scene",
                          "%llu triangles, instanced; this device can address %llu",
                          (unsigned long long)count, (unsigned long long)most);
    if (count == 0)
        return bd_buf_create(gpu, "triangles", triangle_bytes, NULL, &scene->triangles, detail);
    enum bd_err err =
        bd_buf_create_unset(gpu, "triangles", count * triangle_bytes, &scene->triangles, detail);
    return err ? err : upload_triangles(uploader, scene);
}

// A list that scenes share: where they differ in nothing that it is made from.
struct bd_gpu_triangles {
    uint64_t geometry, transforms; // counters of these aspects
    uint32_t reference_count;
    struct bd_buf *buf;
    struct bd_gpu_triangles *next;
};

static bool share_triangles(struct bd_uploader *uploader, struct bd_gpu_scene *scene)
{
    const uint64_t *counter = scene->scene->aspects.counter;
    struct bd_gpu_triangles *t = uploader->triangles;
    while (t && (t->geometry != counter[BD_ASPECT_GEOMETRY] ||
                 t->transforms != counter[BD_ASPECT_TRANSFORMS]))
        t = t->next;
    if (!t) return false;
    t->reference_count++;
    scene->shared_triangles = t;
    scene->triangles = t->buf;
    return true;
}

// Of triangles that are there as a whole. Where two frames built the same ones, both are listed.
static void offer_triangles(struct bd_uploader *uploader, struct bd_gpu_scene *scene)
{
    struct bd_gpu_triangles *t = calloc(1, sizeof *t);
    BD_ASSERT(t);
    *t = (struct bd_gpu_triangles){
        .geometry = scene->scene->aspects.counter[BD_ASPECT_GEOMETRY],
        .transforms = scene->scene->aspects.counter[BD_ASPECT_TRANSFORMS],
        .reference_count = 1,
        .buf = scene->triangles,
        .next = uploader->triangles,
    };
    uploader->triangles = scene->shared_triangles = t;
}

static enum bd_err acquire_triangles(struct bd_uploader *uploader, struct bd_gpu_scene *scene,
                                     struct bd_err_detail *detail)
{
    if (share_triangles(uploader, scene)) return BD_ERR_OK;
    enum bd_err err = build_triangles(uploader, scene, detail);
    if (!err) offer_triangles(uploader, scene);
    return err;
}

static void drop_triangles(struct bd_uploader *uploader, struct bd_gpu_scene *scene)
{
    struct bd_gpu_triangles *gone = scene->shared_triangles, **at = &uploader->triangles;
    if (gone && --gone->reference_count > 0) return;
    bd_buf_destroy(uploader->gpu, &scene->triangles);
    if (!gone) return;
    while (*at != gone) at = &(*at)->next;
    *at = gone->next;
    free(gone);
}

// --- textures ------------------------------------------------------------------------------

static enum bd_err acquire_map(struct bd_uploader *uploader, struct bd_gpu_scene *scene,
                               const struct bd_texture_ref *ref, bool srgb,
                               struct bd_err_detail *detail)
{
    if (ref->texture == BD_NONE) return BD_ERR_OK;
    int32_t picture = scene->scene->textures[ref->texture].picture;
    if (picture == BD_NONE || scene->pictures[picture][srgb]) return BD_ERR_OK;
    return bd_gpu_picture_acquire(uploader, scene->scene->pictures[picture], srgb,
                                  &scene->pictures[picture][srgb], detail);
}

// Only the maps that some pass reads, of the materials that something wears.
static enum bd_err acquire_maps(struct bd_uploader *uploader, struct bd_gpu_scene *scene,
                                struct bd_err_detail *detail)
{
    for (uint32_t d = 0; d < scene->order.run_count; d++) {
        const struct bd_material *m = scene->draws[d].material;
        enum bd_err err = acquire_map(uploader, scene, &m->base_color_map, true, detail);
        if (!err) err = acquire_map(uploader, scene, &m->metallic_roughness_map, false, detail);
        if (!err) err = acquire_map(uploader, scene, &m->normal_map, false, detail);
        if (!err) err = acquire_map(uploader, scene, &m->emissive_map, true, detail);
        if (!err && m->transmission > 0)
            err = acquire_map(uploader, scene, &m->transmission_map, false, detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

const struct bd_tex *bd_gpu_scene_texture(const struct bd_gpu_scene *scene,
                                          const struct bd_texture_ref *ref, bool srgb)
{
    if (ref->texture == BD_NONE) return NULL;
    int32_t picture = scene->scene->textures[ref->texture].picture;
    if (picture == BD_NONE || !scene->pictures[picture][srgb]) return NULL;
    return scene->pictures[picture][srgb]->tex;
}

// --- pieces --------------------------------------------------------------------------------

static void begin_piece(struct bd_uploader *uploader)
{
    uploader->piece_start_ns = bd_clock_ns();
}

static void end_piece(struct bd_uploader *uploader)
{
    uploader->upload_ms += bd_ms_since(uploader->piece_start_ns);
}

enum bd_err bd_uploader_pause(struct bd_uploader *uploader)
{
    if (!uploader->pause) return BD_ERR_OK;
    end_piece(uploader);
    enum bd_err err = uploader->pause(uploader->user);
    begin_piece(uploader);
    return err;
}

// --- the whole -----------------------------------------------------------------------------

static enum bd_err acquire_meshes(struct bd_uploader *uploader, struct bd_gpu_scene *scene,
                                  struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < scene->scene->instance_count; i++) {
        int32_t mesh = scene->scene->instances[i].mesh;
        if (scene->meshes[mesh]) continue;
        enum bd_err err =
            bd_gpu_mesh_acquire(uploader, scene->scene->meshes[mesh], &scene->meshes[mesh], detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

enum bd_err bd_gpu_scene_create(struct bd_uploader *uploader, struct bd_scene *scene,
                                struct bd_gpu_scene **out, struct bd_err_detail *detail)
{
    begin_piece(uploader);
    struct bd_gpu_scene *made = calloc(1, sizeof *made);
    BD_ASSERT(made);
    made->scene = bd_scene_retain(scene);
    made->space = bd_render_space_of(scene);
    made->mesh_count = scene->mesh_count;
    made->picture_count = scene->picture_count;
    made->meshes = calloc(scene->mesh_count + 1, sizeof *made->meshes);
    made->pictures = calloc(scene->picture_count + 1, sizeof *made->pictures);
    BD_ASSERT(made->meshes && made->pictures);

    enum bd_err err = acquire_meshes(uploader, made, detail);
    if (!err) {
        build_draws(made);
        err = acquire_maps(uploader, made, detail);
    }
    if (!err) err = acquire_triangles(uploader, made, detail);
    end_piece(uploader);
    if (err) {
        bd_gpu_scene_destroy(uploader, &made);
        return err;
    }
    *out = made;
    return BD_ERR_OK;
}

void bd_gpu_scene_destroy(struct bd_uploader *uploader, struct bd_gpu_scene **scene)
{
    struct bd_gpu_scene *s = *scene;
    *scene = NULL;
    if (!s) return;
    for (uint32_t m = 0; m < s->mesh_count; m++) bd_gpu_mesh_drop(uploader, &s->meshes[m]);
    for (uint32_t p = 0; p < s->picture_count; p++)
        for (int srgb = 0; srgb < 2; srgb++) bd_gpu_picture_drop(uploader, &s->pictures[p][srgb]);
    drop_triangles(uploader, s);
    free(s->draws);
    bd_triangle_order_finish(&s->order);
    free(s->meshes);
    free(s->pictures);
    bd_scene_release(&s->scene);
    free(s);
}

static uint64_t snapshot_bytes(const struct bd_scene *scene)
{
    return (uint64_t)scene->node_count * sizeof *scene->nodes +
           (uint64_t)scene->material_count * sizeof *scene->materials +
           (uint64_t)scene->texture_count * sizeof *scene->textures +
           (uint64_t)scene->light_count * sizeof *scene->lights +
           (uint64_t)scene->camera_count * sizeof *scene->cameras +
           (uint64_t)scene->instance_count * sizeof *scene->instances +
           (uint64_t)scene->mesh_count * sizeof *scene->meshes +
           (uint64_t)scene->picture_count * sizeof *scene->pictures;
}

uint64_t bd_gpu_scene_own_bytes(const struct bd_gpu_scene *scene)
{
    const bool has_alone = scene->shared_triangles->reference_count == 1;
    return (has_alone ? bd_buf_size_bytes(scene->triangles) : 0) +
           scene->order.run_count * (sizeof *scene->draws + sizeof *scene->order.runs) +
           scene->order.instance_count * sizeof *scene->order.instances +
           scene->mesh_count * sizeof *scene->meshes +
           scene->picture_count * sizeof *scene->pictures + snapshot_bytes(scene->scene);
}
