// Answers: what a command ends with, whichever transport asked.
//
// Messages here are built from malloc'ed pieces, so that protobuf-c's own free takes them apart.
// Thread: any for building; the event loop's for sending.

#ifndef BD_NET_WIRE_ANSWER_H
#define BD_NET_WIRE_ANSWER_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/hash.h"
#include "protocol/bounced.pb-c.h"
#include "scene/store/store.h"
#include "sched/sched.h"

struct bd_answer {
    Bounced__Envelope *envelope; // with one body; owned
    uint8_t *payload;            // malloc'ed, owned; NULL = none
    size_t payload_bytes;
    const char *payload_type;     // MIME; static
    char etag[2 + BD_SHA256_HEX]; // of a frame that is the same whenever it is asked for; "" = none
};

// Frees what is left in it and zeroes it.
void bd_answer_finish(struct bd_answer *answer);

// A malloc'ed copy; aborts without memory, since a string of ours is small.
char *bd_answer_text(const char *text);
// `count` items of zeroes, at least one; aborts without memory likewise.
void *bd_answer_zeroed(size_t count, size_t item_bytes);

// Sets one optional scalar of a message, as presence needs.
#define BD_SET(message, field, value) ((message)->has_##field = 1, (message)->field = (value))

// Each makes an answer with one body, to be filled or sent.
struct bd_answer bd_answer_error(const struct bd_err_detail *detail);
struct bd_answer bd_answer_done(void);
struct bd_answer bd_answer_scene(const struct bd_store_entry *entry);
// BlobReply to BlobPut.
struct bd_answer bd_answer_blob(uint64_t offset, bool complete);

// The envelope of a body that the caller has made. `body` is the oneof's member, owned from now on.
struct bd_answer bd_answer_of(Bounced__Envelope__BodyCase body_case, void *body);

// A frame's report. `load_ms` and `encode_ms` are what the scheduler does not see; `exposure` NULL
// if there is none.
Bounced__Report *bd_report_message(const struct bd_report *report, uint64_t revision,
                                   double load_ms, double encode_ms, const float *exposure_stops);

Bounced__Scene *bd_scene_message(const struct bd_store_entry *entry);
Bounced__Device *bd_device_message(const struct bd_sched_stats *stats);

#endif
