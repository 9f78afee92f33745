// `bounce render`.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/files.h"
#include "clients/cli/help.h"
#include "clients/cli/output.h"
#include "clients/cli/progress.h"
#include "clients/cli/report.h"
#include "clients/cli/upload.h"

#define HELD_SCENE "scene:" // SCENE is an id that the daemon knows, not a file

static bool is_held_scene(const struct bd_cli_render *options)
{
    return strncmp(options->scene, HELD_SCENE, strlen(HELD_SCENE)) == 0;
}

// A frame request on the wire, with what it points at.
struct frame {
    Bounced__FrameRequest request;
    Bounced__KeyValue sets[BD_CLI_SET_MAX];
    Bounced__KeyValue *set_pointers[BD_CLI_SET_MAX];
    char *keys[BD_CLI_SET_MAX]; // owned: argv's KEY=VALUE, cut at the equals sign
    uint32_t size[2];
};

static enum bd_err fill_sets(struct frame *frame, const struct bd_cli_render *options,
                             struct bd_fault *fault)
{
    for (uint32_t i = 0; i < options->set_count; i++) {
        char *key = strdup(options->sets[i]);
        if (!key) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "set", "no memory for --set");
        frame->keys[i] = key;
        char *equals = strchr(key, '=');
        *equals = 0;
        bounced__key_value__init(&frame->sets[i]);
        frame->sets[i].key = key;
        frame->sets[i].value = equals + 1;
        frame->set_pointers[i] = &frame->sets[i];
        frame->request.n_parameters++;
    }
    frame->request.parameters = frame->set_pointers;
    return BD_ERR_OK;
}

static enum bd_err fill_frame(struct frame *frame, const struct bd_cli_render *options,
                              struct bd_fault *fault)
{
    *frame = (struct frame){.request = BOUNCED__FRAME_REQUEST__INIT};
    Bounced__FrameRequest *request = &frame->request;
    request->technique = (char *)options->technique;
    request->camera = (char *)options->camera;
    request->exposure = (char *)options->exposure;
    request->tonemap = (char *)options->tonemap;
    request->fresh = (char *)options->fresh;
    request->encoding = (char *)bd_cli_format_name(options->format);
    if (options->width_px) {
        frame->size[0] = options->width_px;
        frame->size[1] = options->height_px;
        request->n_size = 2;
        request->size = frame->size;
    }
    request->n_layers = options->layer_count;
    request->layers = (char **)(void *)options->layers;
    request->has_aa = request->has_seed = request->has_plan_only = 1;
    request->aa = options->aa;
    request->seed = options->seed;
    request->plan_only = options->plan;
    request->has_deadline_ms = options->deadline_ms != 0;
    request->deadline_ms = options->deadline_ms;
    return fill_sets(frame, options, fault);
}

static void frame_finish(struct frame *frame)
{
    for (size_t i = 0; i < BD_CLI_SET_MAX; i++) free(frame->keys[i]);
}

static void on_stage(void *user, const char *stage)
{
    bd_cli_progress_stage(user, stage);
}

static void on_tick(void *user)
{
    bd_cli_progress_tick(user);
}

static enum bd_err ask(struct bd_cli_conn *conn, Bounced__Render *render,
                       const struct bd_cli_render *options, struct bd_cli_progress *progress,
                       struct bd_cli_answer *answer, struct bd_fault *fault)
{
    struct frame frame;
    enum bd_err err = fill_frame(&frame, options, fault);
    if (!err) {
        Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
        envelope.body_case = BOUNCED__ENVELOPE__BODY_RENDER;
        envelope.render = render;
        render->frame = &frame.request;
        render->has_progress = 1;
        render->progress = !options->common.quiet;
        const struct bd_cli_conn_watch watch = {on_stage, on_tick, progress};
        err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_RENDER_REPLY,
                               &watch, answer, fault);
    }
    frame_finish(&frame);
    return err;
}

static void warn_missing(const struct bd_cli_files *files)
{
    for (const char *uri = files->missing; uri && *uri;) {
        int length = (int)strcspn(uri, "\n");
        fprintf(stderr, "bounce: %.*s: no such file beside the scene\n", length, uri);
        uri += length + 1;
    }
}

static enum bd_err render_file(struct bd_cli_conn *conn, const struct bd_cli_render *options,
                               const struct bd_cli_files *files, struct bd_cli_progress *progress,
                               struct bd_cli_answer *answer, struct bd_fault *fault)
{
    enum bd_err err = bd_cli_upload(conn, files, progress, fault);
    if (err) return err;
    Bounced__Render render = BOUNCED__RENDER__INIT;
    const char *slash = strrchr(options->scene, '/');
    render.name = (char *)(slash ? slash + 1 : options->scene);
    render.blob = files->items[0].blob;
    err = bd_cli_upload_table(files, &render.files, &render.n_files);
    if (err) return bd_fault_set(fault, err, "scene", "no memory for the table of files");
    err = ask(conn, &render, options, progress, answer, fault);
    bd_cli_upload_table_free(render.files);
    return err;
}

