// `bounce reference`: the samples of a picture in pieces of about two seconds, added up here and
// written every now and then, so that whatever ends the command leaves a file to go on from.

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/clock.h"
#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/help.h"
#include "clients/cli/interrupt.h"
#include "clients/cli/options.h"
#include "clients/cli/output.h"
#include "clients/cli/progress.h"
#include "clients/cli/reference_file.h"
#include "clients/cli/reference_report.h"
#include "clients/cli/source.h"

#define FIRST_PIECE_SPP 2u
// A piece lasts so long, and at least so many times what its way here costs beside the tracing.
#define PIECE_S         2.0
#define PIECE_OVERHEADS 5.0
#define GROWTH_MAX      8.0
// Between two writes, and that many times what a write takes: never for more than a tenth of the
// time.
#define WRITE_S       10.0
#define WRITE_LASTS   10.0
#define LINE_S        10.0

struct command {
    struct bd_cli_reference options;
    struct bd_cli_conn *conn;
    struct bd_cli_source source;
    struct bd_cli_progress progress;
    struct bd_cli_reference_file *file;
    struct bd_cli_reference_report report;
    uint64_t start_ns;    // of the first piece
    uint32_t start_spp;   // what the file had then
    uint32_t piece_spp;   // of the piece under way
    double sample_s;      // what a sample a pixel takes, by the last piece
    double overhead_s;    // what a piece takes beside
    double write_s;       // what the last write took
    uint64_t written_ns, line_ns;
    uint32_t written_spp; // what is on the disk
    bool wrote_filtered;
    bool has_spoken_json; // standard output has its one object
};

static double since_s(uint64_t start_ns)
{
    return 1e-3 * bd_ms_since(start_ns);
}

// --- asking ---------------------------------------------------------------------------------

static double remaining_s(const struct command *command, double traced_spp)
{
    double done = traced_spp - command->start_spp;
    double left = command->options.spp - traced_spp;
    double by_spp = done > 0 ? since_s(command->start_ns) * left / done : INFINITY;
    if (command->options.time_limit_s <= 0) return by_spp;
    return fmin(by_spp, fmax(command->options.time_limit_s - since_s(command->start_ns), 0));
}

static void describe_state(const struct command *command, double traced_spp, char *text,
                           size_t size)
{
    double left_s = remaining_s(command, traced_spp);
    int used = snprintf(text, size, "%.0f of %" PRIu32 " spp", traced_spp, command->options.spp);
    if (isfinite(left_s)) snprintf(text + used, size - (size_t)used, ", %.0f s left", ceil(left_s));
}

static void on_share(void *user, double share)
{
    struct command *command = user;
    char text[80];
    double spp = bd_cli_reference_file_spp(command->file) + share * command->piece_spp;
    describe_state(command, spp, text, sizeof text);
    bd_cli_progress_share(&command->progress, spp / command->options.spp, text);
}

// On a terminal the bar is redrawn; elsewhere a line every ten seconds.
static void show_state(struct command *command)
{
    char text[80];
    on_share(command, 0);
    if (command->progress.quiet || command->progress.terminal || since_s(command->line_ns) < LINE_S)
        return;
    command->piece_spp = 0;
    describe_state(command, bd_cli_reference_file_spp(command->file), text, sizeof text);
    fprintf(stderr, "bounce: %s\n", text);
    command->line_ns = bd_clock_ns();
}

// Two parameters more than the options', and what they point at.
struct samples {
    Bounced__KeyValue pairs[2];
    char text[2][16];
};

// The list is the caller's to free, what it points at is not.
static void add_samples(struct samples *samples, Bounced__FrameRequest *frame, uint32_t first,
                        uint32_t count)
{
    static const char *const keys[2] = {"spp", "first_sample"};
    const uint32_t values[2] = {count, first};
    Bounced__KeyValue **list = malloc((frame->n_parameters + 2) * sizeof *list);
    BD_ASSERT(list);
    for (size_t i = 0; i < frame->n_parameters; i++) list[i] = frame->parameters[i];
    for (int i = 0; i < 2; i++) {
        snprintf(samples->text[i], sizeof samples->text[i], "%" PRIu32, values[i]);
        samples->pairs[i] = (Bounced__KeyValue)BOUNCED__KEY_VALUE__INIT;
        samples->pairs[i].key = (char *)keys[i];
        samples->pairs[i].value = samples->text[i];
        list[frame->n_parameters++] = &samples->pairs[i];
    }
    frame->parameters = list;
}

