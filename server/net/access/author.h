// Who an edit is by: the token's name or the user, who can be trusted, and behind a space the name
// that the client gives itself, which cannot. No token's name has a space in it.
//
// Thread: the event loop's.

#ifndef BD_NET_ACCESS_AUTHOR_H
#define BD_NET_ACCESS_AUTHOR_H

#include "base/err.h"
#include "net/access/auth.h"
#include "net/loop/client.h"
#include "scene/store/store.h"

#define BD_AUTHOR_BY_BYTES 64

// `by` NULL: the token or user alone. BD_ERR_USAGE and BD_ERR_LIMIT, naming `by`.
BD_MUST_CHECK
enum bd_err bd_author_make(const struct bd_grant *grant, const struct bd_client *client,
                           const char *by, char out[BD_EDIT_AUTHOR_BYTES],
                           struct bd_err_detail *detail);
// One that was made elsewhere, out of a journal; NULL: nobody. BD_ERR_USAGE, naming `author`.
BD_MUST_CHECK
enum bd_err bd_author_take(const char *author, char out[BD_EDIT_AUTHOR_BYTES],
                           struct bd_err_detail *detail);

#endif
