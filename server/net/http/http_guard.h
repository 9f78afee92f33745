// Who may ask: the rules that keep web pages, strangers and confused proxies out, before anything
// else is looked at.
//
// Thread: any.

#ifndef BD_NET_HTTP_HTTP_GUARD_H
#define BD_NET_HTTP_HTTP_GUARD_H

#include <stdbool.h>

#include "net/access/auth.h"
#include "net/access/cookie.h"
#include "net/http/http_head.h"

struct bd_http_guard {
    const char *const *public_names; // up to a NULL
    const char *local_host;          // the connection's own address, numeric, without a port
    const struct bd_tokens *tokens;
    const struct bd_cookies *cookies;
    bool needs_token;  // does this path?
    bool wants_bearer; // in place of which no cookie will do
    // A cookie goes with whatever page asks: what changes something by one needs our own Origin.
    bool changes;
};

// A refusal and the status to send; `status` 0: the one that the error has.
struct bd_http_refusal {
    int status;
    struct bd_err_detail detail;
};

// What the head's credentials allow: bd_grant_of_all where none are needed, NULL where there are
// none or wrong ones; `*has_token`: there is a token in it, right or wrong.
const struct bd_grant *bd_http_guard_grant(const struct bd_http_guard *guard,
                                           const struct bd_http_head *head, bool *has_token);

// The head alone: no header twice that must be there once, no Transfer-Encoding (411; with a
// length 400), a Host that is us and an Origin that is none or our own (403), a token where one is
// needed (401; a cookie will do, with our Origin where something is changed, 403), no Expect but
// 100-continue (417). `*grant`: what who asks may do.
BD_MUST_CHECK
enum bd_err bd_http_guard_check(const struct bd_http_guard *guard, const struct bd_http_head *head,
                                const struct bd_grant **grant, struct bd_http_refusal *refusal);

// A request that changes something needs a content type that a web page cannot send unasked:
// JSON, protobuf, octet-stream; and for a scene model/gltf-binary, model/gltf+json, or multipart
// with a Bounced-Client header (415).
BD_MUST_CHECK
enum bd_err bd_http_guard_content_type(const struct bd_http_head *head, bool is_scene,
                                       struct bd_http_refusal *refusal);

// Whether If-None-Match (NULL: not there) names what we would send: "*", or the tag among others,
// weak or strong. `etag` with its quotes.
bool bd_http_etag_is_held(const char *header, const char *etag);

// True if the header is that media type, whatever its parameters.
bool bd_http_media_is(const char *value, const char *type);

#endif
