// Browser sessions: a token for a cookie, and the cookie's end.

#include <stdio.h>
#include <strings.h>

#include "net/cookie.h"
#include "net/http_internal.h"

void bd_http_begin_session(struct bd_http *http)
{
    char value[BD_COOKIE_BYTES];
    const char *origin = http->head.values[BD_HTTP_ORIGIN];
    bool is_secure = origin && strncasecmp(origin, "https://", 8) == 0;
    struct bd_net *net = http->conn.net;
    bd_cookies_issue(net->cookies, http->grant, value);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=%s; Path=/; HttpOnly; SameSite=Strict; Max-Age=%llu%s", value,
             (unsigned long long)net->options.limits.cookie_seconds, is_secure ? "; Secure" : "");
    bd_http_send_text(http, 204, NULL, NULL);
}

void bd_http_end_session(struct bd_http *http)
{
    bd_cookies_end(http->conn.net->cookies, http->head.values[BD_HTTP_COOKIE]);
    snprintf(http->set_cookie, sizeof http->set_cookie,
             BD_COOKIE_NAME "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
    bd_http_send_text(http, 204, NULL, NULL);
}
