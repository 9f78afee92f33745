// `bounce replay`.

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/assert.h"
#include "clients/cli/commands.h"
#include "clients/cli/help.h"
#include "clients/cli/output.h"
#include "clients/cli/replay.h"

struct scenes {
    struct bd_cli_replay_scene *items;
    size_t count;
};

static void keep_scene(void *user, const struct bd_journal_scene *scene)
{
    struct scenes *scenes = user;
    scenes->items = realloc(scenes->items, (scenes->count + 1) * sizeof *scenes->items);
    BD_ASSERT(scenes->items);
    struct bd_cli_replay_scene *item = &scenes->items[scenes->count++];
    *item =
        (struct bd_cli_replay_scene){strdup(scene->scene), strdup(scene->name), scene->revision};
    BD_ASSERT(item->id && item->name);
}

static void free_scenes(struct scenes *scenes)
{
    for (size_t i = 0; i < scenes->count; i++) {
        free(scenes->items[i].id);
        free(scenes->items[i].name);
    }
    free(scenes->items);
}

static const struct bd_cli_replay_scene *find_scene(const struct scenes *scenes, const char *id)
{
    for (size_t i = 0; i < scenes->count; i++)
        if (strcmp(scenes->items[i].id, id) == 0) return &scenes->items[i];
    return NULL;
}

static bool is_played(const struct bd_cli_replay *options, const struct bd_cli_replay_scene *scene)
{
    return !options->scene || strcmp(scene->id, options->scene) == 0;
}

// Frames are named after scenes: an id that the daemon did not make could name any file.
static enum bd_err check_ids(const struct bd_cli_replay *options, const struct scenes *scenes,
                             struct bd_err_detail *detail)
{
    for (size_t i = 0; i < scenes->count; i++) {
        const char *id = scenes->items[i].id;
        size_t good =
            strspn(id, "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz-");
        if (!*id || id[good])
            return bd_err_set(detail, BD_ERR_BAD_INPUT, "journal",
                              "%.300s holds a scene \"%.64s\": an id is letters, digits, _ and -",
                              options->journal, id);
    }
    return BD_ERR_OK;
}

// What goes with one scene alone, and whether the one that is named is there.
static enum bd_err check_scenes(const struct bd_cli_replay *options, const struct scenes *scenes,
                                struct bd_err_detail *detail)
{
    const struct bd_cli_replay_scene *named = scenes->count == 1 ? scenes->items : NULL;
    if (scenes->count == 0)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "journal", "%.300s holds no scene",
                          options->journal);
    if (options->scene) named = find_scene(scenes, options->scene);
    if (options->scene && !named)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "%.300s has no scene \"%.64s\"",
                          options->journal, options->scene);
    if (!named && (options->to || options->render))
        return bd_err_set(detail, BD_ERR_USAGE, options->to ? "to" : "render",
                          "--%s is about one scene, and the journal holds %zu: name one by "
                          "--scene ID",
                          options->to ? "to" : "render", scenes->count);
    if (named && options->to > named->revision)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "to",
                          "--to %" PRIu64 ": the newest revision of %.64s is %" PRIu64, options->to,
                          named->id, named->revision);
    return BD_ERR_OK;
}

// A frame that no scene has would be missed only when all is played.
static enum bd_err check_at(const struct bd_cli_player *player, const struct scenes *scenes,
                            uint64_t at, struct bd_err_detail *detail)
{
    const struct bd_cli_replay *options = player->options;
    for (size_t i = 0; i < scenes->count; i++) {
        const struct bd_cli_replay_scene *scene = &scenes->items[i];
        uint64_t oldest, last = options->to ? options->to : scene->revision;
        if (!is_played(options, scene)) continue;
        enum bd_err err = bd_journal_oldest(player->journal, scene->id, &oldest, detail);
        if (err || (oldest <= at && at <= last)) return err;
    }
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "at",
                      "--at %" PRIu64 ": no scene has this revision, or it is not played", at);
}

static enum bd_err check_frames(const struct bd_cli_player *player, const struct scenes *scenes,
                                struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < player->options->at_count; i++)
        err = check_at(player, scenes, player->options->at[i], detail);
    return err;
}

static enum bd_err check_outputs(const struct bd_cli_replay *options, struct bd_err_detail *detail)
{
    if (options->frames && mkdir(options->frames, 0777) && errno != EEXIST)
        return bd_err_set(detail, BD_ERR_IO, "frames", "%.300s: %s", options->frames,
                          strerror(errno));
    return options->render ? bd_cli_output_check(options->render, detail) : BD_ERR_OK;
}

static enum bd_err play(struct bd_cli_player *player, const struct scenes *scenes,
                        struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < scenes->count; i++)
        if (is_played(player->options, &scenes->items[i]))
            err = bd_cli_replay_scene(player, &scenes->items[i], detail);
    return err;
}

static enum bd_err judge(const struct bd_cli_player *player, struct bd_err_detail *detail)
{
    if (player->options->check && player->differing)
        return bd_err_set(detail, BD_ERR_DIFFERS, "hash",
                          "%" PRIu64 " of %" PRIu64 " revisions differ from the journal's, the "
                          "first is %s",
                          player->differing, player->played, player->first_differing);
    if (!player->options->frame.common.quiet)
        fprintf(stderr, "bounce: %" PRIu64 " revisions played, %" PRIu64 " frames rendered%s\n",
                player->played, player->frames,
                player->options->check ? "; every hash is the journal's" : "");
    return BD_ERR_OK;
}

// The journal first: whatever is wrong with it is said before a daemon is started.
static enum bd_err replay(const struct bd_cli_replay *options, struct bd_err_detail *detail)
{
    struct bd_cli_progress progress;
    struct bd_cli_player player = {.options = options, .progress = &progress};
    struct scenes scenes = {0};
    bd_cli_progress_init(&progress, true); // the lines say how far it is
    enum bd_err err = check_outputs(options, detail);
    if (!err) err = bd_journal_open_copy(options->journal, &player.journal, detail);
    if (!err) err = bd_journal_each_scene(player.journal, keep_scene, &scenes, detail);
    if (!err) err = check_ids(options, &scenes, detail);
    if (!err) err = check_scenes(options, &scenes, detail);
    if (!err) err = check_frames(&player, &scenes, detail);
    if (!err)
        err = bd_cli_conn_open(&options->frame.common, BD_CLI_CONN_RUNNING_OR_START, &player.conn,
                               detail);
    if (!err) err = play(&player, &scenes, detail);
    if (!err) err = judge(&player, detail);
    bd_cli_progress_clear(&progress);
    bd_cli_conn_close(&player.conn);
    bd_journal_close(&player.journal);
    free_scenes(&scenes);
    return err;
}

int bd_cmd_replay(const char *const *words, int count)
{
    struct bd_cli_replay options;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_replay(words, count, &options, &detail);
    if (!err && !options.help) err = replay(&options, &detail);
    bd_cli_frame_finish(&options.frame.frame);
    if (!err && options.help) return bd_help_replay();
    return err ? bd_cmd_fail(err, &detail, options.frame.common.json) : 0;
}
