#include "scene/flat.h"

#include "base/large.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the flat form is little-endian");

// One visitor for both directions: the functions below name each field once, and a field that is
// written is the field that is read. `failed` is sticky, so that a chain of fields is checked once.
struct io {
    bool reading;
    bool failed;
    bool no_memory;
    const char *part; // what is being visited, for the fault
    // writing
    bd_flat_sink sink;
    void *user;
    size_t used;
    uint8_t buffer[65536];
    // reading
    const uint8_t *bytes;
    size_t size, offset;
};

static const char magic[8] = {'B', 'D', 'F', 'L', 'A', 'T', '0', '2'};

// The part that fails first is the part that is named.
static void enter(struct io *io, const char *part)
{
    if (!io->failed) io->part = part;
}

static void fail(struct io *io)
{
    io->failed = true;
}

static size_t left(const struct io *io)
{
    return io->size - io->offset;
}

static void flush(struct io *io)
{
    if (!io->failed && io->used > 0 && !io->sink(io->user, io->buffer, io->used)) fail(io);
    io->used = 0;
}

static void write_bytes(struct io *io, const void *bytes, size_t size)
{
    if (io->used + size > sizeof io->buffer) flush(io);
    if (io->failed || size == 0) return;
    if (size > sizeof io->buffer) {
        if (!io->sink(io->user, bytes, size)) fail(io);
        return;
    }
    memcpy(io->buffer + io->used, bytes, size);
    io->used += size;
}

static void read_bytes(struct io *io, void *bytes, size_t size)
{
    if (io->failed || left(io) < size) {
        memset(bytes, 0, size);
        fail(io);
        return;
    }
    if (size) memcpy(bytes, io->bytes + io->offset, size);
    io->offset += size;
}

static void visit_bytes(struct io *io, void *bytes, size_t size)
{
    if (io->reading)
        read_bytes(io, bytes, size);
    else
        write_bytes(io, bytes, size);
}

static void visit_u32(struct io *io, uint32_t *value)
{
    visit_bytes(io, value, sizeof *value);
}

static void visit_bool(struct io *io, bool *value)
{
    uint8_t byte = !io->reading && *value;
    visit_bytes(io, &byte, 1);
    if (byte > 1) fail(io);
    if (io->reading) *value = byte == 1;
}

// Any enum of ours has the size of an int; `count` is one past its last value.
static uint32_t visit_enum(struct io *io, uint32_t value, uint32_t count)
{
    visit_u32(io, &value);
    if (value < count) return value;
    fail(io);
    return 0;
}

// BD_NONE or below `count`.
static void visit_index(struct io *io, int32_t *index, uint32_t count)
{
    visit_bytes(io, index, sizeof *index);
    if (*index == BD_NONE || (*index >= 0 && (uint32_t)*index < count)) return;
    fail(io);
    *index = BD_NONE;
}

static void visit_f32(struct io *io, float *value, float least, float most)
{
    visit_bytes(io, value, sizeof *value);
    if (!(*value >= least && *value <= most)) fail(io);
}

static void visit_f32s(struct io *io, float *values, int count, float least, float most)
{
    for (int i = 0; i < count; i++) visit_f32(io, &values[i], least, most);
}

static void visit_text(struct io *io, char *text, size_t size)
{
    visit_bytes(io, text, size);
    text[size - 1] = 0;
}

// Counts and allocates `*items`. The smallest form that an item can have bounds what the bytes
// that are left can hold, so a count costs no memory that the input does not pay for.
static bool visit_items(struct io *io, const char *part, uint32_t *count, void **items,
                        size_t item_bytes, size_t flat_bytes_min)
{
    enter(io, part);
    visit_u32(io, count);
    if (!io->reading) return !io->failed;
    if (io->failed || *count > INT32_MAX || *count > left(io) / flat_bytes_min) {
        *count = 0;
        fail(io);
        return false;
    }
    *items = calloc(*count ? *count : 1, item_bytes);
    if (*items) return true;
    *count = 0;
    io->no_memory = true;
    fail(io);
    return false;
}

static void visit_node(struct io *io, struct bd_node *node, const struct bd_scene *scene)
{
    visit_text(io, node->name, sizeof node->name);
    visit_index(io, &node->parent, scene->node_count);
    visit_index(io, &node->mesh, scene->mesh_count);
    visit_index(io, &node->camera, scene->camera_count);
    visit_index(io, &node->light, scene->light_count);
    for (int i = 0; i < 16; i++) {
        visit_bytes(io, &node->parent_from_node.m[i], sizeof(double));
        if (!isfinite(node->parent_from_node.m[i])) fail(io);
    }
    visit_bool(io, &node->in_scene);
    visit_bool(io, &node->mesh_is_world_space);
}

