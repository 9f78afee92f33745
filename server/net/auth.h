// Tokens: who may ask at all.
//
// Thread: read once at start, then any.

#ifndef BD_NET_AUTH_H
#define BD_NET_AUTH_H

#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"

struct bd_tokens;

// Reads one token a line; empty lines and lines that begin with '#' do not count. A file without a
// token, a token shorter than 16 characters and a file that others may read are refused: each
// looks like protection and is none. `path` NULL: no tokens.
BD_MUST_CHECK
enum bd_err bd_tokens_read(const char *path, struct bd_tokens **out, struct bd_fault *fault);
void bd_tokens_destroy(struct bd_tokens **tokens);

// True if tokens are asked for.
bool bd_tokens_needed(const struct bd_tokens *tokens);

// True if `token` (NULL: none given) is one of them, or none is needed. Takes the same time
// whatever the token and wherever it differs: digests are compared, all of them.
bool bd_tokens_accept(const struct bd_tokens *tokens, const char *token);

#endif
