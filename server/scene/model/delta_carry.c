// What a change did, done to an object that others have changed since: property by property, as
// the operations of an edit name them.

#include <stddef.h>
#include <string.h>

#include "image/bytes.h"
#include "scene/model/delta_parts.h"

// --- properties -----------------------------------------------------------------------------

// Where a property lies in a change. What means nothing without its neighbour is one property.
struct property {
    const char *name;
    size_t offset, size;
};

#define IN(path) offsetof(struct bd_change, path), sizeof(((struct bd_change *)0)->path)

// What is no row of its object's fields.
static const struct {
    enum bd_object_kind kind;
    struct property property;
} others[] = {
    {BD_OBJECT_TEXTURE, {"picture", IN(texture.picture)}},
    {BD_OBJECT_NODE, {"mesh", IN(node.mesh_is_world_space)}},
    {BD_OBJECT_NODE, {"transform", IN(node.parent_from_node)}},
    // The inner angle is never above the outer one.
    {BD_OBJECT_LIGHT, {"cone", offsetof(struct bd_change, light.cone_inner), 2 * sizeof(float)}},
};
#undef IN

_Static_assert(offsetof(struct bd_light, cone_outer) ==
                   offsetof(struct bd_light, cone_inner) + sizeof(float),
               "a cone is one property");

static bool is_its_own(const struct bd_object_field *row)
{
    return row->type != BD_FIELD_HEAVY && strncmp(row->name, "cone_", 5) != 0;
}

// The property behind `*at` among those of a kind, and moves on. False: there are no more.
static bool next_property(enum bd_object_kind kind, uint32_t *at, struct property *out)
{
    const size_t object = offsetof(struct bd_change, material); // that of each kind
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (; *at < list.count + sizeof others / sizeof *others; ++*at) {
        if (*at >= list.count && others[*at - list.count].kind == kind) {
            *out = others[(*at)++ - list.count].property;
            return true;
        }
        if (*at < list.count && is_its_own(&list.rows[*at])) {
            const struct bd_object_field *row = &list.rows[(*at)++];
            *out = (struct property){row->name, object + row->offset, bd_field_bytes(row)};
            return true;
        }
    }
    return false;
}

static const void *value_of(const struct bd_change *change, const struct property *property)
{
    return (const char *)change + property->offset;
}

static bool is_same(const struct property *property, const struct bd_change *a,
                    const struct bd_change *b)
{
    return memcmp(value_of(a, property), value_of(b, property), property->size) == 0;
}

static void set(const struct property *property, struct bd_change *to, const struct bd_change *from)
{
    memcpy((char *)to + property->offset, value_of(from, property), property->size);
}

// --- what is heavy --------------------------------------------------------------------------

static bool write_one(const struct bd_change *change, struct bd_bytes *out)
{
    struct bd_change copy = *change;
    const struct bd_delta delta = {.count = 1, .room = 1, .changes = &copy};
    return bd_delta_write(&delta, bd_flat_to_bytes, out);
}

// By the written form, which has no pointers. Without memory: not the same, which refuses.
static bool is_same_whole(const struct bd_change *a, const struct bd_change *b)
{
    struct bd_bytes one = {0}, other = {0};
    const bool same = write_one(a, &one) && write_one(b, &other) &&
                      one.size_bytes == other.size_bytes &&
                      memcmp(one.data, other.data, one.size_bytes) == 0;
    bd_bytes_finish(&one);
    bd_bytes_finish(&other);
    return same;
}

static bool is_same_map(const struct bd_change *a, const struct bd_change *b)
{
    const struct bd_sky_map *one = a->environment.map, *other = b->environment.map;
    if (!one || !other) return one == other;
    return memcmp(one->sha256, other->sha256, sizeof one->sha256) == 0;
}

static void set_map(struct bd_change *to, const struct bd_change *from)
{
    struct bd_sky_map *map = from->environment.map;
    if (map) bd_sky_map_retain(map);
    bd_sky_map_release(&to->environment.map);
    to->environment.map = map;
}

