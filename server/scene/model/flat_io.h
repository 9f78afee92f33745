// What the flat forms of a scene, of its heavy objects and of a delta are written and read with.
// Only scene/ includes this.
//
// One visitor for both directions: each function names a field once, and a field that is written
// is the field that is read. `failed` is sticky, so that a chain of fields is checked once; the
// part that fails first is the part that is named.
//
// What is written belongs to snapshots that other threads read: while writing, a visitor stores
// nothing in it, not even what stands there already.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_MODEL_FLAT_IO_H
#define BD_SCENE_MODEL_FLAT_IO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/content.h"
#include "scene/model/flat.h"
#include "scene/model/scene.h"

struct bd_flat_io {
    bool reading;
    bool failed;
    bool no_memory;
    bool is_index;    // heavy objects by their SHA-256
    const char *part; // what is being visited, for the error
    uint8_t *missing; // of the content that nobody has; points into missing_sha256
    // writing
    bd_flat_sink sink;
    void *user;
    size_t used;
    bd_flat_texels texels; // NULL: pictures hold their own
    void *texels_user;
    // reading
    const uint8_t *bytes;
    size_t size, offset;   // from a source: `size` is what may come at most
    bd_flat_source source; // NULL: `bytes`
    void *source_user;
    bd_content_find find;
    void *find_user;
    uint8_t missing_sha256[32];
    uint8_t buffer[65536]; // last: it is not set to anything
};

void bd_flat_io_write_to(struct bd_flat_io *io, bd_flat_sink sink, void *user);
void bd_flat_io_read_from(struct bd_flat_io *io, const void *bytes, size_t size);
void bd_flat_io_read_source(struct bd_flat_io *io, bd_flat_source source, void *user,
                            size_t size_max);
// Sends what is left. False if the sink refused something.
BD_MUST_CHECK
bool bd_flat_io_flush(struct bd_flat_io *io);
// After reading: BD_ERR_OK only if all went well and nothing is left over (of a source, whose end
// its owner sees, that is not asked). `what` names the whole.
BD_MUST_CHECK
enum bd_err bd_flat_io_verdict(struct bd_flat_io *io, const char *what,
                               struct bd_err_detail *detail);

void bd_flat_enter(struct bd_flat_io *io, const char *part);
void bd_flat_fail(struct bd_flat_io *io);
void bd_flat_fail_memory(struct bd_flat_io *io);
size_t bd_flat_left(const struct bd_flat_io *io);

void bd_flat_bytes(struct bd_flat_io *io, void *bytes, size_t size);
void bd_flat_u32(struct bd_flat_io *io, uint32_t *value);
void bd_flat_bool(struct bd_flat_io *io, bool *value);
// `*value` is any enum of ours, each of the size of an int; `count` is one past its last value.
void bd_flat_enum(struct bd_flat_io *io, void *value, uint32_t count);
// BD_NONE or below `count`.
void bd_flat_index(struct bd_flat_io *io, int32_t *index, uint32_t count);
void bd_flat_f32(struct bd_flat_io *io, float *value, float least, float most);
void bd_flat_f32s(struct bd_flat_io *io, float *values, int count, float least, float most);
void bd_flat_text(struct bd_flat_io *io, char *text, size_t size);
// A fixed word of eight bytes that tells one form from another.
void bd_flat_magic(struct bd_flat_io *io, const char magic[8]);
// A stream of finite floats, or nothing. When reading, `*stream` is allocated.
void bd_flat_stream(struct bd_flat_io *io, float **stream, uint32_t vertex_count, uint32_t width,
                    bool required);
// Counts and, when reading, allocates `*items`. The smallest form that an item can have bounds what
// the bytes that are left can hold, so a count costs no memory that the input does not pay for.
// From a source they are allocated as they come: ask bd_flat_room before each.
BD_MUST_CHECK
bool bd_flat_items(struct bd_flat_io *io, const char *part, uint32_t *count, void **items,
                   size_t item_bytes, size_t flat_bytes_min);

// Room for item `index` of `count` when reading; what is new is zero. False without memory.
BD_MUST_CHECK
bool bd_flat_room(struct bd_flat_io *io, void **items, size_t item_bytes, uint32_t index,
                  uint32_t count);

// flat_objects.c: one object each. References are held to `counts`.
void bd_flat_node(struct bd_flat_io *io, struct bd_node *node,
                  const struct bd_scene_counts *counts);
void bd_flat_material(struct bd_flat_io *io, struct bd_material *material,
                      const struct bd_scene_counts *counts);
void bd_flat_texture(struct bd_flat_io *io, struct bd_texture *texture,
                     const struct bd_scene_counts *counts);
void bd_flat_light(struct bd_flat_io *io, struct bd_light *light);
void bd_flat_camera(struct bd_flat_io *io, struct bd_camera *camera);

// flat_heavy.c: whole, or as their SHA-256 where `io->is_index`. What is read is sealed; a slot
// that could not be read is left NULL or half-filled, and the reading has failed.
void bd_flat_mesh(struct bd_flat_io *io, struct bd_mesh **slot,
                  const struct bd_scene_counts *counts);
void bd_flat_picture(struct bd_flat_io *io, struct bd_picture **slot);
void bd_flat_environment(struct bd_flat_io *io, struct bd_environment *environment);

#endif
