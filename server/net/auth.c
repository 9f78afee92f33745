#include "net/auth.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/assert.h"
#include "base/hash.h"

#define TOKEN_LENGTH_MIN 16
#define TOKEN_COUNT_MAX  256

struct bd_tokens {
    size_t count;
    uint8_t digests[TOKEN_COUNT_MAX][BD_SHA256_BYTES];
};

static enum bd_err add_token(struct bd_tokens *tokens, const char *token, struct bd_fault *fault)
{
    if (strlen(token) < TOKEN_LENGTH_MIN)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "a token has at least %d characters",
                            TOKEN_LENGTH_MIN);
    if (tokens->count == TOKEN_COUNT_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "there are more than %d tokens",
                            TOKEN_COUNT_MAX);
    bd_sha256_of(token, strlen(token), tokens->digests[tokens->count++]);
    return BD_ERR_OK;
}

static enum bd_err read_lines(FILE *file, struct bd_tokens *tokens, struct bd_fault *fault)
{
    char line[512];
    while (fgets(line, sizeof line, file)) {
        if (!strchr(line, '\n') && !feof(file))
            return bd_fault_set(fault, BD_ERR_USAGE, "token-file", "a line is longer than %zu",
                                sizeof line - 2);
        line[strcspn(line, "\r\n")] = 0;
        if (line[0] == 0 || line[0] == '#') continue;
        enum bd_err err = add_token(tokens, line, fault);
        if (err) return err;
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

bool bd_tokens_needed(const struct bd_tokens *tokens)
{
    return tokens->count > 0;
}

bool bd_tokens_accept(const struct bd_tokens *tokens, const char *token)
{
    if (tokens->count == 0) return true;
    if (!token) return false;
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(token, strlen(token), digest);
    bool accepted = false;
    for (size_t i = 0; i < tokens->count; i++) {
        uint8_t difference = 0;
        for (size_t j = 0; j < BD_SHA256_BYTES; j++)
            difference |= digest[j] ^ tokens->digests[i][j];
        accepted |= difference == 0;
    }
    return accepted;
}