// The same object as it is in another change, whole.
static void replace(struct bd_change *to, const struct bd_change *from)
{
    bd_change_retain(from);
    bd_change_finish(to);
    *to = *from;
}

// --- one object -----------------------------------------------------------------------------

static void clash(struct bd_clash *clash, const struct bd_change *change, const char *property)
{
    if (clash->is_there) return;
    *clash = (struct bd_clash){true, change->kind, change->id, property};
}

// All that can be told apart within an object that is in each of the three.
static void carry_properties(struct bd_change *onto, const struct bd_change *before,
                             const struct bd_change *after, struct bd_clash *found)
{
    struct property property;
    for (uint32_t at = 0; next_property(onto->kind, &at, &property);) {
        if (is_same(&property, before, after)) continue;
        if (!is_same(&property, onto, before) && !is_same(&property, onto, after))
            clash(found, onto, property.name);
        set(&property, onto, after);
    }
    if (onto->kind != BD_OBJECT_ENVIRONMENT || is_same_map(before, after)) return;
    if (!is_same_map(onto, before) && !is_same_map(onto, after)) clash(found, onto, "map");
    set_map(onto, after);
}

// Meshes and pictures are one property each; so is whether an object is there at all.
static void carry_whole(struct bd_change *onto, const struct bd_change *before,
                        const struct bd_change *after, struct bd_clash *found)
{
    if (is_same_whole(before, after)) return;
    if (!is_same_whole(onto, before) && !is_same_whole(onto, after))
        clash(found, onto, bd_clash_whole);
    replace(onto, after);
}

const char bd_clash_whole[] = "";

void bd_change_carry(struct bd_change *onto, const struct bd_change *before,
                     const struct bd_change *after, struct bd_clash *found)
{
    const bool was = !bd_change_is_removal(before), will_be = !bd_change_is_removal(after);
    const bool is_heavy = onto->kind == BD_OBJECT_MESH || onto->kind == BD_OBJECT_PICTURE;
    if (was && will_be && bd_change_is_removal(onto))
        clash(found, onto, bd_clash_whole); // nothing is left that could be changed
    else if (was && will_be && !is_heavy)
        carry_properties(onto, before, after, found);
    else
        carry_whole(onto, before, after, found);
}

// --- lists ----------------------------------------------------------------------------------

bool bd_delta_carry(const struct bd_scene *onto, const struct bd_delta *before,
                    const struct bd_delta *after, struct bd_delta *out, struct bd_clash *found)
{
    bool ok = true;
    for (uint32_t i = 0; ok && i < after->count; i++) {
        const struct bd_change *to = &after->changes[i];
        const struct bd_change *from = bd_delta_get(before, to->kind, to->id);
        if (!bd_delta_get(out, to->kind, to->id)) ok = bd_delta_take(out, onto, to->kind, to->id);
        if (ok && from) bd_change_carry(bd_delta_find(out, to->kind, to->id), from, to, found);
    }
    if (!ok) bd_delta_finish(out);
    return ok;
}

bool bd_delta_touches(const struct bd_delta *before, const struct bd_delta *after,
                      const struct bd_clash *clash_of)
{
    const struct bd_change *from = bd_delta_get(before, clash_of->kind, clash_of->id);
    const struct bd_change *to = bd_delta_get(after, clash_of->kind, clash_of->id);
    if (!from || !to) return false;
    if (!clash_of->property[0] || bd_change_is_removal(from) != bd_change_is_removal(to))
        return true;
    if (clash_of->kind == BD_OBJECT_ENVIRONMENT && strcmp(clash_of->property, "map") == 0)
        return !is_same_map(from, to);
    struct property property;
    for (uint32_t at = 0; next_property(clash_of->kind, &at, &property);)
        if (strcmp(property.name, clash_of->property) == 0 && !is_same(&property, from, to))
            return true;
    return false;
}
