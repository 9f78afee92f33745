// Who may ask at all, and what each of them may do: tokens, and users of this machine.
//
// The token file holds one entry a line:
//
//     TOKEN                       whoever shows it, on whatever transport
//     uid:NAME|NUMBER             a user of this machine, on a Unix socket
//     gid:NAME|NUMBER             whoever is in that group, on a Unix socket
//     uid:*                       every other user of this machine, on a Unix socket
//
// and behind it, KEY=VALUE words, separated by spaces:
//
//     role=read|edit|admin  what it may do (default admin)
//     scenes=PREFIX         it sees scenes whose names begin so, and no others (default: all)
//     name=LABEL            for the log, as the owner of what it adds, and as the client that
//                           limits are for: two tokens of one name are one (default token-LINE,
//                           or the entry as it is written)
//     max_scenes=N  max_bytes=N[K|M|G]  max_jobs=N    its quotas (default: the daemon's limits);
//                           max_bytes is for its scenes, and once more for its blobs
//
// A quota is the line's: those whom a gid: line names share it. On a Unix socket the user's own
// line counts, then the daemon's own user and root may do everything, then the first group's line
// of which the user is a member, then uid:*. Others need a token there, and are refused where there
// is none.
//
// Thread: read at start and again at SIGHUP, by the loop; looked at by any.

#ifndef BD_NET_ACCESS_AUTH_H
#define BD_NET_ACCESS_AUTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "base/err.h"

#define BD_GRANT_NAME_BYTES   64
#define BD_GRANT_PREFIX_BYTES 128

// Each may do what those before it may.
enum bd_role {
    BD_ROLE_READ,  // look: lists, frames, views, logs, exports of scenes that are there
    BD_ROLE_EDIT,  // and upload, add, edit and remove scenes
    BD_ROLE_ADMIN, // and see the daemon's own figures, and play journals
};

// What a line of the token file, or being trusted without one, allows.
struct bd_grant {
    char name[BD_GRANT_NAME_BYTES];
    bool is_token;   // it is one client, by its name, wherever it is shown
    bool is_shared;  // of a line of many users: gid: or uid:*
    bool is_revoked; // a later token file has it no more, or with other rights
    enum bd_role role;
    char scene_prefix[BD_GRANT_PREFIX_BYTES]; // "": every scene
    uint64_t scenes_max;                      // that it added and that are held
    uint64_t bytes_max;                       // of those scenes, and of its blobs
    uint64_t jobs_max;                        // under way at once
};

// For whoever needs no token: everything, without quotas of its own.
extern const struct bd_grant bd_grant_of_all;

struct bd_blobs;
struct bd_peer;
struct bd_tokens;

// Empty lines and lines that begin with '#' do not count. A file without an entry, a token shorter
// than 16 characters, an entry that is there twice, a user or group that this machine does not
// have, a word that is none of the above and a file that others may read are refused with the
// line's number: each looks like protection and is none. `path` NULL: no tokens.
BD_MUST_CHECK
enum bd_err bd_tokens_read(const char *path, struct bd_tokens **out, struct bd_err_detail *detail);
void bd_tokens_destroy(struct bd_tokens **tokens);

// Reads the file again. What it names as before keeps its grants; grants that are gone, or whose
// name, role or prefix is another, are revoked, and stay in memory for who still looks at them. On
// an error nothing is changed.
BD_MUST_CHECK
enum bd_err bd_tokens_reload(struct bd_tokens *tokens, const char *path,
                             struct bd_err_detail *detail);

// True if tokens are asked for: there is a token file. One of users alone lets nobody in by HTTP
// or TCP.
bool bd_tokens_needed(const struct bd_tokens *tokens);

// True if the file names users or groups.
bool bd_tokens_name_users(const struct bd_tokens *tokens);

// What `token` (NULL: none given) allows: bd_grant_of_all if none is needed, NULL if it is not one
// of ours. Lives as long as the tokens. Takes the same time whatever the token and wherever it
// differs: digests are compared, all of them.
const struct bd_grant *bd_tokens_find(const struct bd_tokens *tokens, const char *token);

// What a user of this machine may do without a token, by the rule above; `own` is the daemon's
// user. NULL: nothing. Lives as long as the tokens.
const struct bd_grant *bd_tokens_find_peer(const struct bd_tokens *tokens,
                                           const struct bd_peer *peer, uid_t own);

// BD_ERR_FORBIDDEN, naming what the role is and what it would have to be.
BD_MUST_CHECK
enum bd_err bd_grant_check_role(const struct bd_grant *grant, enum bd_role needed,
                                struct bd_err_detail *detail);

// Whether it may know of a scene of this name. Others do not exist for it.
bool bd_grant_covers(const struct bd_grant *grant, const char *scene_name);

// Whose blobs somebody finds, and whose those are that he sends: a line of the token file finds
// what was sent by that line, and all others' too if it sees every scene; whoever needs no token
// finds all and is nobody. Any thread.
struct bd_blobs *bd_grant_blobs(struct bd_blobs *all, const struct bd_grant *grant);

// Its name where it is a token; NULL: a user's, or none (`grant` may be NULL).
static inline const char *bd_grant_token(const struct bd_grant *grant)
{
    return grant && grant->is_token ? grant->name : NULL;
}

#endif