// `spp` 0: the plan alone, which knows every option as it will be used.
static enum bd_err ask(struct command *command, uint32_t spp, uint32_t deadline_ms,
                       struct bd_cli_answer *answer, struct bd_err_detail *detail)
{
    static const char *const layers[] = {BD_CLI_REFERENCE_LAYERS};
    struct samples samples;
    Bounced__FrameRequest frame = *command->options.frame;
    frame.technique = (char *)"reference";
    frame.encoding = (char *)"exr";
    frame.has_exr_raw = frame.exr_raw = 1;
    frame.has_plan_only = 1;
    frame.plan_only = spp == 0;
    frame.n_layers = sizeof layers / sizeof layers[0];
    frame.layers = (char **)(void *)layers;
    frame.has_deadline_ms = deadline_ms != 0;
    frame.deadline_ms = deadline_ms;
    if (spp) add_samples(&samples, &frame, bd_cli_reference_file_spp(command->file), spp);
    Bounced__Render render = BOUNCED__RENDER__INIT;
    bd_cli_source_fill_render(&command->source, &render);
    render.frame = &frame;
    render.has_progress = render.progress = 1;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_RENDER;
    envelope.render = &render;
    const struct bd_cli_conn_watch watch = {.share = on_share, .user = command};
    enum bd_err err =
        bd_cli_conn_call(command->conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_RENDER_REPLY,
                         &watch, answer, detail);
    if (spp) free(frame.parameters);
    if (!err && !answer->envelope->render_reply->report)
        err = bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer without a report");
    return err;
}

// --- the file -------------------------------------------------------------------------------

static enum bd_err write_file(struct command *command, struct bd_err_detail *detail)
{
    struct bd_bytes bytes = {0};
    uint64_t start_ns = bd_clock_ns();
    bd_cli_reference_file_set_filters(command->file, command->options.filter_noise);
    enum bd_err err = bd_cli_reference_file_encode(command->file, &bytes, detail);
    if (!err)
        err = bd_cli_output_write(command->options.output, bytes.data, bytes.size_bytes, detail);
    bd_bytes_finish(&bytes);
    command->write_s = since_s(start_ns);
    command->written_ns = bd_clock_ns();
    if (!err) command->written_spp = bd_cli_reference_file_spp(command->file);
    if (!err) command->wrote_filtered = bd_cli_reference_file_filters(command->file);
    return err;
}

static enum bd_err read_file(struct command *command, int fd, size_t size,
                             struct bd_err_detail *detail)
{
    const char *path = command->options.output;
    void *bytes = size ? mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0) : MAP_FAILED;
    if (bytes == MAP_FAILED)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "output", "%.200s: %s", path,
                          size ? strerror(errno) : "empty");
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_cli_reference_file_add(command->file, bytes, size, &inner);
    munmap(bytes, size);
    if (!err) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "output",
                      "%.200s is there and no reference to go on from (%.150s); another -o, or "
                      "--force to start anew",
                      path, inner.message);
}

// What is there already, if it was made by the same options.
static enum bd_err resume(struct command *command, const Bounced__Report *plan,
                          struct bd_err_detail *detail)
{
    static const uint32_t everywhere[4] = {0};
    const Bounced__FrameRequest *frame = command->options.frame;
    const char *path = command->options.output;
    if (command->options.force || access(path, F_OK)) return BD_ERR_OK;
    uint64_t size = 0;
    int fd = bd_cli_open_regular(path, &size, detail);
    if (fd < 0) return detail->err;
    enum bd_err err = read_file(command, fd, size, detail);
    close(fd);
    if (!err)
        err = bd_cli_reference_report_match(plan, frame->n_region ? frame->region : everywhere,
                                            command->file, path, detail);
    command->written_spp = bd_cli_reference_file_spp(command->file);
    command->wrote_filtered = bd_cli_reference_file_filters(command->file);
    return err;
}

// --- pieces ---------------------------------------------------------------------------------

