#include "net/command/frame_cache.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/frame_options.h"

#define CHAIN_COUNT 1024

struct entry {
    uint8_t key[BD_SHA256_BYTES];
    size_t reply_bytes, payload_bytes;
    const char *payload_type;
    struct entry *next_in_chain;
    struct entry *newer, *older;
    uint8_t bytes[]; // the reply, packed, and the payload
};

struct bd_frame_cache {
    const struct bd_limits *limits;
    uint64_t bytes;
    struct entry *newest, *oldest;
    struct entry *chains[CHAIN_COUNT];
};

struct bd_frame_cache *bd_frame_cache_create(const struct bd_limits *limits)
{
    struct bd_frame_cache *cache = calloc(1, sizeof *cache);
    BD_ASSERT(cache);
    cache->limits = limits;
    return cache;
}

// --- entries --------------------------------------------------------------------------------

static uint64_t bytes_of(const struct entry *entry)
{
    return sizeof *entry + entry->reply_bytes + entry->payload_bytes;
}

static struct entry **chain_of(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES])
{
    return &cache->chains[(key[0] | (unsigned)key[1] << 8) % CHAIN_COUNT];
}

// Where the entry hangs, or would.
static struct entry **find(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES])
{
    struct entry **at = chain_of(cache, key);
    while (*at && memcmp((*at)->key, key, BD_SHA256_BYTES) != 0) at = &(*at)->next_in_chain;
    return at;
}

static void leave_order(struct bd_frame_cache *cache, struct entry *entry)
{
    *(entry->newer ? &entry->newer->older : &cache->newest) = entry->older;
    *(entry->older ? &entry->older->newer : &cache->oldest) = entry->newer;
}

static void become_newest(struct bd_frame_cache *cache, struct entry *entry)
{
    entry->newer = NULL;
    entry->older = cache->newest;
    *(cache->newest ? &cache->newest->newer : &cache->oldest) = entry;
    cache->newest = entry;
}

static void drop(struct bd_frame_cache *cache, struct entry *entry)
{
    *find(cache, entry->key) = entry->next_in_chain;
    leave_order(cache, entry);
    cache->bytes -= bytes_of(entry);
    free(entry);
}

void bd_frame_cache_destroy(struct bd_frame_cache **cache)
{
    if (!*cache) return;
    while ((*cache)->oldest) drop(*cache, (*cache)->oldest);
    free(*cache);
    *cache = NULL;
}

// --- names ----------------------------------------------------------------------------------

bool bd_frame_cache_may_keep(const Bounced__FrameRequest *request)
{
    const bool is_report = request->encoding && strcmp(request->encoding, "none") == 0;
    return bd_frame_options_are_lasting(request) && !is_report;
}

// With its length in front, so that no two lists of texts read alike.
static void add_text(struct bd_sha256 *sha, const char *text)
{
    const uint64_t length = strlen(text);
    bd_sha256_update(sha, &length, sizeof length);
    bd_sha256_update(sha, text, length);
}

void bd_frame_cache_key(const Bounced__FrameRequest *request, const struct bd_store_entry *entry,
                        const struct bd_sched_stats *device, uint8_t key[BD_SHA256_BYTES])
{
    struct bd_sha256 *sha = bd_sha256_create();
    const uint64_t state[2] = {entry->revision, entry->transient};
    add_text(sha, BD_VERSION);
    add_text(sha, device->device_class);
    add_text(sha, device->device_name);
    add_text(sha, entry->id);
    bd_sha256_update(sha, state, sizeof state);
    bd_sha256_update(sha, entry->scene->content_sha256, sizeof entry->scene->content_sha256);
    // Every field that there is, those included that come later.
    const size_t size = bounced__frame_request__get_packed_size(request);
    uint8_t *packed = malloc(size + 1);
    BD_ASSERT(packed);
    bounced__frame_request__pack(request, packed);
    bd_sha256_update(sha, packed, size);
    free(packed);
    bd_sha256_finish(&sha, key);
}

// --- answers --------------------------------------------------------------------------------

static void set_text(char **field, const char *text)
{
    free(*field);
    *field = bd_answer_text(text);
}

// What the report says of the run that made the picture is not what this answer cost.
static void say_remembered(Bounced__Report *report)
{
    Bounced__ReportTime *time = report->time_ms;
    BD_SET(report, remembered, 1);
    for (size_t i = 0; i < report->n_passes; i++) {
        set_text(&report->passes[i]->state, "reused");
        BD_SET(report->passes[i], ms, 0);
    }
    if (!time) return;
    time->total = time->load = time->compile = time->gpu = time->readback = time->encode = 0;
    time->check = 0;
}

bool bd_frame_cache_get(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                        struct bd_answer *out)
{
    struct entry *entry = *find(cache, key);
    if (!entry) return false;
    leave_order(cache, entry);
    become_newest(cache, entry);
    Bounced__RenderReply *reply =
        bounced__render_reply__unpack(NULL, entry->reply_bytes, entry->bytes);
    BD_ASSERT(reply && reply->report);
    say_remembered(reply->report);
    *out = bd_answer_of(BOUNCED__ENVELOPE__BODY_RENDER_REPLY, reply);
    out->payload = malloc(entry->payload_bytes);
    BD_ASSERT(out->payload);
    memcpy(out->payload, entry->bytes + entry->reply_bytes, entry->payload_bytes);
    out->payload_bytes = entry->payload_bytes;
    out->payload_type = entry->payload_type;
    return true;
}

static bool is_whole(const Bounced__Report *report)
{
    return report && report->stopped && strcmp(report->stopped, "complete") == 0 &&
           report->nonfinite_pixels == 0;
}

bool bd_frame_cache_put(struct bd_frame_cache *cache, const uint8_t key[BD_SHA256_BYTES],
                        const struct bd_answer *answer)
{
    const Bounced__RenderReply *reply = answer->envelope->render_reply;
    const uint64_t most = cache->limits->frame_cache_bytes;
    if (!is_whole(reply->report) || answer->payload_bytes == 0) return false;
    const size_t reply_bytes = bounced__render_reply__get_packed_size(reply);
    const uint64_t size = sizeof(struct entry) + reply_bytes + answer->payload_bytes;
    // One that would take the place of most others is not worth theirs.
    if (size > most / 4) return true;
    struct entry *known = *find(cache, key);
    if (known) drop(cache, known); // two that were rendered at once
    while (cache->oldest && cache->bytes + size > most) drop(cache, cache->oldest);
    struct entry *entry = malloc(size);
    BD_ASSERT(entry);
    *entry = (struct entry){.reply_bytes = reply_bytes,
                            .payload_bytes = answer->payload_bytes,
                            .payload_type = answer->payload_type};
    memcpy(entry->key, key, BD_SHA256_BYTES);
    bounced__render_reply__pack(reply, entry->bytes);
    memcpy(entry->bytes + reply_bytes, answer->payload, answer->payload_bytes);
    struct entry **chain = chain_of(cache, key);
    entry->next_in_chain = *chain;
    *chain = entry;
    become_newest(cache, entry);
    cache->bytes += size;
    return true;
}
