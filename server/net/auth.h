// Tokens: who may ask at all, and what each of them may do.
//
// The token file holds one token a line; behind it, KEY=VALUE words, separated by spaces:
//
//     role=read|edit|admin  what it may do (default admin)
//     scenes=PREFIX         it sees scenes whose names begin so, and no others (default: all)
//     name=LABEL            for the log and as the owner of what it adds (default token-LINE)
//     max_scenes=N  max_bytes=N[K|M|G]  max_jobs=N    its quotas (default: the daemon's limits)
//
// Thread: read once at start, then any.

#ifndef BD_NET_AUTH_H
#define BD_NET_AUTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#define BD_GRANT_NAME_BYTES   64
#define BD_GRANT_PREFIX_BYTES 128

// Each may do what those before it may.
enum bd_role {
    BD_ROLE_READ,  // look: lists, frames, views, logs, exports of scenes that are there
    BD_ROLE_EDIT,  // and upload, add, edit and remove scenes
    BD_ROLE_ADMIN, // and see the daemon's own figures, and play journals
};

// What a token, or being trusted without one, allows.
struct bd_grant {
    char name[BD_GRANT_NAME_BYTES];
    enum bd_role role;
    char scene_prefix[BD_GRANT_PREFIX_BYTES]; // "": every scene
    uint64_t scenes_max; // that it added and that are held
    uint64_t bytes_max;  // of those scenes, as bd_scene_bytes counts them
    uint64_t jobs_max;   // under way at once
};

// For whoever needs no token: everything, without quotas of its own.
extern const struct bd_grant bd_grant_of_all;

struct bd_tokens;

// Empty lines and lines that begin with '#' do not count. A file without a token, a token shorter
// than 16 characters, one that is there twice, a word that is none of the above and a file that
// others may read are refused with the line's number: each looks like protection and is none.
// `path` NULL: no tokens.
BD_MUST_CHECK
enum bd_err bd_tokens_read(const char *path, struct bd_tokens **out, struct bd_fault *fault);
void bd_tokens_destroy(struct bd_tokens **tokens);

// True if tokens are asked for.
bool bd_tokens_needed(const struct bd_tokens *tokens);

// What `token` (NULL: none given) allows: bd_grant_of_all if none is needed, NULL if it is not one
// of ours. Lives as long as the tokens. Takes the same time whatever the token and wherever it
// differs: digests are compared, all of them.
const struct bd_grant *bd_tokens_find(const struct bd_tokens *tokens, const char *token);

// BD_ERR_FORBIDDEN, naming what the role is and what it would have to be.
BD_MUST_CHECK
enum bd_err bd_grant_check_role(const struct bd_grant *grant, enum bd_role needed,
                                struct bd_fault *fault);

// Whether it may know of a scene of this name. Others do not exist for it.
bool bd_grant_covers(const struct bd_grant *grant, const char *scene_name);

#endif
