// Worker threads that share one counted loop: the reference's tiles, a spot check's pixels, a batch of
// rays.
//
// Thread: one loop at a time; bd_pool_run blocks its caller, who works along.

#ifndef BD_BASE_POOL_H
#define BD_BASE_POOL_H

#include <stdint.h>

#include "base/err.h"

struct bd_pool;

// `thread_count` including the caller of bd_pool_run; 0 = as many as the machine runs at once.
struct bd_pool *bd_pool_create(uint32_t thread_count);
void bd_pool_destroy(struct bd_pool **pool);
uint32_t bd_pool_thread_count(const struct bd_pool *pool);

// Calls work(user, i) for 0 <= i < count, each i once, in no order, on any thread. `should_stop`
// (or NULL) is asked by the caller's thread between its items, at least every 20 ms of work per
// item: items are to be shorter than that. What it answers is returned; items that were begun are
// ended.
BD_MUST_CHECK
enum bd_err bd_pool_run(struct bd_pool *pool, uint32_t count, void (*work)(void *user, uint32_t i),
                        enum bd_err (*should_stop)(void *user), void *user);

#endif
