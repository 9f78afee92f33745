// Traced pixels of the views that were checked last (reference/check_cache.h), by everything that
// their values hang on.
//
// Private to sched/. Thread: the checks' worker.

#ifndef BD_SCHED_CHECK_VIEWS_H
#define BD_SCHED_CHECK_VIEWS_H

#include "reference/check_cache.h"
#include "sched/reference_subject.h"

struct bd_check_views;

struct bd_check_views *bd_check_views_create(void);
// Takes NULL.
void bd_check_views_destroy(struct bd_check_views **views);

// The cache of that view, new or kept. Valid until the next call.
struct bd_check_cache *bd_check_views_find(struct bd_check_views *views,
                                           const struct bd_reference_subject *subject);

#endif
