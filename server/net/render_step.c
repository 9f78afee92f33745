// The steps from a scene to an image: a job on the scheduler, then encoding on the pool.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/command_internal.h"
#include "net/stats.h"

#define PRIORITY_INTERACTIVE 10

// On the render thread: only enqueue.
static void on_job_done(void *user, struct bd_job *job)
{
    struct bd_command *command = user;
    struct bd_net *net = command->net;
    (void)job;
    uv_mutex_lock(&net->ended_lock);
    command->next_waiting = net->ended;
    net->ended = command;
    // Under the lock: once it is open, the loop may take the command, end with it, and close.
    uv_async_send(&net->frames_ended);
    uv_mutex_unlock(&net->ended_lock);
}

// --- manifest -------------------------------------------------------------------------------

#define MANIFEST_ENTRY_MAX 16

struct manifest {
    struct bd_manifest_entry entries[MANIFEST_ENTRY_MAX];
    size_t count;
    char revision[24], seed[24], aa[16], region[48];
    char parameters[BD_PARAM_MAX * (BD_PARAM_KEY_MAX + BD_PARAM_VALUE_MAX)];
};

// PNG knows no empty text: what is empty is left out.
static void add_entry(struct manifest *manifest, const char *key, const char *value)
{
    if (!value[0]) return;
    BD_ASSERT_CMP(manifest->count, <, MANIFEST_ENTRY_MAX);
    manifest->entries[manifest->count++] = (struct bd_manifest_entry){key, value};
}

static void join_parameters(const struct bd_param_list *params, char *out, size_t size)
{
    size_t used = 0;
    out[0] = 0;
    for (uint32_t i = 0; i < params->count && used < size; i++)
        used += (size_t)snprintf(out + used, size - used, "%s%s=%s", i ? " " : "",
                                 params->pairs[i].key, params->pairs[i].value);
}

// Everything that makes the picture, nothing that varies with the run: the same request twice
// gives the same bytes.
static void fill_manifest(struct manifest *manifest, const struct bd_report *report,
                          uint64_t revision)
{
    snprintf(manifest->revision, sizeof manifest->revision, "%llu", (unsigned long long)revision);
    snprintf(manifest->seed, sizeof manifest->seed, "%llu", (unsigned long long)report->seed);
    snprintf(manifest->aa, sizeof manifest->aa, "%u", report->aa);
    if (report->region[2])
        snprintf(manifest->region, sizeof manifest->region, "%u,%u,%u,%u", report->region[0],
                 report->region[1], report->region[2], report->region[3]);
    join_parameters(&report->params, manifest->parameters, sizeof manifest->parameters);
    add_entry(manifest, "scene", report->scene);
    add_entry(manifest, "revision", manifest->revision);
    add_entry(manifest, "camera", report->camera);
    add_entry(manifest, "technique", report->technique);
    add_entry(manifest, "parameters", manifest->parameters);
    add_entry(manifest, "seed", manifest->seed);
    add_entry(manifest, "aa", manifest->aa);
    add_entry(manifest, "filter", report->filter);
    add_entry(manifest, "region", manifest->region);
    add_entry(manifest, "device_class", report->device.device_class);
    add_entry(manifest, "build", BD_VERSION);
}

// --- encode ---------------------------------------------------------------------------------

static void add_layer(struct bd_named_layer *layers, size_t *count,
                      const struct bd_job_result *result, enum bd_layer layer)
{
    if (!result->layers[layer]) return;
    layers[(*count)++] =
        (struct bd_named_layer){.name = bd_layer_name(layer), .image = result->layers[layer]};
}

// An EXR holds them all, beauty first. The others show one, and take the exposure from beauty.
static size_t choose_layers(const struct bd_command *command, const struct bd_job_result *result,
                            struct bd_named_layer layers[BD_LAYER_COUNT])
{
    size_t count = 0;
    if (command->options.encode.format == BD_ENCODE_EXR) {
        for (int layer = 0; layer < BD_LAYER_COUNT; layer++)
            add_layer(layers, &count, result, (enum bd_layer)layer);
        return count;
    }
    add_layer(layers, &count, result, command->options.shown);
    if (command->options.shown != BD_LAYER_BEAUTY)
        add_layer(layers, &count, result, BD_LAYER_BEAUTY);
    return count;
}

