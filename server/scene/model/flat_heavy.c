// Meshes, pictures and sky maps, each in three forms that share their visitors: whole, inside a
// scene's whole flat form; named by SHA-256, inside an index or a delta; and alone, as content,
// whose bytes are what is hashed.

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/huge_pages.h"
#include "scene/model/flat_io.h"

static const char mesh_magic[8] = {'B', 'D', 'M', 'E', 'S', 'H', '0', '1'};
static const char picture_magic[8] = {'B', 'D', 'P', 'I', 'C', 'T', '0', '1'};
static const char sky_map_magic[8] = {'B', 'D', 'S', 'K', 'Y', 'M', '0', '1'};

// --- streams --------------------------------------------------------------------------------

static void visit_indices(struct bd_flat_io *io, struct bd_primitive *primitive)
{
    bd_flat_u32(io, &primitive->index_count);
    size_t count = primitive->index_count;
    if (!io->reading) {
        bd_flat_bytes(io, primitive->index, count * sizeof *primitive->index);
        return;
    }
    if (io->failed || count % 3 != 0 || bd_flat_left(io) / sizeof *primitive->index < count) {
        bd_flat_fail(io);
        return;
    }
    primitive->index = malloc(count ? count * sizeof *primitive->index : 1);
    if (!primitive->index) {
        bd_flat_fail_memory(io);
        return;
    }
    bd_flat_bytes(io, primitive->index, count * sizeof *primitive->index);
    for (size_t i = 0; !io->failed && i < count; i++)
        if (primitive->index[i] >= primitive->vertex_count) bd_flat_fail(io);
}

static void visit_streams(struct bd_flat_io *io, struct bd_primitive *primitive)
{
    bd_flat_u32(io, &primitive->vertex_count);
    bd_flat_stream(io, &primitive->position, primitive->vertex_count, 3, true);
    bd_flat_stream(io, &primitive->normal, primitive->vertex_count, 3, true);
    bd_flat_stream(io, &primitive->tangent, primitive->vertex_count, 4, false);
    bd_flat_stream(io, &primitive->uv[0], primitive->vertex_count, 2, false);
    bd_flat_stream(io, &primitive->uv[1], primitive->vertex_count, 2, false);
    bd_flat_stream(io, &primitive->color, primitive->vertex_count, 4, false);
    visit_indices(io, primitive);
}

// Big enough for large pages where it pays, and checked against what is left before it is taken.
static bool allocate_texels(struct bd_flat_io *io, uint64_t texels, size_t texel_bytes, void **out)
{
    if (io->failed || texels == 0 || texels > bd_flat_left(io) / texel_bytes) {
        bd_flat_fail(io);
        return false;
    }
    *out = bd_huge_pages_alloc(texels * texel_bytes);
    if (!*out) bd_flat_fail_memory(io);
    return *out != NULL;
}

static void visit_picture_texels(struct bd_flat_io *io, struct bd_picture *picture)
{
    bd_flat_u32(io, &picture->width_px);
    bd_flat_u32(io, &picture->height_px);
    uint64_t texels = (uint64_t)picture->width_px * picture->height_px;
    if (io->reading && !allocate_texels(io, texels, 4, (void **)&picture->rgba)) return;
    const bool is_fetched = !io->reading && io->texels && !io->failed;
    uint8_t *rgba = is_fetched ? io->texels(io->texels_user) : picture->rgba;
    if (is_fetched && !rgba) bd_flat_fail(io);
    if (!io->failed) bd_flat_bytes(io, rgba, texels * 4);
    if (is_fetched) free(rgba);
}

static void visit_sky_map_texels(struct bd_flat_io *io, struct bd_sky_map *map)
{
    const size_t texel_bytes = 3 * sizeof *map->rgb;
    bd_flat_u32(io, &map->width_px);
    bd_flat_u32(io, &map->height_px);
    uint64_t texels = (uint64_t)map->width_px * map->height_px;
    if (io->reading && !allocate_texels(io, texels, texel_bytes, (void **)&map->rgb)) return;
    bd_flat_bytes(io, map->rgb, texels * texel_bytes);
    for (uint64_t i = 0; io->reading && !io->failed && i < 3 * texels; i++)
        if (!(map->rgb[i] >= 0 && map->rgb[i] <= FLT_MAX)) bd_flat_fail(io);
}

// --- new objects ----------------------------------------------------------------------------

// All begin with their reference count.
static void *new_object(struct bd_flat_io *io, size_t bytes)
{
    uint32_t *made = calloc(1, bytes);
    if (made)
        *made = 1;
    else
        bd_flat_fail_memory(io);
    return made;
}

static struct bd_content find_content(struct bd_flat_io *io, enum bd_content_kind kind)
{
    struct bd_content found = {.kind = kind};
    uint8_t sha256[32];
    bd_flat_bytes(io, sha256, sizeof sha256);
    if (io->failed || io->find(io->find_user, sha256, &found)) return found;
    memcpy(io->missing_sha256, sha256, sizeof sha256);
    io->missing = io->missing_sha256;
    bd_flat_fail(io);
    return (struct bd_content){.kind = kind};
}