static uint32_t next_piece(const struct command *command)
{
    uint32_t left = command->options.spp - bd_cli_reference_file_spp(command->file);
    if (command->sample_s <= 0) return left < FIRST_PIECE_SPP ? left : FIRST_PIECE_SPP;
    double piece_s = fmax(PIECE_S, PIECE_OVERHEADS * command->overhead_s);
    if (command->options.time_limit_s > 0) {
        double left_s = command->options.time_limit_s - since_s(command->start_ns);
        piece_s = fmin(piece_s, left_s - command->overhead_s - command->write_s);
    }
    double spp = fmin(piece_s / command->sample_s, GROWTH_MAX * command->piece_spp);
    uint32_t even = spp < 2 ? 2 : 2 * (uint32_t)(fmin(spp, left) / 2);
    return even < left ? even : left;
}

static enum bd_err take_piece(struct command *command, const struct bd_cli_answer *answer,
                              uint64_t asked_ns, struct bd_err_detail *detail)
{
    const Bounced__Report *report = answer->envelope->render_reply->report;
    if (answer->message.payload_bytes == 0)
        return bd_err_set(detail, BD_ERR_INTERNAL, "server", "an answer without a picture");
    struct bd_err_detail inner = {0};
    enum bd_err err = bd_cli_reference_file_add(command->file, answer->message.payload,
                                                answer->message.payload_bytes, &inner);
    if (err)
        return bd_err_set(detail, BD_ERR_INTERNAL, "server", "the daemon's answer: %s",
                          inner.message);
    double traced_s = 1e-3 * bd_cli_reference_report_pass_ms(report, "trace");
    double once_s = 1e-3 * bd_cli_reference_report_pass_ms(report, "bvh");
    command->sample_s = traced_s / command->piece_spp;
    command->overhead_s = fmax(since_s(asked_ns) - traced_s - once_s, 0);
    return bd_cli_reference_report_add(&command->report, report, detail);
}

// Milliseconds that the next piece may take; 0 = as many as it needs. False: none are left.
static bool time_is_left(const struct command *command, uint32_t *deadline_ms)
{
    *deadline_ms = 0;
    if (command->options.time_limit_s <= 0) return true;
    double left_ms = 1e3 * (command->options.time_limit_s - since_s(command->start_ns));
    *deadline_ms = left_ms < 1 ? 0 : left_ms > 4e9 ? 4000000000u : (uint32_t)left_ms;
    return left_ms >= 1;
}

static enum bd_err trace_piece(struct command *command, uint32_t deadline_ms,
                               struct bd_err_detail *detail)
{
    struct bd_cli_answer answer = {0};
    uint64_t asked_ns = bd_clock_ns();
    command->piece_spp = next_piece(command);
    enum bd_err err = ask(command, command->piece_spp, deadline_ms, &answer, detail);
    if (!err) err = take_piece(command, &answer, asked_ns, detail);
    bd_cli_answer_finish(&answer);
    uint32_t piece_spp = command->piece_spp;
    if (!err) show_state(command);
    command->piece_spp = piece_spp;
    bool due = since_s(command->written_ns) > fmax(WRITE_S, WRITE_LASTS * command->write_s);
    return !err && due ? write_file(command, detail) : err;
}

static const char time_is_up[] = "deadline";

// Until there are enough samples, or no time is left, which `*stopped` then says.
static enum bd_err trace_pieces(struct command *command, const char **stopped,
                                struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    uint32_t deadline_ms;
    command->start_ns = command->written_ns = command->line_ns = bd_clock_ns();
    command->start_spp = bd_cli_reference_file_spp(command->file);
    bd_cli_progress_stage(&command->progress, "reference");
    while (!err && bd_cli_reference_file_spp(command->file) < command->options.spp) {
        if (bd_interrupted()) return bd_err_set(detail, BD_ERR_CANCELLED, "", "interrupted");
        if (!time_is_left(command, &deadline_ms)) {
            *stopped = time_is_up;
            return BD_ERR_OK;
        }
        err = trace_piece(command, deadline_ms, detail);
    }
    // The daemon keeps the limit to the millisecond; a file with samples in it keeps those.
    if (err != BD_ERR_DEADLINE) return err;
    if (bd_cli_reference_file_spp(command->file) == 0)
        return bd_err_set(detail, err, "time-limit",
                          "--time-limit %g: not even %u samples a pixel fit",
                          command->options.time_limit_s, FIRST_PIECE_SPP);
    *stopped = time_is_up;
    return BD_ERR_OK;
}

// --- the command ----------------------------------------------------------------------------

static enum bd_err open_scene(struct command *command, struct bd_err_detail *detail)
{
    const struct bd_cli_reference *options = &command->options;
    enum bd_err err =
        bd_cli_conn_open(&options->common, BD_CLI_CONN_RUNNING_OR_START, &command->conn, detail);
    if (!err)
        err = bd_cli_source_send(&command->source, options->scene, options->environment,
                                 command->conn, &command->progress, detail);
    return err;
}

