#include "net/http/http_guard.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

static enum bd_err check_once(const struct bd_http_head *head, struct bd_http_refusal *refusal)
{
    static const struct {
        enum bd_http_header header;
        const char *name;
    } once[] = {{BD_HTTP_HOST, "Host"},
                {BD_HTTP_ORIGIN, "Origin"},
                {BD_HTTP_CONTENT_LENGTH, "Content-Length"},
                {BD_HTTP_CONTENT_TYPE, "Content-Type"},
                {BD_HTTP_AUTHORIZATION, "Authorization"}};
    for (size_t i = 0; i < sizeof once / sizeof once[0]; i++)
        if (head->seen[once[i].header] > 1)
            return bd_err_set(&refusal->detail, BD_ERR_USAGE, once[i].name,
                              "the header %s is there more than once", once[i].name);
    return BD_ERR_OK;
}

// Where a message ends must never be a matter of opinion.
static enum bd_err check_length(const struct bd_http_head *head, struct bd_http_refusal *refusal)
{
    if (!head->seen[BD_HTTP_TRANSFER_ENCODING]) return BD_ERR_OK;
    refusal->status = head->seen[BD_HTTP_CONTENT_LENGTH] ? 400 : 411;
    return bd_err_set(&refusal->detail, BD_ERR_USAGE, "Transfer-Encoding",
                      "a body comes with Content-Length, not with Transfer-Encoding");
}

static size_t host_length(const char *host)
{
    const char *bracket = host[0] == '[' ? strchr(host, ']') : NULL;
    return bracket ? (size_t)(bracket + 1 - host) : strcspn(host, ":");
}

static bool host_is(const char *host, size_t length, const char *name)
{
    return strlen(name) == length && strncasecmp(host, name, length) == 0;
}

static bool host_is_ours(const struct bd_http_guard *guard, const char *host)
{
    char local[80];
    snprintf(local, sizeof local, strchr(guard->local_host, ':') ? "[%s]" : "%s",
             guard->local_host);
    size_t length = host_length(host);
    // Behind the name: nothing, or a port of digits.
    const char *port = host + length;
    if (*port == ':') port += 1 + strspn(port + 1, "0123456789");
    if (*port) return false;
    if (host_is(host, length, local) || host_is(host, length, "localhost")) return true;
    for (const char *const *name = guard->public_names; *name; name++)
        if (host_is(host, length, *name)) return true;
    return false;
}

// A page of another site names that site here, and a page made of a file or a sandbox says null.
static bool origin_is_ours(const char *origin, const char *host)
{
    if (strncasecmp(origin, "http://", 7) == 0) return strcasecmp(origin + 7, host) == 0;
    return strncasecmp(origin, "https://", 8) == 0 && strcasecmp(origin + 8, host) == 0;
}

static enum bd_err check_site(const struct bd_http_guard *guard, const struct bd_http_head *head,
                              struct bd_http_refusal *refusal)
{
    const char *host = head->values[BD_HTTP_HOST];
    const char *origin = head->values[BD_HTTP_ORIGIN];
    if (!host) return bd_err_set(&refusal->detail, BD_ERR_USAGE, "Host", "a request needs a Host");
    if (!host_is_ours(guard, host))
        return bd_err_set(&refusal->detail, BD_ERR_FORBIDDEN, "Host",
                          "this server is not called \"%.80s\" (see --public-name)", host);
    if (origin && !origin_is_ours(origin, host))
        return bd_err_set(&refusal->detail, BD_ERR_FORBIDDEN, "Origin",
                          "pages of \"%.80s\" may not ask this server", origin);
    return BD_ERR_OK;
}

// An Origin that is there has been found to be ours.
static enum bd_err check_cookie_use(const struct bd_http_guard *guard,
                                    const struct bd_http_head *head,
                                    struct bd_http_refusal *refusal)
{
    if (!guard->changes || head->values[BD_HTTP_ORIGIN]) return BD_ERR_OK;
    return bd_err_set(&refusal->detail, BD_ERR_FORBIDDEN, "Origin",
                      "a request that changes something by cookie needs its page's Origin");
}

static const char *find_token(const struct bd_http_head *head)
{
    const char *value = head->values[BD_HTTP_AUTHORIZATION];
    return value && strncasecmp(value, "Bearer ", 7) == 0 ? value + 7 : NULL;
}

