// What the token file says, in memory: shared by who reads it and who asks.

#ifndef BD_NET_ACCESS_AUTH_INTERNAL_H
#define BD_NET_ACCESS_AUTH_INTERNAL_H

#include "base/hash.h"
#include "net/access/auth.h"

#define BD_AUTH_ENTRIES_MAX 256

enum bd_auth_kind {
    BD_AUTH_TOKEN,
    BD_AUTH_USER,
    BD_AUTH_GROUP,
    BD_AUTH_OTHERS, // uid:*
};

struct bd_auth_entry {
    enum bd_auth_kind kind;
    uint8_t digest[BD_SHA256_BYTES]; // of a token
    id_t id;                         // of a user or a group
    struct bd_grant grant;
    struct bd_auth_entry *next; // of those that are revoked
};

struct bd_tokens {
    size_t count;
    struct bd_auth_entry *entries[BD_AUTH_ENTRIES_MAX]; // in the order of their lines
    struct bd_auth_entry *revoked;                      // of files before
};

// The names of roles, by enum bd_role.
extern const char *const bd_role_names[BD_ROLE_ADMIN + 1];

// The entry of that token; NULL if there is none.
const struct bd_auth_entry *bd_auth_find_digest(const struct bd_tokens *tokens,
                                                const uint8_t digest[BD_SHA256_BYTES]);

#endif
