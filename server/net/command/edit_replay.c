#include "net/command/edit_replay.h"

#include <inttypes.h>
#include <string.h>

#include "base/assert.h"
#include "net/access/auth.h"
#include "net/command/import_files.h"
#include "scene/model/content_table.h"

// Ids that a revision may pass over, of objects that came and went within it.
#define SKIPPED_IDS_MAX 65536
// So that revisions after it can be counted, and told in JSON.
#define FIRST_REVISION_MAX (UINT64_C(1) << 53)

// --- bytes and content ----------------------------------------------------------------------

struct finding {
    struct bd_blobs *blobs;
    struct bd_content_table content;
};

static void know(void *user, const struct bd_content *content)
{
    struct finding *finding = user;
    if (bd_content_sha256(content)) bd_content_table_put(&finding->content, content);
}

static void read_blob(struct finding *finding, const uint8_t sha256[32])
{
    char hex[BD_SHA256_HEX];
    struct bd_blob_map map;
    struct bd_content read = {0};
    bd_sha256_hex(sha256, hex);
    if (bd_blobs_map(finding->blobs, hex, &map, NULL)) return;
    if (!bd_content_read(map.bytes, map.size_bytes, &read, NULL)) {
        bd_content_table_put(&finding->content, &read);
        bd_content_release(&read);
    }
    bd_blob_unmap(&map);
}

static bool find_content(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    struct finding *finding = user;
    if (!bd_content_table_get(&finding->content, sha256)) read_blob(finding, sha256);
    const struct bd_content *known = bd_content_table_get(&finding->content, sha256);
    if (!known || known->kind != out->kind) return false;
    *out = bd_content_retain(known);
    return true;
}

// The request's bytes: its payload, or a blob that stays mapped until `map` is unmapped.
static enum bd_err find_bytes(struct bd_command *command, struct bd_blob_map *map)
{
    const char *blob = command->envelope->scene_replay->blob;
    if (blob)
        return bd_net_map_blob(bd_grant_blobs(command->steps.loop->serving->blobs, command->grant),
                               "blob", blob, map, &command->steps.detail);
    *map = (struct bd_blob_map){command->payload, command->payload_bytes};
    return BD_ERR_OK;
}

static void leave_bytes(const struct bd_command *command, struct bd_blob_map *map)
{
    if (command->envelope->scene_replay->blob) bd_blob_unmap(map);
}

// --- onto a scene ---------------------------------------------------------------------------

static bool find_kind(const char *name, enum bd_batch_kind *out)
{
    static const enum bd_batch_kind kinds[] = {BD_BATCH_EDIT, BD_BATCH_UNDO, BD_BATCH_REDO,
                                               BD_BATCH_REVERT};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (strcmp(name, bd_batch_kind_name(kinds[i])) == 0) {
            *out = kinds[i];
            return true;
        }
    return false;
}

enum bd_err bd_edit_replay_check(struct bd_edit_work *work, uint64_t revision)
{
    struct bd_command *command = work->command;
    const Bounced__SceneReplay *request = command->envelope->scene_replay;
    if (request->revision != revision + 1)
        return bd_err_set(&command->steps.detail, BD_ERR_CONFLICT, "revision",
                          "the scene is at revision %" PRIu64 ", and %" PRIu64
                          " does not follow it",
                          revision, request->revision);
    if (!find_kind(request->kind ? request->kind : "", &work->kind))
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "kind",
                          "kind is edit, undo, redo or revert, not \"%.32s\"",
                          request->kind ? request->kind : "");
    if (request->of > revision)
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "of",
                          "of is a revision before this one, not %" PRIu64, request->of);
    work->of = request->of;
    work->head_revision = revision;
    work->message = request->message;
    command->time_ms = request->time_ms;
    return BD_ERR_OK;
}

// Slots cost memory, and a stranger's id may be any number.
static enum bd_err check_growth(struct bd_edit_work *work)
{
    uint32_t growth = bd_delta_growth(work->base, &work->delta);
    if (growth <= work->delta.count || growth - work->delta.count <= SKIPPED_IDS_MAX)
        return BD_ERR_OK;
    return bd_err_set(&work->command->steps.detail, BD_ERR_LIMIT, "payload",
                      "the revision passes over %u ids, limit %u", growth - work->delta.count,
                      SKIPPED_IDS_MAX);
}

enum bd_err bd_edit_replay_read(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    struct finding finding = {
        .blobs = bd_grant_blobs(command->steps.loop->serving->blobs, command->grant)};
    struct bd_blob_map map;
    enum bd_err err = find_bytes(command, &map);
    if (err) return err;
    bd_content_of_scene(work->base, know, &finding);
    err = bd_delta_read(map.bytes, map.size_bytes, find_content, &finding, &work->delta,
                        &command->steps.detail);
    bd_content_table_finish(&finding.content);
    leave_bytes(command, &map);
    return err ? err : check_growth(work);
}

// --- a new scene ----------------------------------------------------------------------------

static enum bd_err read_index(struct bd_command *command)
{
    struct finding finding = {
        .blobs = bd_grant_blobs(command->steps.loop->serving->blobs, command->grant)};
    struct bd_blob_map map;
    enum bd_err err = find_bytes(command, &map);
    if (err) return err;
    err = bd_flat_read_index(map.bytes, map.size_bytes, find_content, &finding, &command->scene,
                             &command->steps.detail);
    if (!err) err = bd_scene_finish(command->scene, &command->steps.detail);
    bd_content_table_finish(&finding.content);
    leave_bytes(command, &map);
    return err;
}

static enum bd_err read_scene(struct bd_command *command)
{
    const Bounced__SceneReplay *request = command->envelope->scene_replay;
    command->revision = request->revision;
    command->time_ms = request->time_ms;
    return read_index(command);
}

static enum bd_err stage(struct bd_command *command)
{
    bd_steps_branch(&command->steps, bd_steps_stage_scene);
    return BD_ERR_OK;
}

static const struct bd_step scene_steps[] = {BD_STEP(pool, read_scene), BD_STEP(loop, stage),
                                             BD_STEPS_END};

static enum bd_err begin(struct bd_command *command)
{
    const Bounced__SceneReplay *request = command->envelope->scene_replay;
    if (request->revision == 0 || request->revision > FIRST_REVISION_MAX)
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "revision",
                          "revision is the one to be made, from 1 to 2^53");
    bd_steps_branch(&command->steps, request->scene ? bd_steps_edit : scene_steps);
    return BD_ERR_OK;
}

static const struct bd_step steps[] = {BD_STEP(loop, begin), BD_STEPS_END};

// A past that did not happen here.
const struct bd_command_row bd_rows_of_replay[] = {
    {BD_BODY(SCENE_REPLAY), BD_OF_SCENE, .role = BD_ROLE_ADMIN, .has_payload = true, .steps = steps,
     .turn_steps = bd_steps_replay_edit},
    BD_ROWS_END,
};
