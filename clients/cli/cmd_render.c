// `bounce render`.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/frame.h"
#include "clients/cli/help.h"
#include "clients/cli/output.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/report.h"
#include "clients/cli/source.h"

#define FEW_PIXELS ((uint64_t)512 * 512) // the default

// Better code of a software device would come too late.
static bool renders_little(const struct bd_cli_render *options)
{
    const Bounced__FrameRequest *frame = options->frame;
    const uint64_t pixels =
        frame->n_size == 2 ? (uint64_t)frame->size[0] * frame->size[1] : FEW_PIXELS;
    return pixels * frame->aa <= FEW_PIXELS && !frame->has_target_error;
}

// The daemon first: a private one starts while the files are read here.
static enum bd_err open_and_render(const struct bd_cli_render *options, struct bd_cli_conn **conn,
                                   struct bd_cli_progress *progress, struct bd_cli_answer *answer,
                                   struct bd_err_detail *detail)
{
    struct bd_cli_common common = options->common;
    common.quick_code = renders_little(options);
    enum bd_err err = bd_cli_conn_open(&common, BD_CLI_CONN_RUNNING_OR_START, conn, detail);
    if (err) return err;
    struct bd_cli_source source;
    err =
        bd_cli_source_send(&source, options->scene, options->environment, *conn, progress, detail);
    if (!err) {
        Bounced__Render render = BOUNCED__RENDER__INIT;
        bd_cli_source_fill_render(&source, &render);
        err = bd_cli_frame_ask(*conn, &render, options, progress, answer, detail);
    }
    bd_cli_source_finish(&source);
    return err;
}

static enum bd_err write_text(const char *path, const Bounced__Report *report,
                              struct bd_err_detail *detail)
{
    char *text = bd_cli_report_json(&report->base);
    if (!text) return bd_err_set(detail, BD_ERR_NO_MEMORY, "report", "no memory for the report");
    enum bd_err err = bd_cli_output_write(path, text, strlen(text), detail);
    free(text);
    return err;
}

static enum bd_err write_results(const struct bd_cli_render *options,
                                 const struct bd_cli_answer *answer, struct bd_err_detail *detail)
{
    const Bounced__Report *report = answer->envelope->render_reply->report;
    if (!report) return bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer without a report");
    if (options->output && answer->message.payload_bytes == 0)
        return bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer without a picture");
    enum bd_err err = BD_ERR_OK;
    if (options->output)
        err = bd_cli_output_write(options->output, answer->message.payload,
                                  answer->message.payload_bytes, detail);
    if (!err && options->report) err = write_text(options->report, report, detail);
    if (!err && options->common.json) err = write_text("-", report, detail);
    if (err) return err;
    if (!options->common.quiet) bd_cli_report_print_flags(report, stderr);
    bool stdout_is_free = !options->common.json &&
                          !(options->output && options->output[0] == '-' && !options->output[1]);
    if (stdout_is_free && (options->frame->plan_only || !options->common.quiet))
        bd_cli_report_print(report, stdout);
    return BD_ERR_OK;
}

static bool counts(const struct bd_cli_render *options, const char *text)
{
    enum bd_flag flag = bd_flag_of(text, (uint32_t)strlen(text));
    return options->strict || (flag < BD_FLAG_COUNT && options->fail_on >> flag & 1);
}

// The picture is there, and is not what was asked for: above the error, out of time, or flagged
// with what was not to be. Why is said whatever else is not.
static int exit_code(const struct bd_cli_render *options, const Bounced__Report *report)
{
    const char *stopped = report->stopped ? report->stopped : "";
    bool missed = strcmp(stopped, "floor") == 0 || strcmp(stopped, "deadline") == 0;
    if (missed && options->frame->has_target_error)
        bd_cli_print_line(stderr, "bounce: the target was not reached: %s", stopped);
    else if (missed)
        bd_cli_print_line(stderr, "bounce: not rendered as asked before the deadline");
    for (size_t i = 0; i < report->n_flags; i++) {
        if (!counts(options, report->flags[i])) continue;
        bd_cli_print_line(stderr, "bounce: failed for the flag %s", report->flags[i]);
        missed = true;
    }
    return missed ? bd_err_exit_code(BD_ERR_DEADLINE) : 0;
}

static enum bd_err check_outputs(const struct bd_cli_render *options, struct bd_err_detail *detail)
{
    enum bd_err err = options->output ? bd_cli_output_check(options->output, detail) : BD_ERR_OK;
    if (!err && options->report) err = bd_cli_output_check(options->report, detail);
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
    struct bd_err_detail detail;
    if (details && details->report && write_text(options->report, details->report, &detail))
        fprintf(stderr, "bounce: %s\n", detail.message);
}

int bd_cmd_render(const char *const *words, int count)
{
    struct bd_cli_render options;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_cli_parse_render(words, count, &options, &detail);
    if (!err && options.help) {
        bd_cli_frame_finish(&options.frame);
        return bd_help_render(options.common.json);
    }
    if (!err) err = check_outputs(&options, &detail);
    if (!err) err = bd_cli_source_check(options.scene, options.environment, &detail);
    struct bd_cli_conn *conn = NULL;
    struct bd_cli_answer answer = {0};
    struct bd_cli_progress progress;
    bd_cli_progress_init(&progress, options.common.quiet);
    if (!err) {
        err = open_and_render(&options, &conn, &progress, &answer, &detail);
        bd_cmd_name_scene(options.scene, &detail);
    }
    bd_cli_progress_clear(&progress);
    if (err)
        write_report_of_failure(&options, &answer);
    else
        err = write_results(&options, &answer, &detail);
    int code = err ? 0 : exit_code(&options, answer.envelope->render_reply->report);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    bd_cli_frame_finish(&options.frame);
    return err ? bd_cmd_fail(err, &detail, options.common.json) : code;
}
