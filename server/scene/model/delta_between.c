// What takes one snapshot to another: every object that is not the same in both.

#include <string.h>

#include "image/bytes.h"
#include "scene/model/delta.h"
#include "scene/model/derive.h"

// The written form is the one that tells states apart: no padding, no pointers, no derived fields.
static bool write_state(const struct bd_scene *scene, enum bd_object_kind kind, uint32_t id,
                        struct bd_bytes *out)
{
    struct bd_delta delta = {0};
    out->size_bytes = 0;
    bool ok =
        bd_delta_take(&delta, scene, kind, id) && bd_delta_write(&delta, bd_flat_to_bytes, out);
    bd_delta_finish(&delta);
    return ok;
}

// A comparison under way; the bytes are kept from one object to the next.
struct comparison {
    const struct bd_scene *from, *to;
    struct bd_bytes before, after;
};

// False without memory.
static bool take_if_different(struct comparison *comparison, enum bd_object_kind kind, uint32_t id,
                              struct bd_delta *out)
{
    struct bd_bytes *before = &comparison->before, *after = &comparison->after;
    if (!write_state(comparison->from, kind, id, before) ||
        !write_state(comparison->to, kind, id, after))
        return false;
    bool is_same = before->size_bytes == after->size_bytes &&
                   memcmp(before->data, after->data, after->size_bytes) == 0;
    return is_same || bd_delta_take(out, comparison->to, kind, id);
}

static uint32_t slot_count(const struct bd_scene *scene, enum bd_object_kind kind)
{
    struct bd_scene_counts slots = bd_scene_slots(scene);
    const uint32_t *count = bd_slots_of(&slots, kind);
    return count ? *count : 1; // the one environment
}

bool bd_delta_between(const struct bd_scene *from, const struct bd_scene *to, struct bd_delta *out)
{
    struct comparison comparison = {.from = from, .to = to};
    *out = (struct bd_delta){0};
    bool ok = true;
    for (int k = 0; ok && k < BD_OBJECT_KIND_COUNT; k++) {
        enum bd_object_kind kind = (enum bd_object_kind)k;
        uint32_t count = slot_count(from, kind), other = slot_count(to, kind);
        if (other > count) count = other;
        for (uint32_t id = 0; ok && id < count; id++)
            ok = take_if_different(&comparison, kind, id, out);
    }
    bd_bytes_finish(&comparison.before);
    bd_bytes_finish(&comparison.after);
    if (!ok) bd_delta_finish(out);
    return ok;
}
