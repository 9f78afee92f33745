// A batch of edits as a client sends it, carried out on a snapshot by the daemon's own steps:
// decoded, its heavy part read, checked. And the small scene that the targets begin with, which is
// made by such a batch.

#ifndef BD_TESTS_FUZZ_BATCH_H
#define BD_TESTS_FUZZ_BATCH_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/bounced.pb-c.h"
#include "scene/blobs/blobs.h"
#include "scene/model/delta.h"
#include "scene/model/scene.h"

// An EditBatch out of its JSON form; NULL if it is none. Free with batch_free.
Bounced__EditBatch *batch_from_json(const uint8_t *text, size_t size);
// The same out of protobuf, within the wire's budget.
Bounced__EditBatch *batch_from_bytes(const uint8_t *bytes, size_t size);
void batch_free(Bounced__EditBatch *batch);

struct batch_inputs {
    struct bd_blobs *blobs; // may be NULL if the batch names none
    const uint8_t *payload;
    size_t payload_bytes;
};

// What the batch makes of `base`, as a delta that is the caller's to finish. `ids`, malloc'ed, are
// those of what each operation adds; may be NULL.
BD_MUST_CHECK
enum bd_err batch_check(const Bounced__EditBatch *batch, const struct batch_inputs *inputs,
                        const struct bd_scene *base, struct bd_delta *out, int32_t **ids,
                        struct bd_err_detail *detail);

// Two meshes, of which one has texture coordinates and colours, three materials, a light of each
// kind, two cameras, nodes below nodes, and a sky. The same whenever it is made; the caller's.
struct bd_scene *batch_small_scene(void);

#endif