static enum bd_err plan_and_resume(struct command *command, struct bd_err_detail *detail)
{
    struct bd_cli_answer answer = {0};
    bd_cli_progress_stage(&command->progress, "import");
    enum bd_err err = ask(command, 0, 0, &answer, detail);
    const Bounced__Report *plan = err ? NULL : answer.envelope->render_reply->report;
    if (!err) err = resume(command, plan, detail);
    if (!err) err = bd_cli_reference_report_begin(&command->report, plan, detail);
    bd_cli_answer_finish(&answer);
    return err;
}

static enum bd_err write_report(struct command *command, const char *stopped,
                                struct bd_err_detail *detail)
{
    const struct bd_cli_reference *options = &command->options;
    if (!options->report && !options->common.json) return BD_ERR_OK;
    char *text = bd_cli_reference_report_json(&command->report, command->file, stopped);
    if (!text) return bd_err_set(detail, BD_ERR_NO_MEMORY, "report", "no memory for the report");
    enum bd_err err = BD_ERR_OK;
    if (options->report) err = bd_cli_output_write(options->report, text, strlen(text), detail);
    if (!err && options->common.json) err = bd_cli_output_write("-", text, strlen(text), detail);
    command->has_spoken_json = options->common.json && !err;
    free(text);
    return err;
}

// What is in the file and how to get more of it, unless that is what was asked for.
static void say_how_far(const struct command *command, const char *why)
{
    if (command->options.common.quiet || !command->written_spp) return;
    fprintf(stderr, "bounce: %s%s%s has %" PRIu32 " spp", why, *why ? "; " : "",
            command->options.output, command->written_spp);
    if (command->written_spp < command->options.spp && command->options.has_spp)
        fprintf(stderr, " of %" PRIu32 "; the same command goes on from there",
                command->options.spp);
    fputc('\n', stderr);
}

static enum bd_err run(struct command *command, struct bd_err_detail *detail)
{
    const char *stopped = "complete";
    enum bd_err err = open_scene(command, detail);
    if (!err) err = plan_and_resume(command, detail);
    if (err) {
        bd_cmd_name_scene(command->options.scene, detail);
        return err;
    }
    enum bd_err traced = trace_pieces(command, &stopped, detail);
    bd_cli_progress_clear(&command->progress);
    // Whatever ended it: what there is is kept.
    struct bd_err_detail write_detail = {0};
    const bool is_new = bd_cli_reference_file_spp(command->file) > command->written_spp;
    if (is_new || (command->written_spp && command->wrote_filtered != command->options.filter_noise))
        err = write_file(command, &write_detail);
    if (err && !traced) *detail = write_detail;
    if (traced == BD_ERR_CANCELLED) stopped = "cancelled";
    if (!err && (!traced || traced == BD_ERR_CANCELLED))
        err = write_report(command, stopped, detail);
    say_how_far(command, traced == BD_ERR_CANCELLED ? "interrupted"
                         : stopped == time_is_up    ? "time is up"
                                                    : "");
    return traced ? traced : err;
}

int bd_cmd_reference(const char *const *words, int count)
{
    struct command command = {0};
    struct bd_err_detail detail = {0};
    struct bd_cli_reference *options = &command.options;
    enum bd_err err = bd_cli_parse_reference(words, count, options, &detail);
    if (!err && options->help) {
        bd_cli_frame_finish(&options->frame);
        return bd_help_reference();
    }
    if (!err) err = bd_cli_output_check(options->output, &detail);
    if (!err && options->report) err = bd_cli_output_check(options->report, &detail);
    if (!err) err = bd_cli_source_check(options->scene, options->environment, &detail);
    bd_cli_progress_init(&command.progress, options->common.quiet);
    command.file = bd_cli_reference_file_create();
    if (!err) err = run(&command, &detail);
    bd_cli_progress_clear(&command.progress);
    bd_cli_reference_report_finish(&command.report);
    bd_cli_reference_file_destroy(&command.file);
    bd_cli_source_finish(&command.source);
    bd_cli_conn_close(&command.conn);
    bd_cli_frame_finish(&options->frame);
    bool json = options->common.json && !command.has_spoken_json;
    return err ? bd_cmd_fail(err, &detail, json) : 0;
}