static void encode_on_pool(uv_work_t *work)
{
    struct bd_command *command = work->data;
    const struct bd_job_result *result = bd_job_result(command->job);
    struct bd_named_layer layers[BD_LAYER_COUNT];
    size_t layer_count = choose_layers(command, result, layers);
    struct manifest manifest = {0};
    fill_manifest(&manifest, &result->report, command->revision);
    struct bd_manifest pairs = {.entries = manifest.entries, .count = manifest.count};
    uint64_t start_ns = bd_clock_ns();
    command->err = bd_encode(&command->options.encode, layers, layer_count, &pairs,
                             &command->encoded, &command->fault);
    command->encode_ms = bd_ms_since(start_ns);
    uint64_t most = command->net->options.limits.reply_bytes;
    if (!command->err && command->encoded.bytes.size_bytes > most)
        command->err = bd_fault_set(&command->fault, BD_ERR_LIMIT, "reply_bytes",
                                    "the image of %zu bytes is above the limit reply_bytes of %llu",
                                    command->encoded.bytes.size_bytes, (unsigned long long)most);
}

// --- answer ---------------------------------------------------------------------------------

static Bounced__Report *report_message(struct bd_command *command)
{
    const struct bd_report *report = &bd_job_result(command->job)->report;
    bool has_exposure = command->encoded.bytes.size_bytes > 0;
    return bd_report_message(report, command->revision, command->load_ms, command->encode_ms,
                             has_exposure ? &command->encoded.exposure_stops : NULL);
}

static void answer_frame(struct bd_command *command)
{
    struct bd_encoded *encoded = &command->encoded;
    Bounced__RenderReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__render_reply__init(reply);
    reply->report = report_message(command);
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_RENDER_REPLY, reply);
    if (encoded->bytes.size_bytes > 0) {
        enum bd_encode_format format = command->options.encode.format;
        reply->encoding = bd_answer_text(bd_encode_format_name(format));
        answer.payload = encoded->bytes.data;
        answer.payload_bytes = encoded->bytes.size_bytes;
        answer.payload_type = bd_encode_content_type(format);
        encoded->bytes = (struct bd_bytes){0};
    }
    bd_net_count_frame(command->net, &bd_job_result(command->job)->report);
    bd_command_end(command, &answer);
}

// A frame that its deadline or a cancel stopped: the error carries how far it came.
static void answer_stopped(struct bd_command *command)
{
    struct bd_answer answer = bd_answer_error(&command->fault);
    if (command->err == BD_ERR_DEADLINE || command->err == BD_ERR_CANCELLED)
        answer.envelope->error->details->report = report_message(command);
    bd_command_end(command, &answer);
}

static void encode_back(uv_work_t *work, int status)
{
    struct bd_command *command = work->data;
    BD_ASSERT_CMP(status, ==, 0);
    if (!bd_command_stop_here(command)) answer_frame(command);
}

static void frame_ended(struct bd_command *command)
{
    const struct bd_job_result *result = bd_job_result(command->job);
    command->err = result->err;
    command->fault = result->fault;
    if (command->err && command->fault.err != command->err)
        bd_fault_set(&command->fault, command->err, "", "the frame ended: %s",
                     bd_err_name(command->err));
    if (command->err) {
        answer_stopped(command);
    } else if (command->options.frame.plan_only || !command->options.wants_image) {
        if (!bd_command_stop_here(command)) answer_frame(command);
    } else if (!bd_command_stop_here(command)) {
        bd_command_progress(command, "encode");
        bd_command_pool(command, encode_on_pool, encode_back);
    }
}

void bd_command_collect_frames(struct bd_net *net)
{
    uv_mutex_lock(&net->ended_lock);
    struct bd_command *ended = net->ended;
    net->ended = NULL;
    uv_mutex_unlock(&net->ended_lock);
    while (ended) {
        struct bd_command *command = ended;
        ended = command->next_waiting;
        frame_ended(command);
    }
}

// --- submit ---------------------------------------------------------------------------------

// The client's deadline began when its request arrived; the scheduler's begins now.
static enum bd_err spend_deadline(struct bd_command *command)
{
    struct bd_frame_request *frame = &command->options.frame;
    if (frame->deadline_ms == 0) return BD_ERR_OK;
    double spent_ms = bd_ms_since(command->start_ns);
    if (spent_ms >= frame->deadline_ms)
        return bd_fault_set(&command->fault, BD_ERR_DEADLINE, "deadline_ms",
                            "the deadline of %u ms passed while the scene was loaded",
                            frame->deadline_ms);
    frame->deadline_ms -= (uint32_t)spent_ms;
    return BD_ERR_OK;
}

void bd_command_render(struct bd_command *command)
{
    command->err = spend_deadline(command);
    if (bd_command_stop_here(command)) return;
    struct bd_job_request request = {.scene = command->scene,
                                     .frame = command->options.frame,
                                     .priority = PRIORITY_INTERACTIVE,
                                     .done = on_job_done,
                                     .user = command};
    bd_command_progress(command, "queue");
    command->err =
        bd_sched_submit(command->net->options.sched, &request, &command->job, &command->fault);
    if (bd_command_stop_here(command)) return;
}
