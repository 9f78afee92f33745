#include "net/auth.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/assert.h"
#include "base/hash.h"
#include "protocol/limits.h"

#define TOKEN_LENGTH_MIN 16
#define TOKEN_COUNT_MAX  256

struct bd_tokens {
    size_t count;
    uint8_t digests[TOKEN_COUNT_MAX][BD_SHA256_BYTES];
    struct bd_grant grants[TOKEN_COUNT_MAX];
};

static const char *const role_names[] = {"read", "edit", "admin"};

const struct bd_grant bd_grant_of_all = {
    .name = "local",
    .role = BD_ROLE_ADMIN,
    .scenes_max = UINT64_MAX,
    .bytes_max = UINT64_MAX,
    .jobs_max = UINT64_MAX,
};

// --- words of a line ------------------------------------------------------------------------

static enum bd_err set_role(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    for (size_t i = 0; i < sizeof role_names / sizeof role_names[0]; i++) {
        if (strcmp(value, role_names[i]) != 0) continue;
        grant->role = (enum bd_role)i;
        return BD_ERR_OK;
    }
    return bd_fault_set(fault, BD_ERR_USAGE, "role", "a role is read, edit or admin, not \"%.40s\"",
                        value);
}

static enum bd_err set_text(char *to, size_t size, const char *key, const char *value,
                            struct bd_fault *fault)
{
    if (value[0] == 0 || strlen(value) >= size)
        return bd_fault_set(fault, BD_ERR_USAGE, key, "%s takes 1 to %zu characters", key,
                            size - 1);
    snprintf(to, size, "%s", value);
    return BD_ERR_OK;
}

static enum bd_err set_prefix(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    return set_text(grant->scene_prefix, sizeof grant->scene_prefix, "scenes", value, fault);
}

static enum bd_err set_name(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    return set_text(grant->name, sizeof grant->name, "name", value, fault);
}

static enum bd_err set_count(uint64_t *to, const char *key, const char *value,
                             struct bd_fault *fault)
{
    if (bd_limits_parse(value, to)) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_USAGE, key, "%s takes a whole number, not \"%.40s\"", key,
                        value);
}

static enum bd_err set_scenes_max(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    return set_count(&grant->scenes_max, "max_scenes", value, fault);
}

static enum bd_err set_bytes_max(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    return set_count(&grant->bytes_max, "max_bytes", value, fault);
}

static enum bd_err set_jobs_max(struct bd_grant *grant, const char *value, struct bd_fault *fault)
{
    return set_count(&grant->jobs_max, "max_jobs", value, fault);
}

static const struct {
    const char *key;
    enum bd_err (*set)(struct bd_grant *grant, const char *value, struct bd_fault *fault);
} words[] = {
    {"role", set_role},           {"scenes", set_prefix},
    {"name", set_name},           {"max_scenes", set_scenes_max},
    {"max_bytes", set_bytes_max}, {"max_jobs", set_jobs_max},
};

static enum bd_err set_word(struct bd_grant *grant, const char *word, struct bd_fault *fault)
{
    const char *equals = strchr(word, '=');
    for (size_t i = 0; equals && i < sizeof words / sizeof words[0]; i++)
        if (strlen(words[i].key) == (size_t)(equals - word) &&
            strncmp(words[i].key, word, (size_t)(equals - word)) == 0)
            return words[i].set(grant, equals + 1, fault);
    return bd_fault_set(fault, BD_ERR_USAGE, "token-file",
                        "behind a token stand role=, scenes=, name=, max_scenes=, max_bytes= and "
                        "max_jobs=, not \"%.40s\"",
                        word);
}

// --- the file -------------------------------------------------------------------------------

static int find_digest(const struct bd_tokens *tokens, const uint8_t digest[BD_SHA256_BYTES])
{
    int found = -1;
    for (size_t i = 0; i < tokens->count; i++) {
        uint8_t difference = 0;
        for (size_t j = 0; j < BD_SHA256_BYTES; j++)
            difference |= digest[j] ^ tokens->digests[i][j];
        if (difference == 0) found = (int)i;
    }
    return found;
}

