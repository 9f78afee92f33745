// `bounce edit`: batches of edits, one JSON document after the other.

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/text.h"
#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/feed.h"
#include "clients/cli/help.h"
#include "clients/cli/options.h"
#include "protocol/json.h"

struct edit {
    const struct bd_cli_scene *options;
    struct bd_cli_conn *conn;
    struct bd_cli_feed feed;
    uint64_t number; // of the document that is being read, from 1
    bool reported;   // what failed has been said
};

static enum bd_err print_line(char *text, struct bd_err_detail *detail)
{
    if (!text) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the answer");
    // Who feeds us waits for the line.
    bool wrote = puts(text) >= 0 && fflush(stdout) == 0;
    free(text);
    if (wrote) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "", "standard output: %s", strerror(errno));
}

static enum bd_err print_failure(enum bd_err err, const struct bd_err_detail *failure,
                                 struct bd_err_detail *detail)
{
    json_t *object = bd_cmd_error_json(err, failure);
    char *text = object ? bd_text_escape_json(json_dumps(object, JSON_COMPACT)) : NULL;
    json_decref(object);
    return print_line(text, detail);
}

static enum bd_err read_document(struct edit *edit, json_t **out, struct bd_err_detail *detail)
{
    const char *name = edit->feed.name;
    json_error_t error;
    enum bd_err err = bd_cli_feed_next(&edit->feed, out, &error, detail);
    if (err || json_is_object(*out)) return err;
    if (*out)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "",
                          "%.100s: document %" PRIu64 " is no JSON object", name, edit->number);
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "%.100s: document %" PRIu64 ", line %d: %s",
                      name, edit->number, error.line, error.text);
}

// The document as a batch of the scene that the command line names.
static enum bd_err to_batch(struct edit *edit, json_t *json, Bounced__EditBatch **out,
                            struct bd_err_detail *detail)
{
    const ProtobufCMessageDescriptor *descriptor = &bounced__edit_batch__descriptor;
    const char *id = edit->options->operands[0];
    const char *named = json_string_value(json_object_get(json, "scene"));
    if (named && strcmp(named, id) != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "scene",
                          "scene: the document is for %.60s, the command for %.60s", named, id);
    if (edit->options->by && !json_object_get(json, "by") &&
        json_object_set_new(json, "by", json_string(edit->options->by)))
        return bd_err_set(detail, BD_ERR_USAGE, "by", "by: a name is UTF-8");
    if (json_object_set_new(json, "scene", json_string(id)))
        return bd_err_set(detail, BD_ERR_USAGE, "scene", "scene: an id is UTF-8");
    return bd_json_to_message(json, descriptor, (ProtobufCMessage **)out, detail);
}

static enum bd_err send_batch(struct edit *edit, Bounced__EditBatch *batch,
                              struct bd_err_detail *detail)
{
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_EDIT_BATCH;
    envelope.edit_batch = batch;
    struct bd_cli_answer answer;
    enum bd_err err = bd_cli_conn_call(edit->conn, &envelope, NULL, 0,
                                       BOUNCED__ENVELOPE__BODY_EDIT_REPLY, NULL, &answer, detail);
    if (!err)
        err = print_line(bd_json_text_from_message(&answer.envelope->edit_reply->base), detail);
    bd_cli_answer_finish(&answer);
    return err;
}

static enum bd_err apply(struct edit *edit, json_t *json, struct bd_err_detail *detail)
{
    Bounced__EditBatch *batch = NULL;
    enum bd_err err = to_batch(edit, json, &batch, detail);
    if (!err) err = send_batch(edit, batch, detail);
    if (batch) protobuf_c_message_free_unpacked(&batch->base, NULL);
    return err;
}

// Whether the next batch may be sent although this one failed: of a broken connection, of standard
// output and of Ctrl-C nothing comes any more.
static bool may_go_on(const struct edit *edit, enum bd_err err)
{
    return edit->options->keep_going && err != BD_ERR_UNREACHABLE && err != BD_ERR_CANCELLED &&
           err != BD_ERR_IO && err != BD_ERR_NO_MEMORY;
}

// False where the stream has to end: it is no JSON from here on, so nobody knows where the next
// document begins; or `may_go_on` says so.
static bool apply_next(struct edit *edit, enum bd_err *err, struct bd_err_detail *detail)
{
    json_t *json = NULL;
    *detail = (struct bd_err_detail){0};
    *err = read_document(edit, &json, detail);
    bool is_read = json != NULL;
    if (!*err) *err = apply(edit, json, detail);
    json_decref(json);
    return !*err || (is_read && may_go_on(edit, *err));
}

// The failure that ends the stream is the command's, else the first of those that did not, which
// have been reported.
static enum bd_err apply_all(struct edit *edit, struct bd_err_detail *detail)
{
    enum bd_err first = BD_ERR_OK, err = BD_ERR_OK;
    bool is_end = false;
    for (edit->number = 1;; edit->number++) {
        err = bd_cli_feed_at_end(&edit->feed, &is_end, detail);
        if (err) return err;
        if (is_end) break;
        if (!apply_next(edit, &err, detail)) return err;
        if (!err) continue;
        if (!first) first = err;
        fprintf(stderr, "bounce: document %" PRIu64 ": %s\n", edit->number, detail->message);
        const struct bd_err_detail failure = *detail;
        err = print_failure(err, &failure, detail);
        if (err) return err;
    }
    edit->reported = first != BD_ERR_OK;
    return first;
}

static enum bd_err run(const struct bd_cli_scene *options, bool *reported,
                       struct bd_err_detail *detail)
{
    const char *path = options->operands[1];
    bool is_stdin = strcmp(path, "-") == 0;
    struct edit edit = {.options = options};
    edit.feed.name = is_stdin ? "standard input" : path;
    edit.feed.fd = is_stdin ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    if (edit.feed.fd < 0)
        return bd_err_set(detail, BD_ERR_IO, path, "%.200s: %s", path, strerror(errno));
    enum bd_err err = bd_cli_conn_open(&options->common, BD_CLI_CONN_RUNNING, &edit.conn, detail);
    edit.feed.conn = edit.conn;
    if (!err) err = apply_all(&edit, detail);
    *reported = edit.reported;
    bd_cli_conn_close(&edit.conn);
    if (!is_stdin) close(edit.feed.fd);
    return err;
}

int bd_cmd_edit(const char *const *words, int count)
{
    struct bd_cli_scene options;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_edit(words, count, &options, &detail);
    if (!err && options.help) return bd_help_edit();
    if (!err && options.help_ops) return bd_help_ops(options.common.json);
    bool reported = false;
    if (!err) err = run(&options, &reported, &detail);
    if (reported) return bd_err_exit_code(err);
    return err ? bd_cmd_fail(err, &detail, options.common.json) : 0;
}
