#include "clients/cli/replay.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/assert.h"
#include "clients/cli/files.h"
#include "clients/cli/frame.h"
#include "clients/cli/interrupt.h"
#include "clients/cli/output.h"
#include "clients/cli/upload.h"

// More than this goes as a blob: a server may take messages no longer than a few MiB.
#define PAYLOAD_BYTES_MAX (1u << 20)
#define BUSY_PAUSE_MS     20
#define FRAME_PATH_BYTES  4096

struct bd_cli_replay_name {
    char *name;
    uint64_t revision;
};

// --- one request ----------------------------------------------------------------------------

// A journal is read faster than a server takes requests from strangers.
static bool should_wait(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err != BD_ERR_BUSY || strcmp(detail->field, "requests_per_second") != 0) return false;
    const struct timespec pause = {.tv_nsec = BUSY_PAUSE_MS * 1000000};
    nanosleep(&pause, NULL);
    return !bd_interrupted();
}

static enum bd_err call(const struct bd_cli_player *player, Bounced__Envelope *request,
                        const void *payload, size_t payload_bytes, Bounced__Envelope__BodyCase want,
                        struct bd_cli_answer *out, struct bd_err_detail *detail)
{
    enum bd_err err;
    while ((err = bd_cli_conn_call(player->conn, request, payload, payload_bytes, want, NULL, out,
                                   detail)) &&
           should_wait(err, detail))
        bd_cli_answer_finish(out);
    return err;
}

// --- what a revision needs ------------------------------------------------------------------

static void name_of(const uint8_t sha256[BD_SHA256_BYTES], char out[BD_CLI_BLOB_NAME])
{
    char hex[BD_SHA256_HEX];
    bd_sha256_hex(sha256, hex);
    snprintf(out, BD_CLI_BLOB_NAME, "sha256:%s", hex);
}

static enum bd_err put_blob(const struct bd_cli_player *player, const char *blob, const void *bytes,
                            size_t size, struct bd_err_detail *detail)
{
    enum bd_err err;
    while (should_wait(err = bd_cli_upload_bytes(player->conn, blob, bytes, size, detail), detail))
        continue;
    return err;
}

static enum bd_err send_one(const struct bd_cli_player *player, const uint8_t *sha256,
                            struct bd_err_detail *detail)
{
    char blob[BD_CLI_BLOB_NAME];
    bool is_held = false;
    void *bytes = NULL;
    size_t size = 0;
    enum bd_err err;
    name_of(sha256, blob);
    while (should_wait(err = bd_cli_upload_is_held(player->conn, blob, &is_held, detail), detail))
        continue;
    if (err || is_held) return err;
    err = bd_journal_read_content(player->journal, sha256, &bytes, &size, detail);
    if (!err) err = put_blob(player, blob, bytes, size, detail);
    free(bytes);
    return err;
}

static enum bd_err send_content(const struct bd_cli_player *player,
                                const struct bd_journal_digests *list, struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < list->count; i++)
        err = send_one(player, list->sha256 + (size_t)i * BD_SHA256_BYTES, detail);
    return err;
}

static enum bd_err send_revision(const struct bd_cli_player *player, Bounced__SceneReplay *body,
                                 const struct bd_journal_bytes *bytes,
                                 Bounced__Envelope__BodyCase want, struct bd_cli_answer *answer,
                                 struct bd_err_detail *detail)
{
    char blob[BD_CLI_BLOB_NAME];
    enum bd_err err = BD_ERR_OK;
    bool is_large = bytes->size > PAYLOAD_BYTES_MAX;
    *answer = (struct bd_cli_answer){0};
    if (is_large) {
        uint8_t sha256[BD_SHA256_BYTES];
        bd_sha256_of(bytes->data, bytes->size, sha256);
        name_of(sha256, blob);
        body->blob = blob;
        err = put_blob(player, blob, bytes->data, bytes->size, detail);
    }
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_REPLAY;
    envelope.scene_replay = body;
    if (!err)
        err = call(player, &envelope, is_large ? NULL : bytes->data, is_large ? 0 : bytes->size,
                   want, answer, detail);
    body->blob = NULL;
    return err;
}

// --- names ----------------------------------------------------------------------------------

