// Requests about scenes: lists, one scene with its objects, its log; and those by which scenes come
// and go, which are answered once that is on the disk.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/command_internal.h"
#include "net/command/command_rights.h"
#include "net/wire/scene_objects.h"

#define LOG_LIMIT_DEFAULT 100
#define LOG_LIMIT_MAX     10000

// --- what is there --------------------------------------------------------------------------

static enum bd_err list_scenes(struct bd_command *command)
{
    const struct bd_store *store = command->steps.loop->serving->store;
    Bounced__SceneListReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__scene_list_reply__init(reply);
    reply->scenes = calloc(bd_store_count(store) + 1, sizeof *reply->scenes);
    BD_ASSERT(reply->scenes);
    const struct bd_store_entry *entry;
    for (uint32_t i = 0; (entry = bd_store_at(store, i)); i++)
        if (bd_grant_covers(command->grant, entry->name))
            reply->scenes[reply->n_scenes++] = bd_scene_message(entry);
    command->answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_LIST_REPLY, reply);
    return BD_ERR_OK;
}

static enum bd_err get_scene(struct bd_command *command)
{
    const Bounced__SceneGet *request = command->envelope->scene_get;
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(command->steps.loop->serving->store,
                                   request->id ? request->id : "", &entry, &command->steps.detail);
    if (err) return err;
    command->answer = bd_answer_scene(entry);
    if (request->objects) bd_scene_objects_fill(command->answer.envelope->scene, entry->scene);
    return BD_ERR_OK;
}

// --- the log --------------------------------------------------------------------------------

// Entries of the summary, one a line.
static void add_changes(Bounced__LogEntry *entry, const struct bd_journal_bytes *summary)
{
    const char *at = summary->data, *end = at + summary->size;
    size_t lines = 0;
    for (const char *p = at; p < end; p++) lines += *p == '\n';
    entry->changes = calloc(lines + 1, sizeof *entry->changes);
    BD_ASSERT(entry->changes);
    while (at < end) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        size_t length = stop ? (size_t)(stop - at) : (size_t)(end - at);
        entry->changes[entry->n_changes++] = strndup(at, length);
        at += length + 1;
    }
}

static void add_entry(void *user, const struct bd_journal_edit *edit)
{
    Bounced__SceneLogReply *reply = user;
    Bounced__LogEntry *entry = malloc(sizeof *entry);
    char hex[BD_SHA256_HEX], hash[8 + BD_SHA256_HEX];
    BD_ASSERT(entry);
    bounced__log_entry__init(entry);
    BD_SET(entry, revision, edit->revision);
    BD_SET(entry, time_ms, edit->time_ms);
    if (edit->of) BD_SET(entry, of, edit->of);
    entry->kind = bd_answer_text(edit->kind);
    if (edit->client_edit_id[0]) entry->client_edit_id = bd_answer_text(edit->client_edit_id);
    if (edit->message[0]) entry->message = bd_answer_text(edit->message);
    if (edit->author[0]) entry->author = bd_answer_text(edit->author);
    bd_sha256_hex(edit->snapshot_sha256, hex);
    snprintf(hash, sizeof hash, "sha256:%s", hex);
    entry->hash = bd_answer_text(hash);
    add_changes(entry, &edit->summary);
    reply->entries[reply->n_entries++] = entry;
}

static void add_name(void *user, const char *name, uint64_t revision)
{
    Bounced__SceneLogReply *reply = user;
    for (size_t i = 0; i < reply->n_entries; i++) {
        Bounced__LogEntry *entry = reply->entries[i];
        if (entry->revision != revision) continue;
        entry->names = realloc(entry->names, (entry->n_names + 1) * sizeof *entry->names);
        BD_ASSERT(entry->names);
        entry->names[entry->n_names++] = bd_answer_text(name);
    }
}

static uint32_t log_limit(const Bounced__SceneLog *request)
{
    return request->has_limit ? request->limit : LOG_LIMIT_DEFAULT;
}