static void visit_texture_ref(struct io *io, struct bd_texture_ref *ref,
                              const struct bd_scene *scene)
{
    visit_index(io, &ref->texture, scene->texture_count);
    visit_u32(io, &ref->uv_set);
    if (ref->uv_set > 1) fail(io);
    visit_f32s(io, ref->uv_transform, 6, -FLT_MAX, FLT_MAX);
}

static void visit_material(struct io *io, struct bd_material *material,
                           const struct bd_scene *scene)
{
    visit_text(io, material->name, sizeof material->name);
    visit_f32s(io, material->base_color, 4, 0, 1);
    visit_f32(io, &material->metallic, 0, 1);
    visit_f32(io, &material->roughness, 0, 1);
    visit_f32s(io, material->emissive, 3, 0, FLT_MAX);
    visit_f32(io, &material->normal_scale, -FLT_MAX, FLT_MAX);
    visit_f32(io, &material->ior, 0, FLT_MAX);
    visit_f32(io, &material->transmission, 0, 1);
    visit_f32(io, &material->thickness_m, 0, FLT_MAX);
    visit_f32(io, &material->attenuation_distance_m, 0, INFINITY);
    visit_f32s(io, material->attenuation_color, 3, 0, 1);
    material->alpha_mode = visit_enum(io, material->alpha_mode, BD_ALPHA_BLEND + 1);
    visit_f32(io, &material->alpha_cutoff, 0, FLT_MAX);
    visit_bool(io, &material->double_sided);
    visit_bool(io, &material->unlit);
    visit_texture_ref(io, &material->base_color_map, scene);
    visit_texture_ref(io, &material->metallic_roughness_map, scene);
    visit_texture_ref(io, &material->normal_map, scene);
    visit_texture_ref(io, &material->emissive_map, scene);
    visit_texture_ref(io, &material->transmission_map, scene);
}

static void visit_texture(struct io *io, struct bd_texture *texture, const struct bd_scene *scene)
{
    visit_index(io, &texture->picture, scene->picture_count);
    texture->wrap_s = visit_enum(io, texture->wrap_s, BD_WRAP_MIRROR + 1);
    texture->wrap_t = visit_enum(io, texture->wrap_t, BD_WRAP_MIRROR + 1);
    visit_bool(io, &texture->nearest);
}

static void visit_light(struct io *io, struct bd_light *light)
{
    const float half_pi = 1.57079637f;
    visit_text(io, light->name, sizeof light->name);
    light->kind = visit_enum(io, light->kind, BD_LIGHT_SPOT + 1);
    visit_f32s(io, light->color, 3, 0, FLT_MAX);
    visit_f32(io, &light->intensity, 0, FLT_MAX);
    visit_f32(io, &light->range_m, 0, INFINITY);
    visit_f32(io, &light->cone_outer, 0, half_pi);
    visit_f32(io, &light->cone_inner, 0, light->cone_outer);
}

static void visit_camera(struct io *io, struct bd_camera *camera)
{
    visit_text(io, camera->name, sizeof camera->name);
    visit_bool(io, &camera->orthographic);
    visit_f32(io, &camera->yfov, 0, 3.14159f);
    visit_f32(io, &camera->xmag, 0, FLT_MAX);
    visit_f32(io, &camera->ymag, 0, FLT_MAX);
    visit_f32(io, &camera->near_m, 0, FLT_MAX);
    visit_f32(io, &camera->far_m, 0, INFINITY);
}

// A stream of finite floats, or nothing. `most` bounds their size: a vertex further out than the
// square root of FLT_MAX has no squared distance.
static void visit_stream(struct io *io, float **stream, uint32_t vertex_count, uint32_t width,
                         bool required)
{
    const float most = 1e18f;
    size_t count = (size_t)vertex_count * width;
    bool present = *stream != NULL;
    visit_bool(io, &present);
    if (required && !present) fail(io);
    if (io->failed || !present) return;
    if (!io->reading) {
        write_bytes(io, *stream, count * sizeof **stream);
        return;
    }
    if (left(io) / sizeof **stream < count) {
        fail(io);
        return;
    }
    *stream = malloc(count ? count * sizeof **stream : 1);
    if (!*stream) {
        io->no_memory = true;
        fail(io);
        return;
    }
    read_bytes(io, *stream, count * sizeof **stream);
    for (size_t i = 0; i < count; i++)
        if (!(fabsf((*stream)[i]) <= most)) fail(io);
}

