// What the heavy operations of one batch may make of their bytes, all together: a short message can
// name one large blob a thousand times, and a picture of one colour is a small file.
//
// Thread: whoever reads the batch.

#ifndef BD_NET_COMMAND_EDIT_BUDGET_H
#define BD_NET_COMMAND_EDIT_BUDGET_H

#include <stdint.h>

#include "base/err.h"
#include "protocol/limits.h"
#include "scene/model/scene.h"

// What is left. Whatever is given up again is put back by putting back the numbers.
struct bd_edit_budget {
    uint64_t bytes;       // of streams and maps: the limit scene_bytes
    uint64_t texels;      // of pictures: picture_texels
    uint64_t quota_bytes; // of both: max_bytes, where the scene counts for whoever asks
};

struct bd_edit_budget bd_edit_budget(const struct bd_limits *limits, uint64_t quota_bytes);

// All of them are BD_ERR_LIMIT where not so much is left; the error names `field`, or max_bytes.

// Held for the batch alone: it takes the place of what is as large.
BD_MUST_CHECK
enum bd_err bd_edit_budget_hold(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_err_detail *detail);
// The scene may grow by it.
BD_MUST_CHECK
enum bd_err bd_edit_budget_take(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_err_detail *detail);
// Of a picture, or of a whole scene, that was read with no more than what is left as its limits.
BD_MUST_CHECK
enum bd_err bd_edit_budget_take_picture(struct bd_edit_budget *left,
                                        const struct bd_picture *picture,
                                        struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_edit_budget_take_scene(struct bd_edit_budget *left, const struct bd_scene *scene,
                                      struct bd_err_detail *detail);

#endif