static void keep_name(void *user, const char *name, uint64_t revision)
{
    struct bd_cli_player *player = user;
    player->names = realloc(player->names, (player->name_count + 1) * sizeof *player->names);
    BD_ASSERT(player->names);
    player->names[player->name_count] = (struct bd_cli_replay_name){strdup(name), revision};
    BD_ASSERT(player->names[player->name_count].name);
    player->name_count++;
}

static enum bd_err give_names(const struct bd_cli_player *player, uint64_t revision,
                              struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < player->name_count; i++) {
        if (player->names[i].revision != revision) continue;
        Bounced__RevisionName body = BOUNCED__REVISION_NAME__INIT;
        body.scene = player->into;
        body.name = player->names[i].name;
        body.has_revision = 1;
        body.revision = revision;
        Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
        envelope.body_case = BOUNCED__ENVELOPE__BODY_REVISION_NAME;
        envelope.revision_name = &body;
        struct bd_cli_answer answer;
        err = call(player, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_DONE, &answer, detail);
        bd_cli_answer_finish(&answer);
    }
    return err;
}

// --- frames ---------------------------------------------------------------------------------

static enum bd_err render(struct bd_cli_player *player, const char *path,
                          struct bd_err_detail *detail)
{
    Bounced__Render body = BOUNCED__RENDER__INIT;
    body.scene = player->into;
    struct bd_cli_answer answer;
    enum bd_err err;
    while ((err = bd_cli_frame_ask(player->conn, &body, &player->options->frame, player->progress,
                                   &answer, detail)) &&
           should_wait(err, detail))
        bd_cli_answer_finish(&answer);
    bd_cli_progress_clear(player->progress);
    if (!err && answer.message.payload_bytes == 0)
        err = bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer without a picture");
    if (!err)
        err =
            bd_cli_output_write(path, answer.message.payload, answer.message.payload_bytes, detail);
    bd_cli_answer_finish(&answer);
    player->frames += !err;
    return err;
}

static const char *extension(enum bd_cli_format format)
{
    return format == BD_CLI_JPEG ? "jpg" : bd_cli_format_name(format);
}

static bool wants_frame(const struct bd_cli_player *player, uint64_t revision)
{
    const struct bd_cli_replay *options = player->options;
    if (!options->frames) return false;
    for (uint32_t i = 0; i < options->at_count; i++)
        if (options->at[i] == revision) return true;
    return options->at_count == 0 && (revision % options->every == 0 || revision == player->last);
}

// The frame that --frames wants of a revision; `path` is "" if it wants none.
static enum bd_err render_one(struct bd_cli_player *player, uint64_t revision,
                              char path[FRAME_PATH_BYTES], struct bd_err_detail *detail)
{
    const struct bd_cli_replay *options = player->options;
    path[0] = 0;
    if (!wants_frame(player, revision)) return BD_ERR_OK;
    int length = snprintf(path, FRAME_PATH_BYTES, "%s/%s-%06" PRIu64 ".%s", options->frames,
                          player->scene->id, revision, extension(options->frame.format));
    if (length >= FRAME_PATH_BYTES)
        return bd_err_set(detail, BD_ERR_USAGE, "frames", "--frames: the path is too long");
    return render(player, path, detail);
}

// --- a revision -----------------------------------------------------------------------------

static void count(struct bd_cli_player *player, const struct bd_cli_replay_line *line)
{
    player->played++;
    if (line->is_same) return;
    if (player->differing++ == 0)
        snprintf(player->first_differing, sizeof player->first_differing,
                 "revision %" PRIu64 " of %.40s", line->revision, player->scene->id);
}

// What follows once the daemon has it.
static enum bd_err finish_revision(struct bd_cli_player *player, struct bd_cli_replay_line *line,
                                   const uint8_t sha256[BD_SHA256_BYTES],
                                   struct bd_err_detail *detail)
{
    char path[FRAME_PATH_BYTES], hash[BD_CLI_BLOB_NAME];
    name_of(sha256, hash);
    line->is_same = strcmp(line->hash, hash) == 0;
    count(player, line);
    enum bd_err err = give_names(player, line->revision, detail);
    if (!err) err = render_one(player, line->revision, path, detail);
    if (err) return err;
    line->frame = path[0] ? path : NULL;
    err = bd_cli_replay_print(player, line, detail);
    if (!err && bd_interrupted()) err = bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
    return err;
}

