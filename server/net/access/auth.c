#include "net/access/auth.h"

#include <stdlib.h>
#include <string.h>

#include "net/access/auth_internal.h"
#include "net/loop/peer.h"
#include "scene/blobs/blobs.h"

const char *const bd_role_names[] = {"read", "edit", "admin"};

const struct bd_grant bd_grant_of_all = {
    .name = "local",
    .role = BD_ROLE_ADMIN,
    .scenes_max = UINT64_MAX,
    .bytes_max = UINT64_MAX,
    .jobs_max = UINT64_MAX,
};

void bd_tokens_destroy(struct bd_tokens **tokens)
{
    if (!*tokens) return;
    // One that was refused lies behind the last that counts.
    for (size_t i = 0; i < BD_AUTH_ENTRIES_MAX; i++) free((*tokens)->entries[i]);
    while ((*tokens)->revoked) {
        struct bd_auth_entry *entry = (*tokens)->revoked;
        (*tokens)->revoked = entry->next;
        free(entry);
    }
    free(*tokens);
    *tokens = NULL;
}

bool bd_tokens_needed(const struct bd_tokens *tokens)
{
    return tokens->count > 0;
}

bool bd_tokens_name_users(const struct bd_tokens *tokens)
{
    for (size_t i = 0; i < tokens->count; i++)
        if (tokens->entries[i]->kind != BD_AUTH_TOKEN) return true;
    return false;
}

// --- by token -------------------------------------------------------------------------------

const struct bd_auth_entry *bd_auth_find_digest(const struct bd_tokens *tokens,
                                                const uint8_t digest[BD_SHA256_BYTES])
{
    const struct bd_auth_entry *found = NULL;
    for (size_t i = 0; i < tokens->count; i++) {
        const struct bd_auth_entry *entry = tokens->entries[i];
        uint8_t difference = entry->kind != BD_AUTH_TOKEN;
        for (size_t j = 0; j < BD_SHA256_BYTES; j++) difference |= digest[j] ^ entry->digest[j];
        if (difference == 0) found = entry;
    }
    return found;
}

const struct bd_grant *bd_tokens_find(const struct bd_tokens *tokens, const char *token)
{
    if (tokens->count == 0) return &bd_grant_of_all;
    if (!token) return NULL;
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(token, strlen(token), digest);
    const struct bd_auth_entry *found = bd_auth_find_digest(tokens, digest);
    return found ? &found->grant : NULL;
}

// --- by user --------------------------------------------------------------------------------

static bool names(const struct bd_auth_entry *entry, enum bd_auth_kind kind,
                  const struct bd_peer *peer)
{
    if (entry->kind != kind) return false;
    switch (kind) {
    case BD_AUTH_USER:
        return entry->id == peer->uid;
    case BD_AUTH_GROUP:
        return bd_peer_is_in(peer, entry->id);
    case BD_AUTH_OTHERS:
        return true;
    case BD_AUTH_TOKEN:
        break;
    }
    return false;
}

static const struct bd_grant *find(const struct bd_tokens *tokens, enum bd_auth_kind kind,
                                   const struct bd_peer *peer)
{
    for (size_t i = 0; i < tokens->count; i++)
        if (names(tokens->entries[i], kind, peer)) return &tokens->entries[i]->grant;
    return NULL;
}

const struct bd_grant *bd_tokens_find_peer(const struct bd_tokens *tokens,
                                           const struct bd_peer *peer, uid_t own)
{
    const struct bd_grant *grant = find(tokens, BD_AUTH_USER, peer);
    if (!grant && (peer->uid == own || peer->uid == 0)) grant = &bd_grant_of_all;
    if (!grant) grant = find(tokens, BD_AUTH_GROUP, peer);
    if (!grant) grant = find(tokens, BD_AUTH_OTHERS, peer);
    return grant;
}

// --- what it allows -------------------------------------------------------------------------

enum bd_err bd_grant_check_role(const struct bd_grant *grant, enum bd_role needed,
                                struct bd_err_detail *detail)
{
    if (grant->role >= needed) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_FORBIDDEN, "role",
                      "the role of \"%s\" is %s, and this asks for %s", grant->name,
                      bd_role_names[grant->role], bd_role_names[needed]);
}

bool bd_grant_covers(const struct bd_grant *grant, const char *scene_name)
{
    return strncmp(scene_name, grant->scene_prefix, strlen(grant->scene_prefix)) == 0;
}

// --- blobs ---------------------------------------------------------------------------------------

struct bd_blobs *bd_grant_blobs(struct bd_blobs *all, const struct bd_grant *grant)
{
    const bool is_anyone = grant == &bd_grant_of_all;
    return bd_blobs_of(all, is_anyone ? "" : grant->name, grant->scene_prefix[0] == 0);
}
