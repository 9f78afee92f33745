// Reads the token file.

#include <errno.h>
#include <grp.h>
#include <pwd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "base/assert.h"
#include "net/access/auth_internal.h"
#include "protocol/limits.h"

#define TOKEN_LENGTH_MIN   16
#define PEER_PREFIX_LENGTH 4 // of "uid:" and "gid:"

// --- words of a line ------------------------------------------------------------------------

static enum bd_err set_role(struct bd_grant *grant, const char *value, struct bd_err_detail *detail)
{
    for (size_t i = 0; i < sizeof bd_role_names / sizeof bd_role_names[0]; i++) {
        if (strcmp(value, bd_role_names[i]) != 0) continue;
        grant->role = (enum bd_role)i;
        return BD_ERR_OK;
    }
    return bd_err_set(detail, BD_ERR_USAGE, "role", "a role is read, edit or admin, not \"%.40s\"",
                      value);
}

static enum bd_err set_text(char *to, size_t size, const char *key, const char *value,
                            struct bd_err_detail *detail)
{
    if (value[0] == 0 || strlen(value) >= size)
        return bd_err_set(detail, BD_ERR_USAGE, key, "%s takes 1 to %zu characters", key, size - 1);
    snprintf(to, size, "%s", value);
    return BD_ERR_OK;
}

static enum bd_err set_prefix(struct bd_grant *grant, const char *value,
                              struct bd_err_detail *detail)
{
    return set_text(grant->scene_prefix, sizeof grant->scene_prefix, "scenes", value, detail);
}

static enum bd_err set_name(struct bd_grant *grant, const char *value, struct bd_err_detail *detail)
{
    return set_text(grant->name, sizeof grant->name, "name", value, detail);
}

static enum bd_err set_count(uint64_t *to, const char *key, const char *value,
                             struct bd_err_detail *detail)
{
    if (bd_limits_parse(value, to)) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, key, "%s takes a whole number, not \"%.40s\"", key,
                      value);
}

static enum bd_err set_scenes_max(struct bd_grant *grant, const char *value,
                                  struct bd_err_detail *detail)
{
    return set_count(&grant->scenes_max, "max_scenes", value, detail);
}

static enum bd_err set_bytes_max(struct bd_grant *grant, const char *value,
                                 struct bd_err_detail *detail)
{
    return set_count(&grant->bytes_max, "max_bytes", value, detail);
}

static enum bd_err set_jobs_max(struct bd_grant *grant, const char *value,
                                struct bd_err_detail *detail)
{
    return set_count(&grant->jobs_max, "max_jobs", value, detail);
}

static const struct {
    const char *key;
    enum bd_err (*set)(struct bd_grant *grant, const char *value, struct bd_err_detail *detail);
} words[] = {
    {"role", set_role},           {"scenes", set_prefix},
    {"name", set_name},           {"max_scenes", set_scenes_max},
    {"max_bytes", set_bytes_max}, {"max_jobs", set_jobs_max},
};

static enum bd_err set_word(struct bd_grant *grant, const char *word, struct bd_err_detail *detail)
{
    const char *equals = strchr(word, '=');
    for (size_t i = 0; equals && i < sizeof words / sizeof words[0]; i++)
        if (strlen(words[i].key) == (size_t)(equals - word) &&
            strncmp(words[i].key, word, (size_t)(equals - word)) == 0)
            return words[i].set(grant, equals + 1, detail);
    return bd_err_set(detail, BD_ERR_USAGE, "token-file",
                      "behind an entry stand role=, scenes=, name=, max_scenes=, max_bytes= and "
                      "max_jobs=, not \"%.40s\"",
                      word);
}

// --- entries --------------------------------------------------------------------------------

static struct bd_auth_entry *next_entry(struct bd_tokens *tokens, struct bd_err_detail *detail)
{
    if (tokens->count < BD_AUTH_ENTRIES_MAX) {
        // One that was refused is written over.
        struct bd_auth_entry **place = &tokens->entries[tokens->count];
        if (!*place) *place = malloc(sizeof **place);
        BD_ASSERT(*place);
        return *place;
    }
    (void)bd_err_set(detail, BD_ERR_USAGE, "token-file", "there are more than %d entries",
                     BD_AUTH_ENTRIES_MAX);
    return NULL;
}

