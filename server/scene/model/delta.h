// Deltas: what every change of a scene is made of.
//
// A delta lists objects and the whole state that each has afterwards; "removed" is a state too. So
// deltas need no operations to be undone, merged or replayed: the inverse is the states from
// before, a merge is the later state of each object, a journal is a list of deltas. Ids are never
// moved: what is removed leaves an empty slot (scene.h), which is filled again only by an inverse
// or a replay.
//
// Thread: any, one at a time a delta. No heavy bytes are touched: time is that of the small
// objects.

#ifndef BD_SCENE_MODEL_DELTA_H
#define BD_SCENE_MODEL_DELTA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/content.h"
#include "scene/model/flat.h"
#include "scene/model/object_fields.h"
#include "scene/model/scene.h"

// Ids are below it: what a hostile delta can make a scene's arrays grow to.
#define BD_OBJECT_ID_END (1 << 22)

// The state of one object after the change. Owns a reference to what is heavy.
struct bd_change {
    enum bd_object_kind kind;
    uint32_t id;
    union {
        struct bd_picture *picture;
        struct bd_texture texture;
        struct bd_material material;
        struct bd_light light;
        struct bd_camera camera;
        struct bd_mesh *mesh;
        struct bd_node node; // its derived fields mean nothing here
        struct bd_environment environment;
    };
};

// Ordered by kind and id, each object once. All zero is the empty delta.
struct bd_delta {
    uint32_t count, room;
    struct bd_change *changes;
};

void bd_delta_finish(struct bd_delta *delta);

bool bd_change_is_removal(const struct bd_change *change);
// The kind's own count among them; NULL of the environment, which has no slots.
uint32_t *bd_slots_of(struct bd_scene_counts *counts, enum bd_object_kind kind);

// What it says of an object; NULL: nothing. Borrowed.
const struct bd_change *bd_delta_get(const struct bd_delta *delta, enum bd_object_kind kind,
                                     uint32_t id);

// Puts the state that the object has in the scene into the delta, in place of one that it has
// there already. Beyond the scene's objects: removed. False without memory.
BD_MUST_CHECK
bool bd_delta_take(struct bd_delta *delta, const struct bd_scene *scene, enum bd_object_kind kind,
                   uint32_t id);

// The finished snapshot that `base` becomes, with its hash; the caller owns it. It shares what is
// heavy, and keeps the counters of all aspects that are, as derived, what they were. Refused where
// something refers to what is not there, or a node to itself: BD_ERR_BAD_INPUT, and the error names
// it. BD_ERR_LIMIT for ids beyond BD_OBJECT_ID_END, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_delta_apply(const struct bd_scene *base, const struct bd_delta *delta,
                           struct bd_scene **out, struct bd_err_detail *detail);

// What takes back `delta` from what it makes of `base`. `*out` is the caller's to finish. These two
// are false only without memory.
BD_MUST_CHECK
bool bd_delta_invert(const struct bd_scene *base, const struct bd_delta *delta,
                     struct bd_delta *out);
// The one that does what `first` and then `second` do.
BD_MUST_CHECK
bool bd_delta_merge(const struct bd_delta *first, const struct bd_delta *second,
                    struct bd_delta *out);

// What takes `from` to `to`. Takes the time of writing all small objects of both.
BD_MUST_CHECK
bool bd_delta_between(const struct bd_scene *from, const struct bd_scene *to, struct bd_delta *out);

// The first property that could not be carried over without losing what somebody else made of it.
struct bd_clash {
    bool is_there;
    enum bd_object_kind kind;
    uint32_t id;
    const char *property; // as edits name it; bd_clash_whole: the object
};
extern const char bd_clash_whole[];

// What took `before` to `after`, two states of one object, done to `onto`, a third of it: the
// properties in which the two differ are those of `after` then, the rest stays. It clashes where
// `onto` has neither of the two values, or the object is gone; the value of `after` is taken all
// the same, but what is gone stays so.
void bd_change_carry(struct bd_change *onto, const struct bd_change *before,
                     const struct bd_change *after, struct bd_clash *found);
// The same of all objects of `after`, which `before` has too, onto a scene with `out` over it,
// which has the result. False, and `out` empty, only without memory.
BD_MUST_CHECK
bool bd_delta_carry(const struct bd_scene *onto, const struct bd_delta *before,
                    const struct bd_delta *after, struct bd_delta *out, struct bd_clash *found);
// Whether what took `before` to `after` changed what clashes.
bool bd_delta_touches(const struct bd_delta *before, const struct bd_delta *after,
                      const struct bd_clash *clash);

// Content is named, not written: whoever keeps the bytes keeps what bd_content_of_delta lists.
// False if the sink said so.
BD_MUST_CHECK
bool bd_delta_write(const struct bd_delta *delta, bd_flat_sink sink, void *user);
// Trusts nothing but `find`. BD_ERR_BAD_INPUT, BD_ERR_NOT_FOUND for content that is missing,
// BD_ERR_NO_MEMORY. `*out` is the caller's to finish; empty after a failure.
BD_MUST_CHECK
enum bd_err bd_delta_read(const void *bytes, size_t size, bd_content_find find, void *user,
                          struct bd_delta *out, struct bd_err_detail *detail);
void bd_content_of_delta(const struct bd_delta *delta, bd_content_visit each, void *user);

// How many slots applying it adds to the kind that grows most: what it adds, and the ids in
// between.
uint32_t bd_delta_growth(const struct bd_scene *base, const struct bd_delta *delta);

// For a log, one entry a change: "light 0", "node 12 removed", "environment". Where there are more
// than fit, the last one says how many: "and 17 more". Returns how many entries were written.
#define BD_DELTA_ENTRY_BYTES 32
uint32_t bd_delta_describe(const struct bd_delta *delta, char (*entries)[BD_DELTA_ENTRY_BYTES],
                           uint32_t entry_max);

#endif
