// What the files of the framed face share: one connection's state.

#ifndef BD_NET_FRAMED_INTERNAL_H
#define BD_NET_FRAMED_INTERNAL_H

#include "net/command.h"
#include "net/framed.h"
#include "net/net_internal.h"
#include "protocol/framing.h"

struct bd_framed_request; // under way
struct bd_framed_upload;  // a blob on its way in

struct bd_framed {
    struct bd_conn conn;
    struct bd_decoder decoder;
    bool greeted, is_private;
    struct bd_framed_request *requests;
    uint32_t request_count;
    struct bd_framed_upload *uploads;
    uint32_t upload_count;
};

// Sends under this id and takes what is in `answer`.
void bd_framed_send(struct bd_framed *framed, uint64_t request_id, struct bd_answer *answer);
void bd_framed_send_fault(struct bd_framed *framed, uint64_t request_id,
                          const struct bd_fault *fault);

// Stops or goes on reading, by what waits to be written to the peer and to the disk.
void bd_framed_update_reading(struct bd_framed *framed);

// --- framed_upload.c ---

// One piece, answered now or, the last one, once the blob is kept.
void bd_framed_put_piece(struct bd_framed *framed, const Bounced__Envelope *envelope,
                         const struct bd_message *message);
// Does the disk keep up with every upload?
bool bd_framed_uploads_have_room(const struct bd_framed *framed);
void bd_framed_forget_uploads(struct bd_framed *framed);

// --- framed_hello.c ---

struct bd_answer bd_framed_hello_reply(const struct bd_net *net);

#endif
