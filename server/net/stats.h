// What the daemon counts, as a message and as Prometheus text.
//
// Thread: the event loop's.

#ifndef BD_NET_STATS_H
#define BD_NET_STATS_H

#include "net/answer.h"
#include "net/net_internal.h"

void bd_net_count_frame(struct bd_net *net, const struct bd_report *report);

struct bd_answer bd_answer_stats(struct bd_net *net);

// Prometheus text format 0.0.4. The caller frees.
char *bd_net_metrics_text(struct bd_net *net);

#endif
