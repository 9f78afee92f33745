// A frame's report as a message: interface.md's JSON falls out of its field names.

#include <stdlib.h>

#include "base/assert.h"
#include "net/wire/answer.h"

static void *new_zeroed(size_t count, size_t size)
{
    void *bytes = calloc(count ? count : 1, size);
    BD_ASSERT(bytes);
    return bytes;
}

static void fill_parameters(Bounced__Report *message, const struct bd_param_list *params)
{
    message->parameters = new_zeroed(params->count, sizeof(Bounced__KeyValue *));
    for (uint32_t i = 0; i < params->count; i++) {
        Bounced__KeyValue *pair = new_zeroed(1, sizeof *pair);
        bounced__key_value__init(pair);
        pair->key = bd_answer_text(params->pairs[i].key);
        pair->value = bd_answer_text(params->pairs[i].value);
        message->parameters[message->n_parameters++] = pair;
    }
}

static void fill_device(Bounced__Report *message, const struct bd_report *report)
{
    Bounced__ReportDevice *device = new_zeroed(1, sizeof *device);
    bounced__report_device__init(device);
    device->name = bd_answer_text(report->device.name);
    device->class_ = bd_answer_text(report->device.device_class);
    BD_SET(device, software, report->device.software);
    message->device = device;
}

static void fill_time(Bounced__Report *message, const struct bd_report *report, double load_ms,
                      double encode_ms)
{
    Bounced__ReportTime *time = new_zeroed(1, sizeof *time);
    bounced__report_time__init(time);
    BD_SET(time, total, report->time_ms.total + load_ms + encode_ms);
    BD_SET(time, load, report->time_ms.load + load_ms);
    BD_SET(time, compile, report->time_ms.compile);
    BD_SET(time, gpu, report->time_ms.gpu);
    BD_SET(time, check, report->time_ms.check);
    BD_SET(time, readback, report->time_ms.readback);
    BD_SET(time, encode, encode_ms);
    message->time_ms = time;
}

static void fill_passes(Bounced__Report *message, const struct bd_report *report)
{
    message->passes = new_zeroed(report->pass_count, sizeof(Bounced__ReportPass *));
    for (uint32_t i = 0; i < report->pass_count; i++) {
        Bounced__ReportPass *pass = new_zeroed(1, sizeof *pass);
        bounced__report_pass__init(pass);
        pass->name = bd_answer_text(report->passes[i].name);
        BD_SET(pass, ms, report->passes[i].ms);
        pass->state = bd_answer_text(bd_pass_state_name(report->passes[i].state));
        if (report->passes[i].sub_frames > 0)
            BD_SET(pass, sub_frames, report->passes[i].sub_frames);
        message->passes[message->n_passes++] = pass;
    }
    message->omitted = new_zeroed(report->omitted_count, sizeof(Bounced__ReportOmitted *));
    for (uint32_t i = 0; i < report->omitted_count; i++) {
        Bounced__ReportOmitted *omitted = new_zeroed(1, sizeof *omitted);
        bounced__report_omitted__init(omitted);
        omitted->pass = bd_answer_text(report->omitted[i].pass);
        omitted->reason = bd_answer_text(report->omitted[i].reason);
        message->omitted[message->n_omitted++] = omitted;
    }
}

static void fill_counts(Bounced__Report *message, const struct bd_report *report)
{
    Bounced__ReportCounts *counts = new_zeroed(1, sizeof *counts);
    bounced__report_counts__init(counts);
    BD_SET(counts, lights, report->counts.lights);
    BD_SET(counts, vpls, report->counts.vpls);
    BD_SET(counts, fragments, report->counts.fragments);
    BD_SET(counts, triangles, report->counts.triangles);
    if (report->counts.rays > 0) {
        BD_SET(counts, rays, report->counts.rays);
        BD_SET(counts, mrays_per_s, report->counts.mrays_per_s);
    }
    if (report->counts.subsplats_tested > 0) {
        BD_SET(counts, subsplats, report->counts.subsplats);
        BD_SET(counts, subsplats_tested, report->counts.subsplats_tested);
        BD_SET(counts, subsplats_split, report->counts.subsplats_split);
    }
    message->counts = counts;
    Bounced__ReportMemory *memory = new_zeroed(1, sizeof *memory);
    bounced__report_memory__init(memory);
    BD_SET(memory, gpu, report->memory_gpu_mib);
    BD_SET(memory, gpu_peak, report->memory_gpu_peak_mib);
    if (report->memory_reference_mib > 0) BD_SET(memory, reference, report->memory_reference_mib);
    message->memory_mib = memory;
}

static void fill_flags(Bounced__Report *message, const struct bd_report *report)
{
    message->flags = new_zeroed(report->flag_count, sizeof(char *));
    for (uint32_t i = 0; i < report->flag_count; i++)
        message->flags[message->n_flags++] = bd_answer_text(report->flags[i]);
}

static void fill_errors(Bounced__Report *message, const struct bd_report *report)
{
    message->error = new_zeroed(report->error_count, sizeof(Bounced__ReportError *));
    for (uint32_t i = 0; i < report->error_count; i++) {
        Bounced__ReportError *error = new_zeroed(1, sizeof *error);
        bounced__report_error__init(error);
        error->metric = bd_answer_text(report->errors[i].metric);
        BD_SET(error, value, report->errors[i].value);
        BD_SET(error, low, report->errors[i].low);
        BD_SET(error, high, report->errors[i].high);
        BD_SET(error, samples, report->errors[i].samples);
        error->against = bd_answer_text(report->errors[i].against);
        message->error[message->n_error++] = error;
    }
}

Bounced__Report *bd_report_message(const struct bd_report *report, uint64_t revision,
                                   double load_ms, double encode_ms, const float *exposure_stops)
{
    Bounced__Report *message = new_zeroed(1, sizeof *message);
    bounced__report__init(message);
    message->scene = bd_answer_text(report->scene);
    BD_SET(message, revision, revision);
    message->size = new_zeroed(2, sizeof *message->size);
    message->n_size = 2;
    message->size[0] = report->width_px;
    message->size[1] = report->height_px;
    message->camera = bd_answer_text(report->camera);
    message->technique = bd_answer_text(report->technique);
    fill_parameters(message, &report->params);
    BD_SET(message, seed, report->seed);
    BD_SET(message, aa, report->aa);
    fill_device(message, report);
    message->build = bd_answer_text(BD_VERSION);
    fill_time(message, report, load_ms, encode_ms);
    fill_passes(message, report);
    fill_counts(message, report);
    fill_flags(message, report);
    fill_errors(message, report);
    BD_SET(message, nonfinite_pixels, report->nonfinite_pixels);
    if (exposure_stops) BD_SET(message, exposure_stops, (double)*exposure_stops);
    if (report->has_own_estimate) BD_SET(message, own_estimate, report->own_estimate);
    if (report->executor[0]) message->executor = bd_answer_text(report->executor);
    message->stopped = bd_answer_text(bd_stopped_name(report->stopped));
    return message;
}
