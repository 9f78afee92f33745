// What takes one snapshot to another: every object that is not the same in both.

#include <stdlib.h>
#include <string.h>

#include "scene/delta.h"

struct bytes {
    uint8_t *data;
    size_t size;
};

static bool collect(void *user, const void *bytes, size_t size)
{
    struct bytes *out = user;
    uint8_t *grown = realloc(out->data, out->size + size + 1);
    if (!grown) return false;
    memcpy(grown + out->size, bytes, size);
    out->data = grown;
    out->size += size;
    return true;
}

// The written form is the one that tells states apart: no padding, no pointers, no derived fields.
static bool write_state(const struct bd_scene *scene, enum bd_object_kind kind, uint32_t id,
                        struct bytes *out)
{
    struct bd_delta delta = {0};
    bool ok = bd_delta_take(&delta, scene, kind, id) && bd_delta_write(&delta, collect, out);
    bd_delta_finish(&delta);
    return ok;
}

// False without memory.
static bool take_if_different(const struct bd_scene *from, const struct bd_scene *to,
                              enum bd_object_kind kind, uint32_t id, struct bd_delta *out)
{
    struct bytes before = {0}, after = {0};
    bool ok = write_state(from, kind, id, &before) && write_state(to, kind, id, &after);
    bool is_same =
        ok && before.size == after.size && memcmp(before.data, after.data, after.size) == 0;
    free(before.data);
    free(after.data);
    return ok && (is_same || bd_delta_take(out, to, kind, id));
}

static uint32_t slot_count(const struct bd_scene *scene, enum bd_object_kind kind)
{
    switch (kind) {
    case BD_OBJECT_PICTURE:
        return scene->picture_count;
    case BD_OBJECT_TEXTURE:
        return scene->texture_count;
    case BD_OBJECT_MATERIAL:
        return scene->material_count;
    case BD_OBJECT_LIGHT:
        return scene->authored_light_count;
    case BD_OBJECT_CAMERA:
        return scene->authored_camera_count;
    case BD_OBJECT_MESH:
        return scene->mesh_count;
    case BD_OBJECT_NODE:
        return scene->node_count;
    case BD_OBJECT_ENVIRONMENT:
        return 1;
    case BD_OBJECT_KIND_COUNT:
        break;
    }
    return 0;
}

bool bd_delta_between(const struct bd_scene *from, const struct bd_scene *to, struct bd_delta *out)
{
    *out = (struct bd_delta){0};
    bool ok = true;
    for (int k = 0; ok && k < BD_OBJECT_KIND_COUNT; k++) {
        enum bd_object_kind kind = (enum bd_object_kind)k;
        uint32_t count = slot_count(from, kind), other = slot_count(to, kind);
        if (other > count) count = other;
        for (uint32_t id = 0; ok && id < count; id++)
            ok = take_if_different(from, to, kind, id, out);
    }
    if (!ok) bd_delta_finish(out);
    return ok;
}