static void visit_indices(struct io *io, struct bd_primitive *primitive)
{
    visit_u32(io, &primitive->index_count);
    size_t count = primitive->index_count;
    if (!io->reading) {
        write_bytes(io, primitive->index, count * sizeof *primitive->index);
        return;
    }
    if (io->failed || count % 3 != 0 || left(io) / sizeof *primitive->index < count) {
        fail(io);
        return;
    }
    primitive->index = malloc(count ? count * sizeof *primitive->index : 1);
    if (!primitive->index) {
        io->no_memory = true;
        fail(io);
        return;
    }
    read_bytes(io, primitive->index, count * sizeof *primitive->index);
    for (size_t i = 0; i < count; i++)
        if (primitive->index[i] >= primitive->vertex_count) fail(io);
}

static void visit_primitive(struct io *io, struct bd_primitive *primitive,
                            const struct bd_scene *scene)
{
    visit_u32(io, &primitive->vertex_count);
    visit_index(io, &primitive->material, scene->material_count);
    if (primitive->material == BD_NONE) fail(io);
    visit_stream(io, &primitive->position, primitive->vertex_count, 3, true);
    visit_stream(io, &primitive->normal, primitive->vertex_count, 3, true);
    visit_stream(io, &primitive->tangent, primitive->vertex_count, 4, false);
    visit_stream(io, &primitive->uv[0], primitive->vertex_count, 2, false);
    visit_stream(io, &primitive->uv[1], primitive->vertex_count, 2, false);
    visit_stream(io, &primitive->color, primitive->vertex_count, 4, false);
    visit_indices(io, primitive);
}

static void visit_mesh(struct io *io, struct bd_mesh **slot, const struct bd_scene *scene)
{
    if (io->reading) *slot = calloc(1, sizeof **slot);
    if (!*slot) {
        io->no_memory = true;
        fail(io);
        return;
    }
    struct bd_mesh *mesh = *slot;
    mesh->reference_count = io->reading ? 1 : mesh->reference_count;
    visit_text(io, mesh->name, sizeof mesh->name);
    if (!visit_items(io, "meshes", &mesh->primitive_count, (void **)&mesh->primitives,
                     sizeof *mesh->primitives, 18))
        return;
    for (uint32_t i = 0; i < mesh->primitive_count && !io->failed; i++)
        visit_primitive(io, &mesh->primitives[i], scene);
    if (io->reading && !io->failed) bd_mesh_seal(mesh);
}

static void visit_picture(struct io *io, struct bd_picture **slot)
{
    if (io->reading) *slot = calloc(1, sizeof **slot);
    if (!*slot) {
        io->no_memory = true;
        fail(io);
        return;
    }
    struct bd_picture *picture = *slot;
    picture->reference_count = io->reading ? 1 : picture->reference_count;
    visit_u32(io, &picture->width_px);
    visit_u32(io, &picture->height_px);
    uint64_t texels = (uint64_t)picture->width_px * picture->height_px;
    if (!io->reading) {
        write_bytes(io, picture->rgba, texels * 4);
        return;
    }
    if (io->failed || texels == 0 || texels > left(io) / 4) {
        fail(io);
        return;
    }
    picture->rgba = bd_large_alloc(texels * 4);
    if (!picture->rgba) {
        io->no_memory = true;
        fail(io);
        return;
    }
    read_bytes(io, picture->rgba, texels * 4);
    bd_picture_seal(picture);
}

static void visit_sky_map(struct io *io, struct bd_sky_map **slot)
{
    if (io->reading) *slot = calloc(1, sizeof **slot);
    if (!*slot) {
        io->no_memory = true;
        fail(io);
        return;
    }
    struct bd_sky_map *map = *slot;
    map->reference_count = io->reading ? 1 : map->reference_count;
    visit_u32(io, &map->width_px);
    visit_u32(io, &map->height_px);
    uint64_t texels = (uint64_t)map->width_px * map->height_px;
    size_t texel_bytes = 3 * sizeof *map->rgb;
    if (!io->reading) {
        write_bytes(io, map->rgb, texels * texel_bytes);
        return;
    }
    if (io->failed || texels == 0 || texels > left(io) / texel_bytes) {
        fail(io);
        return;
    }
    map->rgb = malloc(texels * texel_bytes);
    if (!map->rgb) {
        io->no_memory = true;
        fail(io);
        return;
    }
    read_bytes(io, map->rgb, texels * texel_bytes);
    for (uint64_t i = 0; i < 3 * texels; i++)
        if (!(map->rgb[i] >= 0 && map->rgb[i] <= FLT_MAX)) fail(io);
    if (!io->failed) bd_sky_map_seal(map);
}

