// Frames that were asked for by HTTP and are complete, as they were sent: the same request for the
// same state of a scene is answered without rendering.
//
// A frame is named by all that its bytes and its report depend on: the scene's id, revision,
// transient count and content, the request with every field that was set, the device and the build.
// Which of them may be kept at all, and who may see them, is for who asks: a name tells nothing of
// rights.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_FRAME_CACHE_H
#define BD_NET_COMMAND_FRAME_CACHE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/hash.h"
#include "net/wire/answer.h"
#include "protocol/limits.h"
#include "scene/store/store.h"

struct bd_frame_cache;

// Holds at most limits->frame_cache_bytes, of frames, reports and its own entries; what was used
// longest ago goes first. The limits are borrowed.
struct bd_frame_cache *bd_frame_cache_create(const struct bd_limits *limits);
void bd_frame_cache_destroy(struct bd_frame_cache **cache);

// Not where time decides what comes (a deadline, an error to reach), nor where the report is the
// answer, nor where the request says what may be used again (`fresh`).
bool bd_frame_cache_may_keep(const Bounced__FrameRequest *request);

void bd_frame_cache_key(const Bounced__FrameRequest *request, const struct bd_store_entry *entry,
                        const struct bd_sched_stats *device, uint8_t key[BD_SHA256_BYTES]);

// The answer of that name, a copy. Its report says `remembered`, that every pass is reused, and no
// time. False: there is none.
bool bd_frame_cache_get(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                        struct bd_answer *out);
// Keeps a copy, if there is room for it. False if the frame is none that comes again: it is not
// complete, or not finite.
bool bd_frame_cache_put(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                        const struct bd_answer *answer);

#endif
