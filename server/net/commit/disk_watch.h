// A look at the data directory every second, beside the loop: whether the journal is still where it
// was, for whoever asks if we are ready before any edit finds out; and blobs that nobody used for
// blob_seconds, at least four times as often.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_DISK_WATCH_H
#define BD_NET_COMMIT_DISK_WATCH_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

struct bd_commits;

#define BD_DISK_WATCH_MS 1000
// A disk that has not answered for so long is said to be gone.
#define BD_DISK_SILENT_MS 10000
// And where no thread came free for so long to ask it.
#define BD_DISK_CROWDED_MS 60000

struct bd_disk_watch {
    uv_timer_t timer;
    uv_work_t work;
    bool is_looking;
    uint64_t asked_ns, collect_ns; // when blobs are looked at next
    _Atomic uint64_t began_ns;     // the look at its place, 0 = not under way. Of the pool
    atomic_bool is_answered;       // that look has ended; what else is done with the disk may go on
    bool is_in_place;              // what the last look found
    bool found;                    // what the one under way finds: the pool's
    uint64_t blob_seconds;         // the limit as it was when that began
};

void bd_disk_watch_begin(struct bd_commits *commits);
void bd_disk_watch_close(struct bd_commits *commits);

// NULL, or why no edit can be kept.
const char *bd_disk_watch_trouble(const struct bd_commits *commits);

#endif