static enum bd_err begin_scene(void *user, const struct bd_journal_snapshot *snapshot,
                               struct bd_err_detail *detail)
{
    struct bd_cli_player *player = user;
    Bounced__SceneReplay body = BOUNCED__SCENE_REPLAY__INIT;
    body.name = player->scene->name;
    body.has_revision = 1;
    body.revision = snapshot->revision;
    struct bd_cli_answer answer = {0};
    enum bd_err err = send_content(player, &snapshot->content, detail);
    if (!err)
        err = send_revision(player, &body, &snapshot->index, BOUNCED__ENVELOPE__BODY_SCENE, &answer,
                            detail);
    const Bounced__Scene *scene = err ? NULL : answer.envelope->scene;
    if (!err && (!scene->id || !scene->hash))
        err = bd_err_set(detail, BD_ERR_INTERNAL, "server", "a scene without an id or a hash");
    if (!err) {
        player->into = strdup(scene->id);
        BD_ASSERT(player->into);
        bd_cli_replay_print_scene(player);
        struct bd_cli_replay_line line = {.revision = snapshot->revision,
                                          .kind = "import",
                                          .client_edit_id = "",
                                          .message = "",
                                          .summary = {"", 0},
                                          .hash = scene->hash};
        err = finish_revision(player, &line, snapshot->sha256, detail);
    }
    bd_cli_answer_finish(&answer);
    return err;
}

static enum bd_err play_edit(void *user, const struct bd_journal_edit *edit,
                             struct bd_err_detail *detail)
{
    struct bd_cli_player *player = user;
    Bounced__SceneReplay body = BOUNCED__SCENE_REPLAY__INIT;
    body.scene = player->into;
    body.has_revision = body.has_time_ms = 1;
    body.revision = edit->revision;
    body.time_ms = edit->time_ms;
    body.kind = (char *)edit->kind;
    body.has_of = edit->of != 0;
    body.of = edit->of;
    body.client_edit_id = edit->client_edit_id[0] ? (char *)edit->client_edit_id : NULL;
    body.message = edit->message[0] ? (char *)edit->message : NULL;
    body.author = edit->author[0] ? (char *)edit->author : NULL;
    struct bd_cli_answer answer = {0};
    enum bd_err err = send_content(player, &edit->forward_content, detail);
    if (!err)
        err = send_revision(player, &body, &edit->forward, BOUNCED__ENVELOPE__BODY_EDIT_REPLY,
                            &answer, detail);
    if (!err) {
        const char *hash = answer.envelope->edit_reply->hash;
        struct bd_cli_replay_line line = {.revision = edit->revision,
                                          .of = edit->of,
                                          .kind = edit->kind,
                                          .client_edit_id = edit->client_edit_id,
                                          .message = edit->message,
                                          .summary = edit->summary,
                                          .hash = hash ? hash : ""};
        err = finish_revision(player, &line, edit->snapshot_sha256, detail);
    }
    bd_cli_answer_finish(&answer);
    return err;
}

// --- a scene --------------------------------------------------------------------------------

static void leave_scene(struct bd_cli_player *player)
{
    for (uint32_t i = 0; i < player->name_count; i++) free(player->names[i].name);
    free(player->names);
    free(player->into);
    player->names = NULL;
    player->name_count = 0;
    player->into = NULL;
}

enum bd_err bd_cli_replay_scene(struct bd_cli_player *player,
                                const struct bd_cli_replay_scene *scene,
                                struct bd_err_detail *detail)
{
    const struct bd_journal_visitor visitor = {begin_scene, play_edit, player};
    player->scene = scene;
    player->last = player->options->to ? player->options->to : scene->revision;
    enum bd_err err = bd_journal_each_name(player->journal, scene->id, keep_name, player, detail);
    if (!err)
        err = bd_journal_walk(player->journal, scene->id, player->options->to, &visitor, detail);
    if (!err && player->options->render) err = render(player, player->options->render, detail);
    leave_scene(player);
    return err;
}