static enum bd_err add_token(struct bd_tokens *tokens, const char *token,
                             struct bd_err_detail *detail)
{
    if (strlen(token) < TOKEN_LENGTH_MIN)
        return bd_err_set(detail, BD_ERR_USAGE, "token-file", "a token has at least %d characters",
                          TOKEN_LENGTH_MIN);
    struct bd_auth_entry *entry = next_entry(tokens, detail);
    if (!entry) return BD_ERR_USAGE;
    *entry = (struct bd_auth_entry){.kind = BD_AUTH_TOKEN};
    bd_sha256_of(token, strlen(token), entry->digest);
    if (bd_auth_find_digest(tokens, entry->digest))
        return bd_err_set(detail, BD_ERR_USAGE, "token-file", "this token is there already");
    tokens->count++;
    return BD_ERR_OK;
}

// Decimal digits, below the number that means "none".
static bool read_number(const char *text, id_t *out)
{
    char *end;
    errno = 0;
    unsigned long long number = strtoull(text, &end, 10);
    if (*text < '0' || *text > '9' || *end || errno || number >= (id_t)-1) return false;
    *out = (id_t)number;
    return true;
}

static bool find_user(const char *name, id_t *out)
{
    const struct passwd *user = getpwnam(name);
    if (user) *out = user->pw_uid;
    return user || read_number(name, out);
}

static bool find_group(const char *name, id_t *out)
{
    const struct group *group = getgrnam(name);
    if (group) *out = group->gr_gid;
    return group || read_number(name, out);
}

static bool has_peers(const struct bd_tokens *tokens, const struct bd_auth_entry *entry)
{
    for (size_t i = 0; i < tokens->count; i++)
        if (tokens->entries[i]->kind == entry->kind && tokens->entries[i]->id == entry->id)
            return true;
    return false;
}

// "uid:NAME", "uid:*" or "gid:NAME".
static enum bd_err add_peers(struct bd_tokens *tokens, const char *word,
                             struct bd_err_detail *detail)
{
    const char *name = word + PEER_PREFIX_LENGTH;
    bool is_user = word[0] == 'u' || word[0] == 'U';
    struct bd_auth_entry *entry = next_entry(tokens, detail);
    if (!entry) return BD_ERR_USAGE;
    *entry = (struct bd_auth_entry){.kind = is_user ? BD_AUTH_USER : BD_AUTH_GROUP};
    if (is_user && strcmp(name, "*") == 0)
        entry->kind = BD_AUTH_OTHERS;
    else if (!(is_user ? find_user(name, &entry->id) : find_group(name, &entry->id)))
        return bd_err_set(detail, BD_ERR_USAGE, is_user ? "uid" : "gid",
                          "this machine has no %s \"%.40s\"", is_user ? "user" : "group", name);
    if (has_peers(tokens, entry))
        return bd_err_set(detail, BD_ERR_USAGE, is_user ? "uid" : "gid",
                          "\"%.40s\" is there already", word);
    tokens->count++;
    return BD_ERR_OK;
}

static bool is_peers(const char *word)
{
    return strncasecmp(word, "uid:", PEER_PREFIX_LENGTH) == 0 ||
           strncasecmp(word, "gid:", PEER_PREFIX_LENGTH) == 0;
}

static void begin_grant(struct bd_grant *grant, const char *word, unsigned number)
{
    *grant = bd_grant_of_all;
    if (is_peers(word))
        snprintf(grant->name, sizeof grant->name, "%s", word);
    else
        snprintf(grant->name, sizeof grant->name, "token-%u", number);
    grant->is_token = !is_peers(word);
}

// --- the file -------------------------------------------------------------------------------

static enum bd_err read_line(struct bd_tokens *tokens, char *line, unsigned number,
                             struct bd_err_detail *detail)
{
    char *rest;
    const char *word = strtok_r(line, " \t\r\n", &rest);
    if (!word || word[0] == '#') return BD_ERR_OK;
    enum bd_err err =
        is_peers(word) ? add_peers(tokens, word, detail) : add_token(tokens, word, detail);
    if (err) return err;
    struct bd_grant *grant = &tokens->entries[tokens->count - 1]->grant;
    begin_grant(grant, word, number);
    const enum bd_auth_kind kind = tokens->entries[tokens->count - 1]->kind;
    grant->is_shared = kind == BD_AUTH_GROUP || kind == BD_AUTH_OTHERS;
    while (!err && (word = strtok_r(NULL, " \t\r\n", &rest))) err = set_word(grant, word, detail);
    return err;
}

