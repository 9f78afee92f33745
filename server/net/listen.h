// Listeners: addresses that connections come in by.
//
// Thread: the event loop's.

#ifndef BD_NET_LISTEN_H
#define BD_NET_LISTEN_H

#include <stdbool.h>

#include "base/err.h"

struct bd_net;

// `text`: "HOST:PORT" for HTTP, else "unix:PATH" or "tcp:HOST:PORT". Refused: an address beyond
// this machine without tokens. A Unix socket's file has the mode and the group of the options; one
// that nobody answers on is replaced.
BD_MUST_CHECK
enum bd_err bd_listen_on(struct bd_net *net, const char *text, bool is_http,
                         struct bd_err_detail *detail);

// Whoever comes through a proxy would get everything where there are no tokens.
enum bd_err bd_listen_refuse_proxy(struct bd_err_detail *detail);

// What was accepted stays. The file of a Unix socket goes.
void bd_listeners_close(struct bd_net *net);

#endif
