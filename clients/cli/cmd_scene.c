// `bounce scenes`, `bounce scene add`, `bounce scene rm`; the other verbs are in history.c.

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/help.h"
#include "clients/cli/history.h"
#include "clients/cli/list.h"
#include "clients/cli/options.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/source.h"

static void print_scene(const Bounced__Scene *scene)
{
    bd_cli_print(stdout, "%s  revision %" PRIu64 "  %s", scene->id, scene->revision,
                 scene->name ? scene->name : "");
    if (scene->counts)
        printf("  (%" PRIu64 " triangles, %" PRIu64 " lights, %" PRIu64 " cameras)",
               scene->counts->triangles, scene->counts->lights, scene->counts->cameras);
    putchar('\n');
}

static void print_scenes(const Bounced__Envelope *answer)
{
    const Bounced__SceneListReply *reply = answer->scene_list_reply;
    for (size_t i = 0; i < reply->n_scenes; i++) print_scene(reply->scenes[i]);
}

static const ProtobufCMessage *body_of(const Bounced__Envelope *answer)
{
    return &answer->scene_list_reply->base;
}

int bd_cmd_scenes(const char *const *words, int count)
{
    Bounced__SceneList request = BOUNCED__SCENE_LIST__INIT;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_LIST;
    envelope.scene_list = &request;
    const struct bd_cli_list list = {
        .kind = BD_CLI_CONN_RUNNING,
        .request = &envelope,
        .want = BOUNCED__ENVELOPE__BODY_SCENE_LIST_REPLY,
        .body = body_of,
        .print = print_scenes,
        .help = bd_help_scenes,
    };
    return bd_cli_list(&list, words, count);
}

static void on_stage(void *user, const char *stage)
{
    bd_cli_progress_stage(user, stage);
}

static void on_tick(void *user)
{
    bd_cli_progress_tick(user);
}

static enum bd_err send_scene(struct bd_cli_conn *conn, const struct bd_cli_source *source,
                              struct bd_cli_progress *progress, struct bd_cli_answer *answer,
                              struct bd_err_detail *detail)
{
    Bounced__SceneAdd add = BOUNCED__SCENE_ADD__INIT;
    bd_cli_source_fill_add(source, &add);
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_ADD;
    envelope.scene_add = &add;
    const struct bd_cli_conn_watch watch = {.stage = on_stage, .tick = on_tick, .user = progress};
    bd_cli_progress_stage(progress, "import");
    return bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_SCENE, &watch, answer,
                            detail);
}

static enum bd_err print_added(const struct bd_cli_common *common, const Bounced__Scene *scene,
                               struct bd_err_detail *detail)
{
    for (size_t i = 0; !common->quiet && i < scene->n_flags; i++)
        bd_cli_print_line(stderr, "bounce: flag: %s", scene->flags[i]);
    if (common->json) return bd_cli_print_json(&scene->base, detail);
    print_scene(scene);
    return BD_ERR_OK;
}

static enum bd_err add_scene(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    const struct bd_cli_common *common = &options->common;
    const char *path = options->operands[1], *environment = options->environment;
    struct bd_cli_conn *conn = NULL;
    struct bd_cli_source source = {0};
    struct bd_cli_answer answer = {0};
    struct bd_cli_progress progress;
    bd_cli_progress_init(&progress, common->quiet);
    enum bd_err err = bd_cli_source_check(path, environment, detail);
    if (!err) err = bd_cli_conn_open(common, BD_CLI_CONN_RUNNING, &conn, detail);
    if (!err) err = bd_cli_source_send(&source, path, environment, conn, &progress, detail);
    if (!err) err = send_scene(conn, &source, &progress, &answer, detail);
    bd_cli_progress_clear(&progress);
    if (err)
        bd_cmd_name_scene(path, detail);
    else
        err = print_added(common, answer.envelope->scene, detail);
    bd_cli_answer_finish(&answer);
    bd_cli_source_finish(&source);
    bd_cli_conn_close(&conn);
    return err;
}

static enum bd_err remove_scene(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    struct bd_cli_conn *conn = NULL;
    enum bd_err err = bd_cli_conn_open(&options->common, BD_CLI_CONN_RUNNING, &conn, detail);
    if (err) return err;
    Bounced__SceneRemove remove = BOUNCED__SCENE_REMOVE__INIT;
    remove.id = (char *)options->operands[1];
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_REMOVE;
    envelope.scene_remove = &remove;
    struct bd_cli_answer answer;
    err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_DONE, NULL, &answer,
                           detail);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    return err;
}

static const struct {
    const char *verb, *usage;
    int operands_min, operands_max; // the verb counts
    enum bd_err (*run)(const struct bd_cli_scene *options, struct bd_err_detail *detail);
} verbs[] = {
    {"add", "add FILE", 2, 2, add_scene},
    {"rm", "rm ID", 2, 2, remove_scene},
    {"log", "log ID", 2, 2, bd_cli_history_log},
    {"undo", "undo ID", 2, 2, bd_cli_history_undo},
    {"redo", "redo ID", 2, 2, bd_cli_history_redo},
    {"commit", "commit ID", 2, 2, bd_cli_history_commit},
    {"revert", "revert ID REVISION|NAME", 3, 3, bd_cli_history_revert},
    {"name", "name ID NAME [REVISION]", 3, 4, bd_cli_history_name},
    {"export", "export ID FILE.glb [REVISION|NAME]", 3, 4, bd_cli_history_export},
};

#define VERB_COUNT (sizeof verbs / sizeof verbs[0])

static enum bd_err run_verb(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    for (size_t i = 0; i < VERB_COUNT; i++) {
        if (strcmp(verbs[i].verb, options->operands[0]) != 0) continue;
        if (options->operand_count >= verbs[i].operands_min &&
            options->operand_count <= verbs[i].operands_max)
            return verbs[i].run(options, detail);
        return bd_err_set(detail, BD_ERR_USAGE, "scene", "bounce scene %s", verbs[i].usage);
    }
    return bd_err_set(detail, BD_ERR_USAGE, "scene",
                      "bounce scene add FILE, or rm, log, undo, redo, commit, revert, name, export "
                      "ID (bounce scene --help)");
}

int bd_cmd_scene(const char *const *words, int count)
{
    struct bd_cli_scene options;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_scene(words, count, &options, &detail);
    if (!err && options.help) return bd_help_scenes();
    if (!err) err = run_verb(&options, &detail);
    return err ? bd_cmd_fail(err, &detail, options.common.json) : 0;
}
