// Deltas as bytes: written to the journal, read as a stranger's.

#include <string.h>

#include "scene/model/delta_parts.h"
#include "scene/model/flat_io.h"

static const char magic[8] = {'B', 'D', 'D', 'E', 'L', 'T', '0', '1'};

// What a change refers to is checked when it is applied: only then is it known what there is.
static const struct bd_scene_counts any = {
    BD_OBJECT_ID_END, BD_OBJECT_ID_END, BD_OBJECT_ID_END, BD_OBJECT_ID_END,
    BD_OBJECT_ID_END, BD_OBJECT_ID_END, BD_OBJECT_ID_END,
};

static void visit_state(struct bd_flat_io *io, struct bd_change *change)
{
    switch (change->kind) {
    case BD_OBJECT_PICTURE:
        bd_flat_picture(io, &change->picture);
        break;
    case BD_OBJECT_TEXTURE:
        bd_flat_texture(io, &change->texture, &any);
        break;
    case BD_OBJECT_MATERIAL:
        bd_flat_material(io, &change->material, &any);
        break;
    case BD_OBJECT_LIGHT:
        bd_flat_light(io, &change->light);
        break;
    case BD_OBJECT_CAMERA:
        bd_flat_camera(io, &change->camera);
        break;
    case BD_OBJECT_MESH:
        bd_flat_mesh(io, &change->mesh, &any);
        break;
    case BD_OBJECT_NODE:
        bd_flat_node(io, &change->node, &any);
        break;
    case BD_OBJECT_ENVIRONMENT:
        bd_flat_environment(io, &change->environment);
        break;
    case BD_OBJECT_KIND_COUNT:
        bd_flat_fail(io);
        break;
    }
}

static void visit_change(struct bd_flat_io *io, struct bd_change *change)
{
    bd_flat_enum(io, &change->kind, BD_OBJECT_KIND_COUNT);
    bd_flat_u32(io, &change->id);
    bd_flat_enter(io, bd_object_kind_name(change->kind));
    if (change->id >= (change->kind == BD_OBJECT_ENVIRONMENT ? 1 : BD_OBJECT_ID_END))
        bd_flat_fail(io);
    if (!io->failed) visit_state(io, change);
}

bool bd_delta_write(const struct bd_delta *delta, bd_flat_sink sink, void *user)
{
    struct bd_flat_io io;
    bd_flat_io_write_to(&io, sink, user);
    io.is_index = true;
    bd_flat_magic(&io, magic);
    uint32_t count = delta->count;
    bd_flat_u32(&io, &count);
    // The visitors are shared with reading and so not const; when writing they change nothing.
    for (uint32_t i = 0; i < count && !io.failed; i++) visit_change(&io, &delta->changes[i]);
    return bd_flat_io_flush(&io);
}

static bool follows(const struct bd_delta *delta, const struct bd_change *change)
{
    if (delta->count == 0) return true;
    const struct bd_change *last = &delta->changes[delta->count - 1];
    return last->kind < change->kind || (last->kind == change->kind && last->id < change->id);
}

// Memory grows with what was read, never with what was announced.
static void read_change(struct bd_flat_io *io, struct bd_delta *out)
{
    struct bd_change change;
    memset(&change, 0, sizeof change);
    visit_change(io, &change);
    if (!io->failed && !follows(out, &change)) bd_flat_fail(io);
    if (!io->failed && bd_delta_append(out, &change)) return;
    if (!io->failed) bd_flat_fail_memory(io);
    bd_change_finish(&change);
}

enum bd_err bd_delta_read(const void *bytes, size_t size, bd_content_find find, void *user,
                          struct bd_delta *out, struct bd_err_detail *detail)
{
    struct bd_flat_io io;
    *out = (struct bd_delta){0};
    bd_flat_io_read_from(&io, bytes, size);
    io.is_index = true;
    io.find = find;
    io.find_user = user;
    bd_flat_magic(&io, magic);
    uint32_t count = 0;
    bd_flat_u32(&io, &count);
    for (uint32_t i = 0; i < count && !io.failed; i++) read_change(&io, out);
    enum bd_err err = bd_flat_io_verdict(&io, "delta", detail);
    if (err != BD_ERR_OK) bd_delta_finish(out);
    return err;
}

void bd_content_of_delta(const struct bd_delta *delta, bd_content_visit each, void *user)
{
    for (uint32_t i = 0; i < delta->count; i++) {
        const struct bd_change *change = &delta->changes[i];
        struct bd_content content = {.kind = BD_CONTENT_MESH};
        if (change->kind == BD_OBJECT_MESH && change->mesh->primitive_count > 0)
            content.mesh = change->mesh;
        if (change->kind == BD_OBJECT_PICTURE && !change->picture->is_removed)
            content = (struct bd_content){.kind = BD_CONTENT_PICTURE, .picture = change->picture};
        if (change->kind == BD_OBJECT_ENVIRONMENT && change->environment.map)
            content =
                (struct bd_content){.kind = BD_CONTENT_SKY_MAP, .sky_map = change->environment.map};
        if (bd_content_sha256(&content)) each(user, &content);
    }
}
