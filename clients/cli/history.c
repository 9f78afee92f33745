#include "clients/cli/history.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "clients/cli/args.h"
#include "clients/cli/conn.h"
#include "clients/cli/list.h"
#include "clients/cli/output.h"
#include "clients/cli/print.h"

static char *id_of(const struct bd_cli_scene *options)
{
    return (char *)options->operands[1];
}

// One request on a connection of its own. Finish `*out` either way.
static enum bd_err ask(const struct bd_cli_scene *options, Bounced__Envelope *request,
                       Bounced__Envelope__BodyCase want, struct bd_cli_answer *out,
                       struct bd_err_detail *detail)
{
    *out = (struct bd_cli_answer){0};
    struct bd_cli_conn *conn = NULL;
    enum bd_err err = bd_cli_conn_open(&options->common, BD_CLI_CONN_RUNNING, &conn, detail);
    if (!err) err = bd_cli_conn_call(conn, request, NULL, 0, want, NULL, out, detail);
    bd_cli_conn_close(&conn);
    return err;
}

static void print_flags(const struct bd_cli_scene *options, char *const *flags, size_t count)
{
    for (size_t i = 0; !options->common.quiet && i < count; i++)
        bd_cli_print_line(stderr, "bounce: flag: %s", flags[i]);
}

// What makes a new revision: prints which.
static enum bd_err change(const struct bd_cli_scene *options, Bounced__Envelope *request,
                          struct bd_err_detail *detail)
{
    struct bd_cli_answer answer;
    enum bd_err err = ask(options, request, BOUNCED__ENVELOPE__BODY_EDIT_REPLY, &answer, detail);
    if (!err) {
        const Bounced__EditReply *reply = answer.envelope->edit_reply;
        print_flags(options, reply->flags, reply->n_flags);
        if (options->common.json)
            err = bd_cli_print_json(&reply->base, detail);
        else
            printf("revision %" PRIu64 "\n", reply->revision);
    }
    bd_cli_answer_finish(&answer);
    return err;
}

static enum bd_err undo(const struct bd_cli_scene *options, bool redo, struct bd_err_detail *detail)
{
    Bounced__EditUndo body = BOUNCED__EDIT_UNDO__INIT;
    body.scene = id_of(options);
    body.has_redo = body.redo = redo;
    body.by = (char *)options->by;
    body.scope = options->all ? (char *)"all" : NULL;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_EDIT_UNDO;
    envelope.edit_undo = &body;
    return change(options, &envelope, detail);
}

enum bd_err bd_cli_history_undo(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    return undo(options, false, detail);
}

enum bd_err bd_cli_history_redo(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    return undo(options, true, detail);
}

enum bd_err bd_cli_history_commit(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    Bounced__EditCommit body = BOUNCED__EDIT_COMMIT__INIT;
    body.scene = id_of(options);
    body.by = (char *)options->by;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_EDIT_COMMIT;
    envelope.edit_commit = &body;
    return change(options, &envelope, detail);
}

// A word of digits is a revision, any other a name.
static enum bd_err read_target(const char *word, protobuf_c_boolean *has_revision,
                               uint64_t *revision, char **name, struct bd_err_detail *detail)
{
    *has_revision = strspn(word, "0123456789") == strlen(word);
    if (*has_revision) return bd_cli_uint("revision", word, 0, INT64_MAX, revision, detail);
    *name = (char *)word;
    return BD_ERR_OK;
}

enum bd_err bd_cli_history_revert(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    Bounced__EditRevert body = BOUNCED__EDIT_REVERT__INIT;
    body.scene = id_of(options);
    body.by = (char *)options->by;
    enum bd_err err =
        read_target(options->operands[2], &body.has_revision, &body.revision, &body.name, detail);
    if (err) return err;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_EDIT_REVERT;
    envelope.edit_revert = &body;
    return change(options, &envelope, detail);
}