// The daemon first: a private one starts while the files are read here.
static enum bd_err open_and_render(const struct bd_cli_render *options, struct bd_cli_conn **conn,
                                   struct bd_cli_progress *progress, struct bd_cli_answer *answer,
                                   struct bd_fault *fault)
{
    enum bd_err err = bd_cli_conn_open(&options->common, BD_CLI_CONN_RUNNING_OR_START, conn, fault);
    if (err) return err;
    if (is_held_scene(options)) {
        Bounced__Render render = BOUNCED__RENDER__INIT;
        render.scene = (char *)options->scene + strlen(HELD_SCENE);
        return ask(*conn, &render, options, progress, answer, fault);
    }
    struct bd_cli_files files;
    err = bd_cli_files_collect(options->scene, &files, fault);
    if (err) return err;
    warn_missing(&files);
    err = render_file(*conn, options, &files, progress, answer, fault);
    bd_cli_files_finish(&files);
    return err;
}

static enum bd_err write_text(const char *path, const Bounced__Report *report,
                              struct bd_fault *fault)
{
    char *text = bd_cli_report_json(&report->base);
    if (!text) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "report", "no memory for the report");
    enum bd_err err = bd_cli_output_write(path, text, strlen(text), fault);
    free(text);
    return err;
}

static enum bd_err write_results(const struct bd_cli_render *options,
                                 const struct bd_cli_answer *answer, struct bd_fault *fault)
{
    const Bounced__Report *report = answer->envelope->render_reply->report;
    if (!report)
        return bd_fault_set(fault, BD_ERR_INTERNAL, "server", "an answer without a report");
    if (options->output && answer->message.payload_bytes == 0)
        return bd_fault_set(fault, BD_ERR_INTERNAL, "server", "an answer without a picture");
    enum bd_err err = BD_ERR_OK;
    if (options->output)
        err = bd_cli_output_write(options->output, answer->message.payload,
                                  answer->message.payload_bytes, fault);
    if (!err && options->report) err = write_text(options->report, report, fault);
    if (!err && options->common.json) err = write_text("-", report, fault);
    if (err) return err;
    if (!options->common.quiet) bd_cli_report_print_flags(report, stderr);
    bool stdout_is_free = !options->common.json &&
                          !(options->output && options->output[0] == '-' && !options->output[1]);
    if (stdout_is_free && (options->plan || !options->common.quiet))
        bd_cli_report_print(report, stdout);
    return BD_ERR_OK;
}

// What can be seen to fail before a daemon is started for it.
static enum bd_err check_scene(const struct bd_cli_render *options, struct bd_fault *fault)
{
    if (is_held_scene(options)) return BD_ERR_OK;
    uint64_t size_bytes = 0;
    int fd = bd_cli_open_regular(options->scene, &size_bytes, fault);
    if (fd < 0) return fault->err;
    close(fd);
    return BD_ERR_OK;
}

static enum bd_err check_outputs(const struct bd_cli_render *options, struct bd_fault *fault)
{
    enum bd_err err = options->output ? bd_cli_output_check(options->output, fault) : BD_ERR_OK;
    if (!err && options->report) err = bd_cli_output_check(options->report, fault);
    return err;
}

// A frame that its deadline or Ctrl-C stopped still has a report: how far it came.
static void write_report_of_failure(const struct bd_cli_render *options,
                                    const struct bd_cli_answer *answer)
{
    const Bounced__Envelope *envelope = answer->envelope;
    if (!options->report || !envelope || envelope->body_case != BOUNCED__ENVELOPE__BODY_ERROR)
        return;
    const Bounced__ErrorDetails *details = envelope->error->details;
    struct bd_fault fault;
    if (details && details->report && write_text(options->report, details->report, &fault))
        fprintf(stderr, "bounce: %s\n", fault.message);
}

int bd_cmd_render(const char *const *words, int count)
{
    struct bd_cli_render options;
    struct bd_fault fault = {0};
    enum bd_err err = bd_cli_parse_render(words, count, &options, &fault);
    if (!err && options.help) return bd_help_render();
    if (!err) err = check_outputs(&options, &fault);
    if (!err) err = check_scene(&options, &fault);
    struct bd_cli_conn *conn = NULL;
    struct bd_cli_answer answer = {0};
    struct bd_cli_progress progress;
    bd_cli_progress_init(&progress, options.common.quiet);
    if (!err) {
        err = open_and_render(&options, &conn, &progress, &answer, &fault);
        bd_cmd_name_scene(options.scene, &fault);
    }
    bd_cli_progress_clear(&progress);
    if (err)
        write_report_of_failure(&options, &answer);
    else
        err = write_results(&options, &answer, &fault);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    return err ? bd_cmd_fail(err, &fault, options.common.json) : 0;
}
