// Sums over the fields of records. XXH3 is a fixed function: what one version wrote, the next
// reads.

#include <string.h>

#include "scene/journal/journal_internal.h"

static uint64_t add_number(uint64_t sum, uint64_t value)
{
    return bd_hash64(&value, sizeof value, sum);
}

// With its length, so that nothing can move from one field to the next.
static uint64_t add_bytes(uint64_t sum, const void *data, size_t size)
{
    return bd_hash64(size ? data : "", size, add_number(sum, size));
}

static uint64_t add_text(uint64_t sum, const char *text)
{
    return add_bytes(sum, text, text ? strlen(text) : 0);
}

static uint64_t add_digests(uint64_t sum, const struct bd_journal_digests *list)
{
    return add_bytes(sum, list->sha256, (size_t)list->count * BD_SHA256_BYTES);
}

uint64_t bd_check_scene(const struct bd_journal_scene *scene)
{
    uint64_t sum = add_text(add_text(add_text(0, "scene"), scene->scene), scene->name);
    sum = add_text(sum, scene->owner);
    return add_number(add_number(sum, scene->added_ms), scene->revision);
}

uint64_t bd_check_state(const struct bd_journal_state *state)
{
    uint64_t sum = add_bytes(add_text(0, "state"), state->identity, BD_IDENTITY_BYTES);
    return add_number(sum, state->sequence);
}

uint64_t bd_check_name(int64_t scene, const char *name, uint64_t revision)
{
    uint64_t sum = add_number(add_text(0, "name"), (uint64_t)scene);
    return add_number(add_text(sum, name), revision);
}

uint64_t bd_check_snapshot(int64_t scene, const struct bd_journal_snapshot *snapshot)
{
    uint64_t sum = add_number(add_text(0, "snapshot"), (uint64_t)scene);
    sum = add_bytes(add_number(sum, snapshot->revision), snapshot->sha256, BD_SHA256_BYTES);
    sum = add_bytes(sum, snapshot->index.data, snapshot->index.size);
    return add_digests(sum, &snapshot->content);
}

uint64_t bd_check_edit_payload(const struct bd_journal_edit *edit)
{
    uint64_t sum = add_bytes(0, edit->answer.data, edit->answer.size);
    sum = add_bytes(sum, edit->forward.data, edit->forward.size);
    sum = add_bytes(sum, edit->inverse.data, edit->inverse.size);
    return add_digests(add_digests(sum, &edit->forward_content), &edit->inverse_content);
}

uint64_t bd_check_edit(int64_t scene, const struct bd_journal_edit *edit, uint64_t payload_check)
{
    uint64_t sum = add_number(add_text(0, "edit"), (uint64_t)scene);
    sum = add_number(add_number(sum, edit->revision), edit->of);
    sum = add_text(add_text(add_text(sum, edit->kind), edit->client_edit_id), edit->message);
    sum = add_bytes(add_number(sum, edit->time_ms), edit->snapshot_sha256, BD_SHA256_BYTES);
    sum = add_number(add_bytes(sum, edit->summary.data, edit->summary.size), payload_check);
    // Format 1 had no authors, and its sums stand.
    return edit->author && edit->author[0] ? add_text(sum, edit->author) : sum;
}
