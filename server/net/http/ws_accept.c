#include "net/http/ws_accept.h"

#include <openssl/evp.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"

#define KEY_LENGTH   24 // base64 of 16 bytes
#define SHA1_BYTES   20
#define BASE64_CHARS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"

bool bd_http_list_has(const char *list, const char *word)
{
    size_t wanted = strlen(word);
    while (list && *list) {
        list += strspn(list, ", \t");
        size_t length = strcspn(list, ",");
        size_t used = length;
        while (used > 0 && strchr(" \t", list[used - 1])) used--;
        if (used == wanted && strncasecmp(list, word, used) == 0) return true;
        list += length;
    }
    return false;
}

static bool is_key(const char *key)
{
    return key && strlen(key) == KEY_LENGTH && strspn(key, BASE64_CHARS) == KEY_LENGTH - 2 &&
           strcmp(key + KEY_LENGTH - 2, "==") == 0;
}

enum bd_err bd_ws_check_handshake(const struct bd_http_head *head,
                                  struct bd_http_refusal *refusal)
{
    const char *version = head->values[BD_HTTP_WS_VERSION];
    *refusal = (struct bd_http_refusal){.status = 400};
    if (!bd_http_list_has(head->values[BD_HTTP_UPGRADE], "websocket") ||
        !bd_http_list_has(head->values[BD_HTTP_CONNECTION], "upgrade")) {
        refusal->status = 426;
        return bd_err_set(&refusal->detail, BD_ERR_USAGE, "Upgrade",
                          "this address speaks WebSocket: Upgrade: websocket");
    }
    if (!version || strcmp(version, "13") != 0) {
        refusal->status = 426;
        return bd_err_set(&refusal->detail, BD_ERR_UNSUPPORTED, "Sec-WebSocket-Version",
                          "version 13 of WebSocket is spoken here");
    }
    if (head->seen[BD_HTTP_WS_KEY] > 1 || !is_key(head->values[BD_HTTP_WS_KEY]))
        return bd_err_set(&refusal->detail, BD_ERR_USAGE, "Sec-WebSocket-Key",
                          "a key is the base64 of 16 bytes");
    if (!bd_http_list_has(head->values[BD_HTTP_WS_PROTOCOL], BD_WS_PROTOCOL))
        return bd_err_set(&refusal->detail, BD_ERR_UNSUPPORTED, "Sec-WebSocket-Protocol",
                          "the subprotocol spoken here is " BD_WS_PROTOCOL);
    return BD_ERR_OK;
}

void bd_ws_accept(const char *key, char out[BD_WS_ACCEPT_BYTES])
{
    char text[64];
    uint8_t digest[SHA1_BYTES];
    size_t length = strlen(key);
    BD_ASSERT_CMP(length, ==, KEY_LENGTH);
    memcpy(text, key, length);
    memcpy(text + length, "258EAFA5-E914-47DA-95CA-C5AB0DC85B11", 36); // RFC 6455, 1.3
    int hashed = EVP_Digest(text, length + 36, digest, NULL, EVP_sha1(), NULL);
    BD_ASSERT(hashed == 1);
    int written = EVP_EncodeBlock((uint8_t *)out, digest, sizeof digest);
    BD_ASSERT_CMP(written, ==, BD_WS_ACCEPT_BYTES - 1);
}
