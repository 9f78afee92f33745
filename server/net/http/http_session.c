// Browser sessions: a token for a cookie, and the cookie's end.

#include <stdio.h>
#include <strings.h>

#include "net/access/cookie.h"
#include "net/http/http_guard.h"
#include "net/http/http_internal.h"
#include "protocol/json.h"

// Nothing is asked for but the session itself: a name in the body would be passed over.
static bool has_good_body(struct bd_http *http)
{
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    struct bd_http_refusal refusal = {0};
    ProtobufCMessage *message;
    if (http->body_bytes == 0 || !bd_http_media_is(type, "application/json")) return true;
    if (bd_json_text_to_message((const char *)http->body, http->body_bytes,
                                &bounced__done__descriptor, &message, &refusal.fault)) {
        bd_http_send_fault(http, &refusal);
        return false;
    }
    protobuf_c_message_free_unpacked(message, NULL);
    return true;
}

void bd_http_begin_session(struct bd_http *http)
{
    if (!has_good_body(http)) return;
    char value[BD_COOKIE_BYTES];
    const char *origin = http->head.values[BD_HTTP_ORIGIN];
    bool is_secure = origin && strncasecmp(origin, "https://", 8) == 0;
    bd_cookies_issue(http->web->sessions->access->cookies, http->grant, value);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=%s; Path=/; HttpOnly; SameSite=Strict; Max-Age=%llu%s", value,
             (unsigned long long)http->conn.loop->serving->limits.cookie_seconds,
             is_secure ? "; Secure" : "");
    bd_http_send_text(http, 204, NULL, NULL);
}

void bd_http_end_session(struct bd_http *http)
{
    bd_cookies_end(http->web->sessions->access->cookies, http->head.values[BD_HTTP_COOKIE]);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
    bd_http_send_text(http, 204, NULL, NULL);
}