// The error of a line, with where it stands.
static enum bd_err at_line(unsigned number, struct bd_err_detail *detail)
{
    if (!detail) return BD_ERR_USAGE;
    struct bd_err_detail inner = *detail;
    return bd_err_set(detail, inner.err, inner.field, "line %u: %s", number, inner.message);
}

static enum bd_err read_lines(FILE *file, struct bd_tokens *tokens, struct bd_err_detail *detail)
{
    char line[1024];
    for (unsigned number = 1; fgets(line, sizeof line, file); number++) {
        if (!strchr(line, '\n') && !feof(file))
            return bd_err_set(detail, BD_ERR_USAGE, "token-file",
                              "line %u is longer than %zu characters", number, sizeof line - 2);
        if (read_line(tokens, line, number, detail)) return at_line(number, detail);
    }
    if (tokens->count == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "token-file", "the token file holds no entry");
    return BD_ERR_OK;
}

static enum bd_err read_file(const char *path, struct bd_tokens *tokens,
                             struct bd_err_detail *detail)
{
    FILE *file = fopen(path, "re");
    struct stat info;
    enum bd_err err;
    if (!file || fstat(fileno(file), &info) < 0)
        err = bd_err_set(detail, BD_ERR_IO, "token-file", "%s: %s", path, strerror(errno));
    else if (info.st_mode & (S_IRWXG | S_IRWXO))
        err = bd_err_set(detail, BD_ERR_USAGE, "token-file",
                         "%s can be read by others: chmod 600 it", path);
    else
        err = read_lines(file, tokens, detail);
    if (file) fclose(file);
    return err;
}

enum bd_err bd_tokens_read(const char *path, struct bd_tokens **out, struct bd_err_detail *detail)
{
    struct bd_tokens *tokens = calloc(1, sizeof *tokens);
    BD_ASSERT(tokens);
    enum bd_err err = path ? read_file(path, tokens, detail) : BD_ERR_OK;
    if (err)
        bd_tokens_destroy(&tokens);
    else
        *out = tokens;
    return err;
}

// --- again ----------------------------------------------------------------------------------

// Who has the one has the other, and may do the same: quotas alone may differ.
static bool is_same(const struct bd_auth_entry *a, const struct bd_auth_entry *b)
{
    return a->kind == b->kind && a->id == b->id &&
           memcmp(a->digest, b->digest, sizeof a->digest) == 0 && a->grant.role == b->grant.role &&
           strcmp(a->grant.name, b->grant.name) == 0 &&
           strcmp(a->grant.scene_prefix, b->grant.scene_prefix) == 0;
}

// Commands, sessions and cookies point at grants: the entry that was there takes the place of the
// one that was read.
static void keep_entry(struct bd_tokens *old, struct bd_tokens *read, size_t place)
{
    for (size_t i = 0; i < old->count; i++) {
        struct bd_auth_entry *entry = old->entries[i];
        if (!entry || !is_same(entry, read->entries[place])) continue;
        // Its quotas alone: the rest is the same, and others may be reading it.
        const struct bd_grant *fresh = &read->entries[place]->grant;
        entry->grant.scenes_max = fresh->scenes_max;
        entry->grant.bytes_max = fresh->bytes_max;
        entry->grant.jobs_max = fresh->jobs_max;
        free(read->entries[place]);
        read->entries[place] = entry;
        old->entries[i] = NULL;
        return;
    }
}

static void revoke_rest(struct bd_tokens *tokens)
{
    for (size_t i = 0; i < tokens->count; i++) {
        struct bd_auth_entry *entry = tokens->entries[i];
        if (!entry) continue;
        entry->grant.is_revoked = true;
        entry->next = tokens->revoked;
        tokens->revoked = entry;
    }
}

enum bd_err bd_tokens_reload(struct bd_tokens *tokens, const char *path,
                             struct bd_err_detail *detail)
{
    struct bd_tokens *read;
    enum bd_err err = bd_tokens_read(path, &read, detail);
    if (err) return err;
    for (size_t i = 0; i < read->count; i++) keep_entry(tokens, read, i);
    revoke_rest(tokens);
    read->revoked = tokens->revoked;
    *tokens = *read;
    free(read);
    return BD_ERR_OK;
}