enum bd_err bd_cli_history_name(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    Bounced__RevisionName body = BOUNCED__REVISION_NAME__INIT;
    body.scene = id_of(options);
    body.name = (char *)options->operands[2];
    body.has_remove = body.remove = options->remove;
    body.has_revision = options->operand_count == 4;
    enum bd_err err = BD_ERR_OK;
    if (body.has_revision)
        err = bd_cli_uint("revision", options->operands[3], 0, INT64_MAX, &body.revision, detail);
    if (err) return err;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_REVISION_NAME;
    envelope.revision_name = &body;
    struct bd_cli_answer answer;
    err = ask(options, &envelope, BOUNCED__ENVELOPE__BODY_DONE, &answer, detail);
    bd_cli_answer_finish(&answer);
    return err;
}

static void print_strings(const char *before, char *const *strings, size_t count, const char *after)
{
    for (size_t i = 0; i < count; i++)
        bd_cli_print(stdout, "%s%s%s", i ? ", " : before, strings[i], i + 1 == count ? after : "");
}

static void print_entry(const Bounced__LogEntry *entry)
{
    char when[32] = "";
    time_t seconds = (time_t)(entry->time_ms / 1000);
    struct tm parts;
    if (entry->has_time_ms && gmtime_r(&seconds, &parts))
        strftime(when, sizeof when, "%Y-%m-%dT%H:%M:%SZ", &parts);
    bd_cli_print(stdout, "%-6" PRIu64 " %-7s %-20s", entry->revision,
                 entry->kind ? entry->kind : "", when);
    if (entry->has_of) printf("  of %" PRIu64, entry->of);
    if (entry->author && *entry->author) bd_cli_print(stdout, "  by %s", entry->author);
    print_strings("  [", entry->names, entry->n_names, "]");
    if (entry->message && *entry->message) bd_cli_print(stdout, "  %s", entry->message);
    print_strings("  (", entry->changes, entry->n_changes, ")");
    putchar('\n');
}

enum bd_err bd_cli_history_log(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    Bounced__SceneLog body = BOUNCED__SCENE_LOG__INIT;
    body.scene = id_of(options);
    body.has_after = options->has_after;
    body.after = options->after;
    body.has_limit = options->limit > 0;
    body.limit = options->limit;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_LOG;
    envelope.scene_log = &body;
    struct bd_cli_answer answer;
    enum bd_err err =
        ask(options, &envelope, BOUNCED__ENVELOPE__BODY_SCENE_LOG_REPLY, &answer, detail);
    if (!err) {
        const Bounced__SceneLogReply *reply = answer.envelope->scene_log_reply;
        if (options->common.json) err = bd_cli_print_json(&reply->base, detail);
        for (size_t i = 0; !options->common.json && i < reply->n_entries; i++)
            print_entry(reply->entries[i]);
    }
    bd_cli_answer_finish(&answer);
    return err;
}

enum bd_err bd_cli_history_export(const struct bd_cli_scene *options, struct bd_err_detail *detail)
{
    const char *path = options->operands[2];
    if (options->common.json && strcmp(path, "-") == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "json", "- and --json both want standard output");
    enum bd_err err = bd_cli_output_check(path, detail);
    if (err) return err;
    Bounced__SceneExport body = BOUNCED__SCENE_EXPORT__INIT;
    body.scene = id_of(options);
    if (options->operand_count == 4)
        err = read_target(options->operands[3], &body.has_revision, &body.revision, &body.name,
                          detail);
    if (err) return err;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_SCENE_EXPORT;
    envelope.scene_export = &body;
    struct bd_cli_answer answer;
    err = ask(options, &envelope, BOUNCED__ENVELOPE__BODY_SCENE_EXPORT_REPLY, &answer, detail);
    if (!err) {
        const Bounced__SceneExportReply *reply = answer.envelope->scene_export_reply;
        print_flags(options, reply->flags, reply->n_flags);
        err =
            bd_cli_output_write(path, answer.message.payload, answer.message.payload_bytes, detail);
        if (!err && options->common.json) err = bd_cli_print_json(&reply->base, detail);
    }
    bd_cli_answer_finish(&answer);
    return err;
}
