// `bounce watch`: a line for each change.

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/help.h"
#include "clients/cli/options.h"
#include "clients/cli/print.h"
#include "protocol/json.h"

static void print_event(const Bounced__SceneEvent *event)
{
    bd_cli_print(stdout, "%s  %s", event->scene ? event->scene : "",
                 event->kind ? event->kind : "");
    if (event->has_revision) printf("  revision %" PRIu64, event->revision);
    if (event->has_transient && event->transient) printf(" + %" PRIu64, event->transient);
    for (size_t i = 0; i < event->n_changes; i++)
        bd_cli_print(stdout, "%s%s", i ? ", " : "  ", event->changes[i]);
    putchar('\n');
}

static enum bd_err print_json(const Bounced__SceneEvent *event, struct bd_err_detail *detail)
{
    char *text = bd_json_text_from_message(&event->base);
    if (!text) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the event");
    puts(text);
    free(text);
    return BD_ERR_OK;
}

static enum bd_err print_next(const struct bd_cli_scene *options, struct bd_cli_conn *conn,
                              uint64_t request_id, struct bd_err_detail *detail)
{
    struct bd_cli_answer answer;
    enum bd_err err =
        bd_cli_conn_event(conn, request_id, BOUNCED__ENVELOPE__BODY_SCENE_EVENT, &answer, detail);
    if (!err && options->common.json) err = print_json(answer.envelope->scene_event, detail);
    if (!err && !options->common.json) print_event(answer.envelope->scene_event);
    bd_cli_answer_finish(&answer);
    if (!err && fflush(stdout)) err = bd_err_set(detail, BD_ERR_IO, "", "standard output");
    return err;
}

static enum bd_err watch(const struct bd_cli_scene *options, struct bd_cli_conn *conn,
                         struct bd_err_detail *detail)
{
    Bounced__SceneWatch body = BOUNCED__SCENE_WATCH__INIT;
    if (options->operand_count) body.scene = (char *)options->operands[0];
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_WATCH;
    envelope.scene_watch = &body;
    struct bd_cli_answer answer;
    enum bd_err err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_DONE, NULL,
                                       &answer, detail);
    bd_cli_answer_finish(&answer);
    for (uint64_t i = 0; !err && (!options->count || i < options->count); i++)
        err = print_next(options, conn, envelope.request_id, detail);
    return err;
}

int bd_cmd_watch(const char *const *words, int count)
{
    struct bd_cli_scene options;
    struct bd_cli_conn *conn = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_watch(words, count, &options, &detail);
    if (!err && options.help) return bd_help_watch();
    if (!err) err = bd_cli_conn_open(&options.common, BD_CLI_CONN_RUNNING, &conn, &detail);
    if (!err) err = watch(&options, conn, &detail);
    bd_cli_conn_close(&conn);
    return err ? bd_cmd_fail(err, &detail, options.common.json) : 0;
}
