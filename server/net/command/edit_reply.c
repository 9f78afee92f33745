#include "net/command/edit_reply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static char *hash_text(const struct bd_scene *scene)
{
    char hex[BD_SHA256_HEX], text[8 + BD_SHA256_HEX];
    bd_sha256_hex(scene->content_sha256, hex);
    snprintf(text, sizeof text, "sha256:%s", hex);
    return bd_answer_text(text);
}

static void add_flags(Bounced__EditReply *reply, const struct bd_edit_flags *flags)
{
    if (flags->count == 0) return;
    reply->flags = calloc(flags->count, sizeof *reply->flags);
    BD_ASSERT(reply->flags);
    for (uint32_t i = 0; i < flags->count; i++)
        reply->flags[reply->n_flags++] = bd_answer_text(flags->text[i]);
}

static void add_ids(Bounced__EditReply *reply, const struct bd_edit_work *work)
{
    if (work->op_count == 0) return;
    reply->ids = malloc(work->op_count * sizeof *reply->ids);
    BD_ASSERT(reply->ids);
    memcpy(reply->ids, work->ids, work->op_count * sizeof *reply->ids);
    reply->n_ids = work->op_count;
}

static Bounced__EditReply *make(const struct bd_scene *scene, uint64_t revision, uint64_t transient,
                                const struct bd_edit_work *work)
{
    Bounced__EditReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__edit_reply__init(reply);
    BD_SET(reply, revision, revision);
    if (transient) BD_SET(reply, transient, transient);
    reply->hash = hash_text(scene);
    add_ids(reply, work);
    add_flags(reply, &work->flags);
    return reply;
}

struct bd_answer bd_edit_reply_of_batch(struct bd_batch *batch, const struct bd_edit_work *work)
{
    Bounced__EditReply *reply = make(batch->after, batch->revision, 0, work);
    if (batch->author[0]) reply->author = bd_answer_text(batch->author);
    if (batch->of) BD_SET(reply, of, batch->of);
    batch->answer_bytes = bounced__edit_reply__get_packed_size(reply);
    batch->answer = malloc(batch->answer_bytes + 1);
    BD_ASSERT(batch->answer);
    bounced__edit_reply__pack(reply, batch->answer);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_EDIT_REPLY, reply);
}

struct bd_answer bd_edit_reply_of_entry(const struct bd_store_entry *entry,
                                        const struct bd_edit_work *work)
{
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_EDIT_REPLY,
                        make(entry->scene, entry->revision, entry->transient, work));
}

struct bd_answer bd_edit_reply_of_trial(const struct bd_scene *after,
                                        const struct bd_edit_work *work)
{
    Bounced__EditReply *reply = make(after, 0, 0, work);
    reply->has_revision = 0;
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_EDIT_REPLY, reply);
}

struct bd_answer bd_edit_reply_again(const void *bytes, size_t size)
{
    Bounced__EditReply *reply = bounced__edit_reply__unpack(NULL, size, bytes);
    BD_ASSERT(reply); // of our own making, behind a checksum
    BD_SET(reply, repeated_id, 1);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_EDIT_REPLY, reply);
}
