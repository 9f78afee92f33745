// What the daemon counts, from its start on.
//
// Thread: the event loop's.

#ifndef BD_NET_LOOP_COUNTS_H
#define BD_NET_LOOP_COUNTS_H

#include <stdint.h>

struct bd_report;

#define BD_COUNTS_PASS_MAX 48

struct bd_counts {
    uint64_t start_ns;
    uint64_t requests, requests_refused; // whatever the reason
    uint64_t bytes_in, bytes_out;
    uint64_t frames, frames_remembered;
    // Seconds spent in each pass of every frame, by name, in order of first appearance.
    uint32_t pass_count;
    struct {
        char name[24];
        double seconds;
        uint64_t ran, reused;
    } passes[BD_COUNTS_PASS_MAX];
};

void bd_counts_frame(struct bd_counts *counts, const struct bd_report *report);

#endif
