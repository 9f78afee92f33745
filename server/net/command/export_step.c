// SceneExport: a snapshot, the shown one or one of the journal's, as a .glb.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/hash.h"
#include "net/command/command_internal.h"
#include "net/command/revision_name.h"
#include "scene/gltf/gltf_write.h"
#include "scene/store/store_journal.h"

// --- the file -------------------------------------------------------------------------------

static enum bd_err write_file(struct bd_command *command)
{
    const uint64_t reply_bytes = command->steps.loop->serving->limits.reply_bytes;
    const uint64_t bytes_max = reply_bytes < BD_GLB_BYTES_MAX ? reply_bytes : BD_GLB_BYTES_MAX;
    command->notes = calloc(1, sizeof *command->notes);
    BD_ASSERT(command->notes);
    enum bd_err err = bd_gltf_write(command->scene, bytes_max, &command->encoded.bytes,
                                    command->notes, &command->steps.detail);
    if (err == BD_ERR_LIMIT && bytes_max == reply_bytes)
        snprintf(command->steps.detail.field, sizeof command->steps.detail.field, "reply_bytes");
    return err;
}

static Bounced__SceneExportReply *reply_of(const struct bd_command *command)
{
    Bounced__SceneExportReply *reply = malloc(sizeof *reply);
    char hex[BD_SHA256_HEX], hash[8 + BD_SHA256_HEX];
    BD_ASSERT(reply);
    bounced__scene_export_reply__init(reply);
    BD_SET(reply, revision, command->revision);
    if (command->transient) BD_SET(reply, transient, command->transient);
    bd_sha256_hex(command->scene->content_sha256, hex);
    snprintf(hash, sizeof hash, "sha256:%s", hex);
    reply->hash = bd_answer_text(hash);
    reply->flags = calloc(command->notes->count + (size_t)1, sizeof *reply->flags);
    BD_ASSERT(reply->flags);
    for (uint32_t i = 0; i < command->notes->count; i++)
        reply->flags[reply->n_flags++] = bd_answer_text(command->notes->text[i]);
    return reply;
}

static enum bd_err answer_file(struct bd_command *command)
{
    struct bd_answer answer =
        bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_EXPORT_REPLY, reply_of(command));
    answer.payload = command->encoded.bytes.data;
    answer.payload_bytes = command->encoded.bytes.size_bytes;
    answer.payload_type = "model/gltf-binary";
    command->encoded.bytes = (struct bd_bytes){0};
    command->answer = answer;
    return BD_ERR_OK;
}

// --- the past -------------------------------------------------------------------------------

static enum bd_err read_past(struct bd_command *command)
{
    const Bounced__SceneExport *request = command->envelope->scene_export;
    struct bd_journal *journal = command->steps.loop->serving->journal;
    enum bd_err err = BD_ERR_OK;
    command->revision = request->revision;
    if (request->name)
        err = bd_revision_find_name(journal, request->scene, request->name, &command->revision,
                                    &command->steps.detail);
    if (err) return err;
    return bd_store_read_revision(journal, request->scene, command->revision, &command->scene,
                                  &command->steps.detail);
}

// --- the way in -----------------------------------------------------------------------------

static enum bd_err check(const Bounced__SceneExport *request, struct bd_err_detail *detail)
{
    if (request->has_revision && request->name)
        return bd_err_set(detail, BD_ERR_USAGE, "revision",
                          "an export names a revision or a name: one of them");
    if (request->has_revision && request->revision == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "revision", "revisions begin with 1");
    return BD_ERR_OK;
}

#define FILE_STEPS                                                                                 \
    BD_STEP_BACKGROUND(write_file, "export", FILES), BD_STEP(loop, answer_file), BD_STEPS_END

static const struct bd_step past_steps[] = {BD_STEP(journal, read_past), FILE_STEPS};

static enum bd_err begin(struct bd_command *command)
{
    const Bounced__SceneExport *request = command->envelope->scene_export;
    const struct bd_store_entry *entry;
    enum bd_err err = check(request, &command->steps.detail);
    if (!err)
        err = bd_store_get(command->steps.loop->serving->store,
                           request->scene ? request->scene : "", &entry, &command->steps.detail);
    if (err) return err;
    if (request->has_revision || request->name) {
        bd_steps_branch(&command->steps, past_steps);
        return BD_ERR_OK;
    }
    command->scene = bd_scene_retain(entry->scene);
    command->revision = entry->revision;
    command->transient = entry->transient;
    return BD_ERR_OK;
}

static const struct bd_step steps[] = {BD_STEP(loop, begin), FILE_STEPS};

const struct bd_command_row bd_rows_of_exports[] = {
    {BD_BODY(SCENE_EXPORT), BD_OF_SCENE, .is_job = true, .http = "GET /v1/scenes/ID/export",
     .steps = steps},
    BD_ROWS_END,
};
