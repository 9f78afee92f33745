// Browser sessions: a cookie instead of a token. A page trades its token for one, and from then on
// the browser shows it with requests that cannot carry a header: WebSocket, event streams, images.
//
// A cookie is 32 random bytes; only its SHA-256 is kept, in a table of bounded size. It expires
// cookie_seconds after it was made; when the table is full, the oldest goes.
//
// Thread: the event loop's.

#ifndef BD_NET_ACCESS_COOKIE_H
#define BD_NET_ACCESS_COOKIE_H

#include "net/access/auth.h"
#include "protocol/limits.h"

#define BD_COOKIE_NAME  "bounced_session"
#define BD_COOKIE_BYTES 65 // hexadecimal digits and the final zero

struct bd_cookies;

struct bd_cookies *bd_cookies_create(const struct bd_limits *limits);
void bd_cookies_destroy(struct bd_cookies **cookies);

// A new one, that allows what the token did that it was made for. `grant` outlives the table.
void bd_cookies_issue(struct bd_cookies *cookies, const struct bd_grant *grant,
                      char out[BD_COOKIE_BYTES]);

// What the cookie in a Cookie header (NULL: none) allows; NULL if it is none of ours, or expired.
// Takes the same time wherever a wrong one differs.
const struct bd_grant *bd_cookies_find(const struct bd_cookies *cookies, const char *header);

// Forgets those of grants that are revoked.
void bd_cookies_revoke(struct bd_cookies *cookies);

// Forgets the one that the header shows.
void bd_cookies_end(struct bd_cookies *cookies, const char *header);

#endif
