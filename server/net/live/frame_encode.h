// From a rendered frame to the bytes that are sent.
//
// Thread: any; it takes tens of milliseconds, so the pool's.

#ifndef BD_NET_LIVE_FRAME_ENCODE_H
#define BD_NET_LIVE_FRAME_ENCODE_H

#include "net/wire/frame_options.h"
#include "sched/sched.h"

struct bd_frame_encode {
    const struct bd_frame_options *options;
    const struct bd_job_result *result; // of a job that has ended well
    uint64_t revision;
    uint64_t bytes_max; // limit reply_bytes
};

// `out` is the caller's, also after BD_ERR_LIMIT.
BD_MUST_CHECK
enum bd_err bd_frame_encode(const struct bd_frame_encode *frame, struct bd_encoded *out,
                            double *encode_ms, struct bd_err_detail *detail);

#endif