static void visit_environment(struct io *io, struct bd_environment *environment)
{
    bool has_map = environment->map != NULL;
    enter(io, "environment");
    visit_f32s(io, environment->radiance, 3, 0, FLT_MAX);
    visit_bool(io, &has_map);
    if (has_map && !io->failed) visit_sky_map(io, &environment->map);
}

static void visit_flags(struct io *io, struct bd_scene_flags *flags)
{
    enter(io, "flags");
    visit_u32(io, &flags->count);
    if (flags->count > BD_SCENE_FLAG_MAX) {
        flags->count = 0;
        fail(io);
    }
    for (uint32_t i = 0; i < flags->count; i++)
        visit_text(io, flags->text[i], sizeof flags->text[i]);
}

// Bigger things refer to smaller ones by index, so those come first: when an index is read, the
// count that bounds it is known. Nodes come last.
static void visit_scene(struct io *io, struct bd_scene *scene)
{
    char head[sizeof magic];
    memcpy(head, magic, sizeof head);
    enter(io, "header");
    visit_bytes(io, head, sizeof head);
    if (memcmp(head, magic, sizeof head) != 0) fail(io);

    if (visit_items(io, "pictures", &scene->picture_count, (void **)&scene->pictures,
                    sizeof *scene->pictures, 12))
        for (uint32_t i = 0; i < scene->picture_count && !io->failed; i++)
            visit_picture(io, &scene->pictures[i]);
    if (visit_items(io, "textures", &scene->texture_count, (void **)&scene->textures,
                    sizeof *scene->textures, 13))
        for (uint32_t i = 0; i < scene->texture_count && !io->failed; i++)
            visit_texture(io, &scene->textures[i], scene);
    if (visit_items(io, "materials", &scene->material_count, (void **)&scene->materials,
                    sizeof *scene->materials, 300))
        for (uint32_t i = 0; i < scene->material_count && !io->failed; i++)
            visit_material(io, &scene->materials[i], scene);
    if (visit_items(io, "lights", &scene->light_count, (void **)&scene->lights,
                    sizeof *scene->lights, 96))
        for (uint32_t i = 0; i < scene->light_count && !io->failed; i++)
            visit_light(io, &scene->lights[i]);
    if (visit_items(io, "cameras", &scene->camera_count, (void **)&scene->cameras,
                    sizeof *scene->cameras, 85))
        for (uint32_t i = 0; i < scene->camera_count && !io->failed; i++)
            visit_camera(io, &scene->cameras[i]);
    if (visit_items(io, "meshes", &scene->mesh_count, (void **)&scene->meshes,
                    sizeof *scene->meshes, 68))
        for (uint32_t i = 0; i < scene->mesh_count && !io->failed; i++)
            visit_mesh(io, &scene->meshes[i], scene);
    if (visit_items(io, "nodes", &scene->node_count, (void **)&scene->nodes, sizeof *scene->nodes,
                    210))
        for (uint32_t i = 0; i < scene->node_count && !io->failed; i++)
            visit_node(io, &scene->nodes[i], scene);
    visit_environment(io, &scene->environment);
    visit_flags(io, &scene->flags);
}

bool bd_flat_write(const struct bd_scene *scene, bd_flat_sink sink, void *user)
{
    struct io *io = calloc(1, sizeof *io);
    if (!io) return false;
    io->sink = sink;
    io->user = user;
    // The visitor is shared with reading and so not const; when writing it changes nothing.
    visit_scene(io, (struct bd_scene *)scene);
    flush(io);
    bool ok = !io->failed;
    free(io);
    return ok;
}

enum bd_err bd_flat_read(const void *bytes, size_t size, struct bd_scene **out,
                         struct bd_fault *fault)
{
    *out = NULL;
    struct io *io = calloc(1, sizeof *io);
    if (!io) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "scene", "no memory");
    io->reading = true;
    io->bytes = bytes;
    io->size = size;
    struct bd_scene *scene = bd_scene_create();
    visit_scene(io, scene);
    if (!io->failed && left(io) > 0) fail(io);

    enum bd_err err = BD_ERR_OK;
    if (io->no_memory)
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, io->part, "no memory for the scene");
    else if (io->failed)
        err = bd_fault_set(fault, BD_ERR_BAD_INPUT, io->part,
                           "flat scene is damaged near byte %zu of %zu", io->offset, size);
    else if (!bd_scene_parents_are_a_forest(scene, NULL))
        err = bd_fault_set(fault, BD_ERR_BAD_INPUT, "nodes", "flat scene has a node loop");
    free(io);
    if (err == BD_ERR_OK)
        *out = scene;
    else
        bd_scene_release(&scene);
    return err;
}
