// The pictures of a file on their way from encoded bytes to texels: decoded side by side, taken in
// order, and shrunk where all together are more than there is room for.
//
// At any time it holds no more than a window's worth of them, however many there are: a picture is
// decoded when those before it leave room. What comes out depends on the bytes and the limits
// alone, never on which thread was faster: sizes are read from the heads of all, and what is to be
// shrunk is decided, before the first is decoded. What the file had is not kept: exports have what
// is held.
//
// Runs in the import child (and in tests). Thread: one owner calls; threads of its own decode.

#ifndef BD_SCENE_GLTF_PICTURE_QUEUE_H
#define BD_SCENE_GLTF_PICTURE_QUEUE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "image/shrink.h"
#include "scene/gltf/import_input.h"

struct bd_picture_queue;

// The threads are there, waiting, when this returns: a filter of system calls that comes after it
// holds for them too. `thread_count` beside the owner's, which decodes as well; 0 is fine. NULL
// without memory.
struct bd_picture_queue *bd_picture_queue_create(uint32_t thread_count);
// Waits for what is being decoded. Nulls; takes NULL.
void bd_picture_queue_destroy(struct bd_picture_queue **queue);

struct bd_encoded_picture {
    const void *bytes; // borrowed until the queue is destroyed
    size_t size_bytes;
    enum bd_texel_kind kind;
    uint32_t image;  // for errors: images[image]
    bool is_in_view; // .bufferView, not .uri
};

// Before bd_picture_queue_begin. False without memory.
BD_MUST_CHECK
bool bd_picture_queue_add(struct bd_picture_queue *queue, const struct bd_encoded_picture *encoded);

struct bd_shrunk_pictures {
    uint32_t count;                       // of those that were added
    uint64_t texels_before, texels_after; // of all of them
};

// Reads every head and decides on sizes: while all together have more than
// limits->picture_texels_kept, one of the largest (as a power of two of its texels; of several the
// first) has its sides halved. BD_ERR_LIMIT where they cannot be made so few, or where what is left
// is more than limits->picture_texels. Then decoding begins.
BD_MUST_CHECK
enum bd_err bd_picture_queue_begin(struct bd_picture_queue *queue,
                                   const struct bd_import_limits *limits,
                                   struct bd_shrunk_pictures *shrunk, struct bd_err_detail *detail);

// The size that picture `index` will have.
void bd_picture_queue_size(const struct bd_picture_queue *queue, uint32_t index, uint32_t *width_px,
                           uint32_t *height_px);

// The next picture's texels, the caller's to free; as many calls as pictures were added. The error
// of the first picture that has one is the error of all.
BD_MUST_CHECK
enum bd_err bd_picture_queue_take(struct bd_picture_queue *queue, uint8_t **rgba,
                                  struct bd_err_detail *detail);

#endif