// --- as parts of a scene or a delta ---------------------------------------------------------

static bool room_for_primitive(struct bd_flat_io *io, struct bd_mesh *mesh, uint32_t index)
{
    return bd_flat_room(io, (void **)&mesh->primitives, sizeof *mesh->primitives, index,
                        mesh->primitive_count);
}

// The primitives with their materials; the streams too unless they are named apart.
static void visit_primitives(struct bd_flat_io *io, struct bd_mesh *mesh,
                             const struct bd_scene_counts *counts)
{
    if (!bd_flat_items(io, "meshes", &mesh->primitive_count, (void **)&mesh->primitives,
                       sizeof *mesh->primitives, io->is_index ? 4 : 18))
        return;
    uint32_t i = 0;
    for (; i < mesh->primitive_count && !io->failed; i++) {
        if (!room_for_primitive(io, mesh, i)) break;
        struct bd_primitive *primitive = &mesh->primitives[i];
        bd_flat_index(io, &primitive->material, counts->materials);
        if (primitive->material == BD_NONE) bd_flat_fail(io);
        if (!io->is_index) visit_streams(io, primitive);
    }
    if (io->reading) mesh->primitive_count = i; // the rest never came
}

// What was found under a mesh's SHA-256 may go by another name and show other materials.
static struct bd_mesh *dressed(struct bd_flat_io *io, struct bd_mesh *found,
                               const struct bd_mesh *dress)
{
    if (found->primitive_count != dress->primitive_count) {
        bd_flat_fail(io);
        return NULL;
    }
    struct bd_mesh *alias = bd_mesh_alias(found);
    if (!alias) {
        bd_flat_fail_memory(io);
        return NULL;
    }
    memcpy(alias->name, dress->name, sizeof alias->name);
    for (uint32_t i = 0; i < alias->primitive_count; i++)
        alias->primitives[i].material = dress->primitives[i].material;
    return alias;
}

static void read_named_streams(struct bd_flat_io *io, struct bd_mesh **slot)
{
    struct bd_content found = find_content(io, BD_CONTENT_MESH);
    if (!found.mesh) return;
    struct bd_mesh *alias = dressed(io, found.mesh, *slot);
    bd_content_release(&found);
    if (!alias) return;
    bd_mesh_release(slot);
    *slot = alias;
}

// Where there are no primitives, there is nothing to be named.
void bd_flat_mesh(struct bd_flat_io *io, struct bd_mesh **slot,
                  const struct bd_scene_counts *counts)
{
    if (io->reading) *slot = new_object(io, sizeof **slot);
    if (!*slot) return;
    struct bd_mesh *mesh = *slot;
    bd_flat_text(io, mesh->name, sizeof mesh->name);
    bd_flat_bool(io, &mesh->is_removed);
    visit_primitives(io, mesh, counts);
    if (mesh->is_removed && mesh->primitive_count > 0) bd_flat_fail(io);
    if (io->failed) return;
    bool is_named = io->is_index && mesh->primitive_count > 0;
    if (is_named && io->reading)
        read_named_streams(io, slot);
    else if (is_named)
        bd_flat_bytes(io, mesh->sha256, sizeof mesh->sha256);
    else if (io->reading)
        bd_mesh_seal(mesh);
}

static void visit_named_picture(struct bd_flat_io *io, struct bd_picture **slot)
{
    if (!io->reading) {
        bd_flat_bytes(io, (*slot)->sha256, sizeof(*slot)->sha256);
        return;
    }
    *slot = find_content(io, BD_CONTENT_PICTURE).picture;
}

void bd_flat_picture(struct bd_flat_io *io, struct bd_picture **slot)
{
    bool is_removed = !io->reading && (*slot)->is_removed;
    bd_flat_bool(io, &is_removed);
    if (io->failed) return;
    if (io->is_index && !is_removed) {
        visit_named_picture(io, slot);
        return;
    }
    if (io->reading) *slot = new_object(io, sizeof **slot);
    if (!*slot) return;
    if (io->reading) (*slot)->is_removed = is_removed;
    if (!is_removed) visit_picture_texels(io, *slot);
    if (io->reading && !io->failed) bd_picture_seal(*slot);
}

static void visit_sky_map(struct bd_flat_io *io, struct bd_sky_map **slot)
{
    if (io->is_index && io->reading) {
        *slot = find_content(io, BD_CONTENT_SKY_MAP).sky_map;
        return;
    }
    if (io->is_index) {
        bd_flat_bytes(io, (*slot)->sha256, sizeof(*slot)->sha256);
        return;
    }
    if (io->reading) *slot = new_object(io, sizeof **slot);
    if (!*slot) return;
    visit_sky_map_texels(io, *slot);
    if (io->reading && !io->failed) bd_sky_map_seal(*slot);
}