static enum bd_err add_token(struct bd_tokens *tokens, const char *token, struct bd_fault *fault)
{
    if (strlen(token) < TOKEN_LENGTH_MIN)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "a token has at least %d characters",
                            TOKEN_LENGTH_MIN);
    if (tokens->count == TOKEN_COUNT_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "there are more than %d tokens",
                            TOKEN_COUNT_MAX);
    uint8_t *digest = tokens->digests[tokens->count];
    bd_sha256_of(token, strlen(token), digest);
    if (find_digest(tokens, digest) >= 0)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "this token is there already");
    tokens->count++;
    return BD_ERR_OK;
}

static enum bd_err read_line(struct bd_tokens *tokens, char *line, unsigned number,
                             struct bd_fault *fault)
{
    char *rest;
    const char *word = strtok_r(line, " \t\r\n", &rest);
    if (!word || word[0] == '#') return BD_ERR_OK;
    struct bd_grant *grant = &tokens->grants[tokens->count < TOKEN_COUNT_MAX ? tokens->count : 0];
    enum bd_err err = add_token(tokens, word, fault);
    if (err) return err;
    *grant = bd_grant_of_all;
    snprintf(grant->name, sizeof grant->name, "token-%u", number);
    while (!err && (word = strtok_r(NULL, " \t\r\n", &rest))) err = set_word(grant, word, fault);
    return err;
}

// The fault of a line, with where it stands.
static enum bd_err at_line(unsigned number, struct bd_fault *fault)
{
    if (!fault) return BD_ERR_USAGE;
    struct bd_fault inner = *fault;
    return bd_fault_set(fault, inner.err, inner.field, "line %u: %s", number, inner.message);
}

static enum bd_err read_lines(FILE *file, struct bd_tokens *tokens, struct bd_fault *fault)
{
    char line[1024];
    for (unsigned number = 1; fgets(line, sizeof line, file); number++) {
        if (!strchr(line, '\n') && !feof(file))
            return bd_fault_set(fault, BD_ERR_USAGE, "token-file",
                                "line %u is longer than %zu characters", number, sizeof line - 2);
        if (read_line(tokens, line, number, fault)) return at_line(number, fault);
    }
    if (tokens->count == 0)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "the token file holds no token");
    return BD_ERR_OK;
}

enum bd_err bd_tokens_read(const char *path, struct bd_tokens **out, struct bd_fault *fault)
{
    struct bd_tokens *tokens = calloc(1, sizeof *tokens);
    BD_ASSERT(tokens);
    enum bd_err err = BD_ERR_OK;
    if (path) {
        FILE *file = fopen(path, "re");
        struct stat info;
        if (!file || fstat(fileno(file), &info) < 0)
            err = bd_fault_set(fault, BD_ERR_IO, "token-file", "%s: %s", path, strerror(errno));
        else if (info.st_mode & (S_IRWXG | S_IRWXO))
            err = bd_fault_set(fault, BD_ERR_USAGE, "token-file",
                               "%s can be read by others: chmod 600 it", path);
        else
            err = read_lines(file, tokens, fault);
        if (file) fclose(file);
    }
    if (err)
        free(tokens);
    else
        *out = tokens;
    return err;
}

void bd_tokens_destroy(struct bd_tokens **tokens)
{
    free(*tokens);
    *tokens = NULL;
}

// --- asking ---------------------------------------------------------------------------------

bool bd_tokens_needed(const struct bd_tokens *tokens)
{
    return tokens->count > 0;
}

const struct bd_grant *bd_tokens_find(const struct bd_tokens *tokens, const char *token)
{
    if (tokens->count == 0) return &bd_grant_of_all;
    if (!token) return NULL;
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(token, strlen(token), digest);
    int found = find_digest(tokens, digest);
    return found >= 0 ? &tokens->grants[found] : NULL;
}

enum bd_err bd_grant_check_role(const struct bd_grant *grant, enum bd_role needed,
                                struct bd_fault *fault)
{
    if (grant->role >= needed) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_FORBIDDEN, "role",
                        "the token's role is %s, and this asks for %s", role_names[grant->role],
                        role_names[needed]);
}

bool bd_grant_covers(const struct bd_grant *grant, const char *scene_name)
{
    return strncmp(scene_name, grant->scene_prefix, strlen(grant->scene_prefix)) == 0;
}
