// The machine's share for the reference: one pool of threads, the scenes that are prepared for
// tracing, and whose turn it is.
//
// Whole references (sched/reference_trace.h) and spot checks of rendered frames share it. Nothing
// is started or allocated before the first loop: a daemon that traces nothing pays nothing.
//
// To trace: take the reference of a snapshot, run loops over whatever is to be traced, give it
// back. A long loop is cut into turns of about 50 ms, so that several callers get on side by side;
// waiting callers come in the order in which they came.
//
// What somebody waits for and what judges frames that are shown already are two lanes with threads
// of their own, which have the niceness of the lane's first caller. What is waited for steps back
// by its turns instead: while something more urgent is under way, each begins a fifth of a second
// late.
//
// Thread: any; every call but create and destroy may block, and asks `should_stop` while it does.

#ifndef BD_SCHED_REFERENCE_RUNNER_H
#define BD_SCHED_REFERENCE_RUNNER_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "reference/reference.h"
#include "scene/model/scene.h"
#include "sched/reference_sums.h"

struct bd_reference_runner;

// `thread_count` 0 = as many as the machine runs at once.
struct bd_reference_runner *bd_reference_runner_create(uint32_t thread_count);
// Nobody may be inside. Takes NULL.
void bd_reference_runner_destroy(struct bd_reference_runner **runner);

// In every call `should_stop` may be asked from any thread, several at once; what it answers,
// unless BD_ERR_OK, is what the call returns. NULL: never stop.

// Prepares a snapshot for tracing, or finds it prepared: what is kept is found by the snapshot's
// content, the last used ones up to a count and an amount of memory. Where only light, colours,
// roughness or cameras differ from one that is kept, its acceleration structure is taken over.
// `*reused`: no such structure was built. A
// caller that stops leaves nothing half built; another one that waits for the same snapshot then
// builds it anew. Borrowed until given back. BD_ERR_NO_MEMORY with what was too large.
BD_MUST_CHECK
enum bd_err bd_reference_runner_take(struct bd_reference_runner *runner, struct bd_scene *scene,
                                     bd_reference_should_stop should_stop, void *user,
                                     const struct bd_reference **out, bool *reused,
                                     struct bd_err_detail *detail);
// Nulls; takes NULL.
void bd_reference_runner_give_back(struct bd_reference_runner *runner,
                                   const struct bd_reference **reference);

// Lives as long as the runner.
struct bd_reference_sums *bd_reference_runner_sums(struct bd_reference_runner *runner);

enum bd_runner_lane { BD_RUNNER_ASKED, BD_RUNNER_CHECK, BD_RUNNER_LANE_COUNT };

// Who runs a loop. `is_urgent_elsewhere` (or NULL) is asked before each turn, on the caller's
// thread.
struct bd_runner_caller {
    enum bd_runner_lane lane;
    bool (*is_urgent_elsewhere)(void *of);
    void *of;
};

// Calls work(user, i) for 0 <= i < count, each i once, in no order, on the pool's threads and the
// caller's. An item is to be shorter than 20 ms. `should_stop` gets the same user.
BD_MUST_CHECK
enum bd_err bd_reference_runner_loop(struct bd_reference_runner *runner,
                                     const struct bd_runner_caller *caller, uint32_t count,
                                     void (*work)(void *user, uint32_t i),
                                     bd_reference_should_stop should_stop, void *user);

struct bd_reference_runner_stats {
    uint32_t thread_count;    // of a lane, 0 before the first loop
    uint32_t reference_count; // prepared snapshots
    uint64_t memory_bytes;    // of all of them, and of sums
    uint64_t built_count;     // since the start
};
void bd_reference_runner_stats(struct bd_reference_runner *runner,
                               struct bd_reference_runner_stats *out);

#endif