static enum bd_err read_log(struct bd_command *command)
{
    const Bounced__SceneLog *request = command->envelope->scene_log;
    struct bd_journal *journal = command->steps.loop->serving->journal;
    Bounced__SceneLogReply *reply = malloc(sizeof *reply);
    uint64_t oldest = 0;
    BD_ASSERT(reply);
    bounced__scene_log_reply__init(reply);
    reply->entries = calloc(log_limit(request), sizeof *reply->entries);
    BD_ASSERT(reply->entries);
    command->answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE_LOG_REPLY, reply);
    enum bd_err err =
        bd_journal_each_edit(journal, request->scene, request->after, log_limit(request), add_entry,
                             reply, &command->steps.detail);
    if (!err)
        err =
            bd_journal_each_name(journal, request->scene, add_name, reply, &command->steps.detail);
    if (!err) err = bd_journal_oldest(journal, request->scene, &oldest, &command->steps.detail);
    BD_SET(reply, oldest, oldest);
    return err;
}

static enum bd_err check_log(struct bd_command *command)
{
    const Bounced__SceneLog *request = command->envelope->scene_log;
    const struct bd_store_entry *entry;
    const uint32_t limit = log_limit(request);
    enum bd_err err =
        bd_store_get(command->steps.loop->serving->store, request->scene ? request->scene : "",
                     &entry, &command->steps.detail);
    if (!err && (limit == 0 || limit > LOG_LIMIT_MAX))
        err = bd_err_set(&command->steps.detail, BD_ERR_USAGE, "limit", "limit goes from 1 to %d",
                         LOG_LIMIT_MAX);
    return err;
}

// --- scenes that come and go -----------------------------------------------------------------

static const char *name_of(const struct bd_command *command)
{
    const Bounced__Envelope *envelope = command->envelope;
    const char *name = command->row->body == BOUNCED__ENVELOPE__BODY_SCENE_ADD
                           ? envelope->scene_add->name
                           : envelope->scene_replay->name;
    return name ? name : "";
}

static enum bd_err stage_scene(struct bd_command *command)
{
    const char *name = name_of(command);
    enum bd_err err = bd_command_check_new_scene(command, name, &command->steps.detail);
    if (!err)
        err = bd_store_stage_add_at(command->steps.loop->serving->store, command->scene, name,
                                    command->grant->name, command->revision ? command->revision : 1,
                                    &command->place.batch, &command->steps.detail);
    if (!err && command->time_ms) command->place.batch->time_ms = command->time_ms;
    return err;
}

static enum bd_err tell_scene(struct bd_command *command)
{
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(command->steps.loop->serving->store, command->place.scene_id,
                                   &entry, &command->steps.detail);
    if (!err) command->answer = bd_answer_scene(entry);
    return err;
}

static enum bd_err stage_removal(struct bd_command *command)
{
    const char *id = command->envelope->scene_remove->id;
    enum bd_err err = bd_store_stage_remove(command->steps.loop->serving->store, id ? id : "",
                                            &command->place.batch, &command->steps.detail);
    if (!err) command->answer = bd_answer_done();
    return err;
}

#define STAGE_STEPS                                                                                \
    BD_STEP(loop, stage_scene), BD_STEP(disk, NULL), BD_STEP(loop, tell_scene), BD_STEPS_END

// --- the rows -------------------------------------------------------------------------------

const struct bd_step bd_steps_stage_scene[] = {STAGE_STEPS};

static const struct bd_step add[] = {
    BD_STEP(loop, bd_command_check_files),
    BD_STEP_BACKGROUND(bd_command_import, "import", FILES),
    STAGE_STEPS,
};
static const struct bd_step list[] = {BD_STEP(loop, list_scenes), BD_STEPS_END};
static const struct bd_step get[] = {BD_STEP(loop, get_scene), BD_STEPS_END};
static const struct bd_step remove_steps[] = {BD_STEP(loop, stage_removal), BD_STEP(disk, NULL),
                                              BD_STEPS_END};
static const struct bd_step log_steps[] = {BD_STEP(loop, check_log), BD_STEP(journal, read_log),
                                           BD_STEPS_END};

const struct bd_command_row bd_rows_of_scenes[] = {
    {BD_BODY(SCENE_ADD), .role = BD_ROLE_EDIT, .is_job = true, .http = "POST /v1/scenes",
     .steps = add},
    {BD_BODY(SCENE_LIST), .http = "GET /v1/scenes", .steps = list},
    {BD_BODY(SCENE_GET), .scene = "id", .http = "GET /v1/scenes/ID", .steps = get},
    {BD_BODY(SCENE_REMOVE), .scene = "id", .role = BD_ROLE_EDIT, .http = "DELETE /v1/scenes/ID",
     .steps = remove_steps},
    {BD_BODY(SCENE_LOG), BD_OF_SCENE, .http = "GET /v1/scenes/ID/log", .steps = log_steps},
    BD_ROWS_END,
};
