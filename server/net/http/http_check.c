// Whether a request is taken, by its head alone.

#include "net/http/http_internal.h"
#include "net/http/ws_accept.h"

bool bd_http_has_long_body(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_RENDER ||
           (http->target.route == BD_HTTP_ROUTE_BLOB && http->method == BD_HTTP_PUT);
}

static enum bd_err check_blob_name(struct bd_http *http)
{
    if (http->target.route != BD_HTTP_ROUTE_BLOB || bd_blob_name_is_valid(http->target.id))
        return BD_ERR_OK;
    return bd_fault_set(&http->refusal.fault, BD_ERR_USAGE, "path",
                        "a blob's name is sha256: and 64 lower-case hexadecimal digits");
}

static enum bd_err check_body_size(struct bd_http *http)
{
    const struct bd_limits *limits = &http->conn.loop->serving->limits;
    bool is_long = bd_http_has_long_body(http);
    uint64_t most = is_long ? limits->blob_bytes : limits->message_bytes;
    uint64_t size = http->parser.content_length;
    const char *name = is_long ? "blob_bytes" : "message_bytes";
    if (size <= most) return BD_ERR_OK;
    return bd_fault_set(&http->refusal.fault, BD_ERR_LIMIT, name,
                        "a body of %llu bytes is above the limit %s of %llu",
                        (unsigned long long)size, name, (unsigned long long)most);
}

// Who asks, and how often.
static enum bd_err check_rate(struct bd_http *http, const struct bd_http_guard *guard)
{
    struct bd_loop *loop = http->conn.loop;
    bool has_token;
    const struct bd_grant *grant = bd_http_guard_grant(guard, &http->head, &has_token);
    enum bd_err err =
        bd_conn_identify(&http->conn, grant, bd_grant_token(grant), &http->refusal.fault);
    if (err) return err;
    if (!grant && has_token)
        return bd_client_take_failed_login(loop->clients, http->conn.origin, &http->refusal.fault);
    if (http->target.route == BD_HTTP_ROUTE_HEALTH || http->target.route == BD_HTTP_ROUTE_READY)
        return BD_ERR_OK;
    return bd_client_take_request(loop->clients, http->conn.client, &http->refusal.fault);
}

static enum bd_err check_version(struct bd_http *http)
{
    if (http->parser.http_major == 1 && http->parser.http_minor <= 1) return BD_ERR_OK;
    http->refusal.status = 505;
    http->keep_alive = false;
    return bd_fault_set(&http->refusal.fault, BD_ERR_UNSUPPORTED, "", "HTTP 1.1 is spoken here");
}

static bool is_login(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_SESSION && http->method == BD_HTTP_POST;
}

// A socket may change anything once it is open.
static bool changes_something(const struct bd_http *http)
{
    return http->target.route == BD_HTTP_ROUTE_SOCKET ||
           (http->method != BD_HTTP_GET && http->method != BD_HTTP_HEAD);
}

// The viewer's files are the same for everyone; its page brings the token, and cannot before it is
// loaded.
static bool needs_token(enum bd_http_route route)
{
    return route != BD_HTTP_ROUTE_HEALTH && route != BD_HTTP_ROUTE_VIEWER;
}

// What is no command says here whom it is for; an upload is refused before its body is kept.
static enum bd_role role_for(const struct bd_http *http)
{
    if (bd_http_has_long_body(http)) return BD_ROLE_EDIT;
    return http->target.route == BD_HTTP_ROUTE_METRICS ? BD_ROLE_ADMIN : BD_ROLE_READ;
}

enum bd_err bd_http_check_head(struct bd_http *http)
{
    const struct bd_access *access = http->web->sessions->access;
    struct bd_http_guard guard = {.public_names = http->web->public_names,
                                  .local_host = http->local_host,
                                  .tokens = access->tokens,
                                  .cookies = access->cookies,
                                  .needs_token = needs_token(http->target.route),
                                  .wants_bearer = is_login(http),
                                  .changes = changes_something(http)};
    http->refusal = (struct bd_http_refusal){0};
    // Before all that may be wrong with it: a flood of nonsense empties the bucket like any other.
    enum bd_err err = check_rate(http, &guard);
    if (!err) err = check_version(http);
    if (!err) err = bd_http_guard_check(&guard, &http->head, &http->grant, &http->refusal);
    if (!err) err = bd_http_route_check(&http->target, http->method, &http->refusal);
    if (!err && (http->method == BD_HTTP_POST || http->method == BD_HTTP_PUT))
        err = bd_http_guard_content_type(&http->head, http->target.route == BD_HTTP_ROUTE_RENDER,
                                         &http->refusal);
    if (!err && http->target.route == BD_HTTP_ROUTE_SOCKET)
        err = bd_ws_check_handshake(&http->head, &http->refusal);
    http->refusal.status = err ? http->refusal.status : 0;
    if (!err) err = bd_grant_check_role(http->grant, role_for(http), &http->refusal.fault);
    if (!err) err = check_blob_name(http);
    if (!err) err = check_body_size(http);
    http->conn.is_known |= !err && guard.needs_token;
    return err;
}
