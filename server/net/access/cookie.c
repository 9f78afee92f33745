#include "net/access/cookie.h"

#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"

struct entry {
    uint8_t digest[BD_SHA256_BYTES];
    uint64_t until_ns; // 0 = free
    const struct bd_grant *grant;
};

struct bd_cookies {
    const struct bd_limits *limits;
    uint64_t count; // as the limit was when the daemon started
    struct entry *entries;
};

struct bd_cookies *bd_cookies_create(const struct bd_limits *limits)
{
    struct bd_cookies *cookies = calloc(1, sizeof *cookies);
    BD_ASSERT(cookies);
    cookies->limits = limits;
    cookies->count = limits->cookies;
    cookies->entries = calloc(cookies->count, sizeof *cookies->entries);
    BD_ASSERT(cookies->entries);
    return cookies;
}

void bd_cookies_destroy(struct bd_cookies **cookies)
{
    if (!*cookies) return;
    free((*cookies)->entries);
    free(*cookies);
    *cookies = NULL;
}

// A free place, or the one that expires first.
static struct entry *choose_place(struct bd_cookies *cookies)
{
    struct entry *place = &cookies->entries[0];
    for (uint64_t i = 1; i < cookies->count; i++)
        if (cookies->entries[i].until_ns < place->until_ns) place = &cookies->entries[i];
    return place;
}

void bd_cookies_issue(struct bd_cookies *cookies, const struct bd_grant *grant,
                      char out[BD_COOKIE_BYTES])
{
    uint8_t random[BD_SHA256_BYTES];
    ssize_t size = getrandom(random, sizeof random, 0);
    BD_ASSERT_CMP(size, ==, (ssize_t)sizeof random);
    bd_sha256_hex(random, out);
    struct entry *place = choose_place(cookies);
    bd_sha256_of(out, BD_COOKIE_BYTES - 1, place->digest);
    place->grant = grant;
    place->until_ns = bd_clock_ns() + cookies->limits->cookie_seconds * 1000000000u;
}

// The value of our cookie in a header: "a=b; bounced_session=HEX". False if it is not there.
static bool find_value(const char *header, char out[BD_COOKIE_BYTES])
{
    static const char name[] = BD_COOKIE_NAME "=";
    for (const char *at = header; at && *at;) {
        at += strspn(at, "; \t,");
        size_t length = strcspn(at, ";,");
        const char *value = at + sizeof name - 1;
        if (length == sizeof name - 1 + BD_COOKIE_BYTES - 1 &&
            strncmp(at, name, sizeof name - 1) == 0) {
            memcpy(out, value, BD_COOKIE_BYTES - 1);
            out[BD_COOKIE_BYTES - 1] = 0;
            return true;
        }
        at += length;
    }
    return false;
}

static struct entry *find(const struct bd_cookies *cookies, const char *header)
{
    char value[BD_COOKIE_BYTES];
    uint8_t digest[BD_SHA256_BYTES];
    if (!find_value(header, value)) return NULL;
    bd_sha256_of(value, BD_COOKIE_BYTES - 1, digest);
    uint64_t now_ns = bd_clock_ns();
    struct entry *found = NULL;
    for (uint64_t i = 0; i < cookies->count; i++) {
        struct entry *entry = &cookies->entries[i];
        uint8_t difference = entry->until_ns <= now_ns;
        for (size_t j = 0; j < BD_SHA256_BYTES; j++) difference |= digest[j] ^ entry->digest[j];
        if (difference == 0) found = entry;
    }
    return found;
}

const struct bd_grant *bd_cookies_find(const struct bd_cookies *cookies, const char *header)
{
    const struct entry *entry = find(cookies, header);
    return entry ? entry->grant : NULL;
}

void bd_cookies_end(struct bd_cookies *cookies, const char *header)
{
    struct entry *entry = find(cookies, header);
    if (entry) *entry = (struct entry){0};
}

void bd_cookies_revoke(struct bd_cookies *cookies)
{
    for (uint64_t i = 0; i < cookies->count; i++) {
        struct entry *entry = &cookies->entries[i];
        if (entry->until_ns > 0 && entry->grant->is_revoked) *entry = (struct entry){0};
    }
}