const struct bd_grant *bd_http_guard_grant(const struct bd_http_guard *guard,
                                           const struct bd_http_head *head, bool *has_token)
{
    const char *token = find_token(head);
    *has_token = token != NULL;
    if (!guard->needs_token) return &bd_grant_of_all;
    const struct bd_grant *grant = bd_tokens_find(guard->tokens, token);
    if (!grant && !token && !guard->wants_bearer)
        grant = bd_cookies_find(guard->cookies, head->values[BD_HTTP_COOKIE]);
    return grant;
}

static enum bd_err check_token(const struct bd_http_guard *guard, const struct bd_http_head *head,
                               const struct bd_grant **grant, struct bd_http_refusal *refusal)
{
    bool token;
    *grant = bd_http_guard_grant(guard, head, &token);
    const bool is_by_cookie = !token && guard->needs_token && bd_tokens_needed(guard->tokens);
    if (*grant) return is_by_cookie ? check_cookie_use(guard, head, refusal) : BD_ERR_OK;
    return bd_err_set(&refusal->detail, BD_ERR_UNAUTHORIZED, "Authorization",
                      token ? "the token is not one of ours"
                            : "a token is needed: Authorization: Bearer TOKEN");
}

static enum bd_err check_expect(const struct bd_http_head *head, struct bd_http_refusal *refusal)
{
    const char *expect = head->values[BD_HTTP_EXPECT];
    if (!expect || strcasecmp(expect, "100-continue") == 0) return BD_ERR_OK;
    refusal->status = 417;
    return bd_err_set(&refusal->detail, BD_ERR_UNSUPPORTED, "Expect",
                      "only 100-continue can be expected");
}

enum bd_err bd_http_guard_check(const struct bd_http_guard *guard, const struct bd_http_head *head,
                                const struct bd_grant **grant, struct bd_http_refusal *refusal)
{
    *refusal = (struct bd_http_refusal){0};
    *grant = &bd_grant_of_all;
    enum bd_err err = check_once(head, refusal);
    if (!err) err = check_length(head, refusal);
    if (!err) err = check_site(guard, head, refusal);
    if (!err) err = check_token(guard, head, grant, refusal);
    if (!err) err = check_expect(head, refusal);
    return err;
}

bool bd_http_etag_is_held(const char *header, const char *etag)
{
    const size_t length = strlen(etag);
    const char *at = header ? header : "";
    at += strspn(at, " \t");
    if (*at == '*') return at[1 + strspn(at + 1, " \t")] == 0;
    for (; *at; at += strspn(at, ", \t")) {
        if (strncmp(at, "W/", 2) == 0) at += 2;
        if (*at != '"') return false; // no list of tags
        const char *end = strchr(at + 1, '"');
        if (!end) return false;
        if ((size_t)(end + 1 - at) == length && strncmp(at, etag, length) == 0) return true;
        at = end + 1;
    }
    return false;
}

bool bd_http_media_is(const char *value, const char *type)
{
    size_t length = strlen(type);
    if (!value || strncasecmp(value, type, length) != 0) return false;
    return value[length] == 0 || strchr("; \t", value[length]) != NULL;
}

enum bd_err bd_http_guard_content_type(const struct bd_http_head *head, bool is_scene,
                                       struct bd_http_refusal *refusal)
{
    static const char *const always[] = {"application/json",         "application/x-protobuf",
                                         "application/octet-stream", "model/gltf-binary",
                                         "model/gltf+json",          NULL};
    const char *value = head->values[BD_HTTP_CONTENT_TYPE];
    *refusal = (struct bd_http_refusal){.status = 415};
    for (size_t i = 0; always[i]; i++)
        if ((is_scene || i < 3) && bd_http_media_is(value, always[i])) return BD_ERR_OK;
    if (!is_scene || !bd_http_media_is(value, "multipart/form-data"))
        return bd_err_set(&refusal->detail, BD_ERR_UNSUPPORTED, "Content-Type",
                          "\"%.60s\" is no content type that this request takes",
                          value ? value : "");
    if (head->values[BD_HTTP_BOUNCED_CLIENT]) return BD_ERR_OK;
    return bd_err_set(&refusal->detail, BD_ERR_UNSUPPORTED, "Bounced-Client",
                      "multipart/form-data needs the header Bounced-Client, with any value");
}
