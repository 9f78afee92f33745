// What lets clients in: the tokens of the token file, and cookies of browser sessions.
//
// Owned by net.c. Thread: the event loop's.

#ifndef BD_NET_ACCESS_ACCESS_H
#define BD_NET_ACCESS_ACCESS_H

struct bd_conn;
struct bd_cookies;
struct bd_grant;
struct bd_tokens;

struct bd_access {
    struct bd_tokens *tokens;
    struct bd_cookies *cookies;
};

// Of the user of this machine at the other end; NULL: none, or none that may.
const struct bd_grant *bd_access_of_user(const struct bd_access *access,
                                         const struct bd_conn *conn);

#endif
