// SIGHUP: the options and the token file once more, without an end of the daemon.
//
// Thread: the event loop's.

#ifndef BD_NET_RELOAD_H
#define BD_NET_RELOAD_H

struct bd_net;

// Reads what main was given again, config files and the token file included. What is wrong with
// them is logged, with file, line and name, and nothing is changed. Otherwise tokens, public names,
// proxies and the limits that are looked at anew for each peer and request count from now on;
// whoever shows a token that is not there any more, or has other rights, loses connection, session
// and cookie. What else differs is logged: it needs a restart.
void bd_net_reload(struct bd_net *net);

#endif
