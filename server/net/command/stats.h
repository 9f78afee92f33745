// What the daemon counts, as a message and as Prometheus text.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_STATS_H
#define BD_NET_COMMAND_STATS_H

#include "net/loop/loop.h"
#include "net/wire/answer.h"

struct bd_answer bd_answer_stats(const struct bd_loop *loop);

// Prometheus text format 0.0.4. The caller frees.
char *bd_net_metrics_text(const struct bd_loop *loop);

#endif