// A byte says what follows: 1 = a map, 2 = a rotation. Of environments that are not turned it is
// what it was before they could be.
void bd_flat_environment(struct bd_flat_io *io, struct bd_environment *environment)
{
    uint8_t parts = 0;
    if (!io->reading)
        parts =
            (uint8_t)((environment->map ? 1 : 0) | (bd_environment_is_turned(environment) ? 2 : 0));
    bd_flat_enter(io, "environment");
    bd_flat_f32s(io, environment->radiance, 3, 0, FLT_MAX);
    bd_flat_bytes(io, &parts, 1);
    if (parts > 3) bd_flat_fail(io);
    if (parts & 2) bd_flat_f32s(io, environment->rotation, 4, -1, 1);
    if (parts & 2 && !bd_environment_is_turned(environment)) bd_flat_fail(io);
    if (parts & 1 && !io->failed) visit_sky_map(io, &environment->map);
}

// --- alone ----------------------------------------------------------------------------------

static void visit_mesh_content(struct bd_flat_io *io, struct bd_mesh *mesh)
{
    bd_flat_magic(io, mesh_magic);
    if (!bd_flat_items(io, "mesh", &mesh->primitive_count, (void **)&mesh->primitives,
                       sizeof *mesh->primitives, 14))
        return;
    uint32_t i = 0;
    for (; i < mesh->primitive_count && !io->failed; i++) {
        if (!room_for_primitive(io, mesh, i)) break;
        visit_streams(io, &mesh->primitives[i]);
    }
    if (io->reading) mesh->primitive_count = i; // the rest never came
}

static void visit_picture_content(struct bd_flat_io *io, struct bd_picture *picture)
{
    bd_flat_magic(io, picture_magic);
    visit_picture_texels(io, picture);
}

static void visit_sky_map_content(struct bd_flat_io *io, struct bd_sky_map *map)
{
    bd_flat_magic(io, sky_map_magic);
    visit_sky_map_texels(io, map);
}

static void visit_content(struct bd_flat_io *io, const struct bd_content *content)
{
    switch (content->kind) {
    case BD_CONTENT_MESH:
        visit_mesh_content(io, content->mesh);
        break;
    case BD_CONTENT_PICTURE:
        visit_picture_content(io, content->picture);
        break;
    case BD_CONTENT_SKY_MAP:
        visit_sky_map_content(io, content->sky_map);
        break;
    }
}

bool bd_content_write(const struct bd_content *content, bd_flat_sink sink, void *user)
{
    struct bd_flat_io io;
    bd_flat_io_write_to(&io, sink, user);
    visit_content(&io, content);
    return bd_flat_io_flush(&io);
}

static bool kind_of(const void *bytes, size_t size, enum bd_content_kind *kind)
{
    if (size < 8) return false;
    *kind = BD_CONTENT_MESH;
    if (memcmp(bytes, mesh_magic, 8) == 0) return true;
    *kind = BD_CONTENT_PICTURE;
    if (memcmp(bytes, picture_magic, 8) == 0) return true;
    *kind = BD_CONTENT_SKY_MAP;
    return memcmp(bytes, sky_map_magic, 8) == 0;
}

static void new_content(struct bd_flat_io *io, struct bd_content *content)
{
    switch (content->kind) {
    case BD_CONTENT_MESH:
        content->mesh = new_object(io, sizeof *content->mesh);
        break;
    case BD_CONTENT_PICTURE:
        content->picture = new_object(io, sizeof *content->picture);
        break;
    case BD_CONTENT_SKY_MAP:
        content->sky_map = new_object(io, sizeof *content->sky_map);
        break;
    }
}

static void seal_content(const struct bd_content *content)
{
    if (content->mesh) bd_mesh_seal(content->mesh);
    if (content->picture) bd_picture_seal(content->picture);
    if (content->sky_map) bd_sky_map_seal(content->sky_map);
}

static enum bd_err finish_content(struct bd_flat_io *io, struct bd_content *out,
                                  struct bd_err_detail *detail)
{
    new_content(io, out);
    if (!io->failed) visit_content(io, out);
    enum bd_err err = bd_flat_io_verdict(io, "content", detail);
    if (err == BD_ERR_OK)
        seal_content(out);
    else
        bd_content_release(out);
    return err;
}

enum bd_err bd_content_receive(enum bd_content_kind kind, bd_flat_source source, void *user,
                               uint64_t size_max, struct bd_content *out,
                               struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    *out = (struct bd_content){.kind = kind};
    bd_flat_io_read_source(&io, source, user, size_max);
    return finish_content(&io, out, detail);
}

enum bd_err bd_content_read(const void *bytes, size_t size, struct bd_content *out,
                            struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    *out = (struct bd_content){.kind = BD_CONTENT_MESH};
    bd_flat_io_read_from(&io, bytes, size);
    if (!kind_of(bytes, size, &out->kind))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "content", "is no mesh, picture or sky map");
    return finish_content(&io, out, detail);
}
