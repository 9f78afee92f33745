// Answers: what a command ends with.

#include "net/wire/answer.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"

void bd_answer_finish(struct bd_answer *answer)
{
    if (answer->envelope) bounced__envelope__free_unpacked(answer->envelope, NULL);
    free(answer->payload);
    *answer = (struct bd_answer){0};
}

char *bd_answer_text(const char *text)
{
    char *copy = strdup(text);
    BD_ASSERT(copy);
    return copy;
}

static void *new_message(size_t size)
{
    void *message = malloc(size);
    BD_ASSERT(message);
    return message;
}

#define NEW(name, prefix) Bounced__##name *prefix = new_message(sizeof *prefix);

struct bd_answer bd_answer_of(Bounced__Envelope__BodyCase body_case, void *body)
{
    NEW(Envelope, envelope)
    bounced__envelope__init(envelope);
    envelope->body_case = body_case;
    // All members of the oneof are pointers and lie in one place.
    envelope->error = body;
    return (struct bd_answer){.envelope = envelope};
}

struct bd_answer bd_answer_error(const struct bd_err_detail *detail)
{
    NEW(Error, error)
    bounced__error__init(error);
    error->code = bd_answer_text(bd_err_name(detail->err));
    error->message = bd_answer_text(detail->message);
    NEW(ErrorDetails, details)
    bounced__error_details__init(details);
    if (detail->field[0]) details->field = bd_answer_text(detail->field);
    error->details = details;
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_ERROR, error);
}

struct bd_answer bd_answer_done(void)
{
    NEW(Done, done)
    bounced__done__init(done);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_DONE, done);
}

struct bd_answer bd_answer_blob(uint64_t offset, bool complete)
{
    NEW(BlobReply, reply)
    bounced__blob_reply__init(reply);
    BD_SET(reply, offset, offset);
    BD_SET(reply, complete, complete);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_BLOB_REPLY, reply);
}

static char **text_list(size_t count)
{
    if (count == 0) return NULL;
    char **list = calloc(count, sizeof *list);
    BD_ASSERT(list);
    return list;
}

static char *hash_text(const uint8_t sha256[BD_SHA256_BYTES])
{
    char text[8 + BD_SHA256_HEX] = "sha256:";
    bd_sha256_hex(sha256, text + 7);
    return bd_answer_text(text);
}

// A placed camera or light goes by its own name, or its node's: what `camera=` takes.
static const char *placed_name(const struct bd_scene *scene, const struct bd_placement *placement,
                               const char *own_name)
{
    if (own_name[0] || placement->node == BD_NONE) return own_name;
    return scene->nodes[placement->node].name;
}

static void fill_names(Bounced__Scene *message, const struct bd_scene *scene)
{
    message->cameras = text_list(scene->placed_camera_count);
    for (uint32_t i = 0; i < scene->placed_camera_count; i++) {
        const struct bd_placement *placed = &scene->placed_cameras[i];
        message->cameras[message->n_cameras++] =
            bd_answer_text(placed_name(scene, placed, scene->cameras[placed->object].name));
    }
    message->lights = text_list(scene->placed_light_count);
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_placement *placed = &scene->placed_lights[i];
        message->lights[message->n_lights++] =
            bd_answer_text(placed_name(scene, placed, scene->lights[placed->object].name));
    }
    message->flags = text_list(scene->flags.count);
    for (uint32_t i = 0; i < scene->flags.count; i++)
        message->flags[message->n_flags++] = bd_answer_text(scene->flags.text[i]);
}

static void fill_counts(Bounced__Scene *message, const struct bd_scene *scene)
{
    NEW(SceneCounts, counts)
    bounced__scene_counts__init(counts);
    BD_SET(counts, triangles, scene->features.triangle_count);
    const struct bd_scene_counts there = bd_scene_count(scene);
    BD_SET(counts, nodes, there.nodes);
    BD_SET(counts, meshes, there.meshes);
    BD_SET(counts, materials, there.materials);
    BD_SET(counts, textures, there.textures);
    BD_SET(counts, lights, scene->placed_light_count);
    BD_SET(counts, cameras, scene->placed_camera_count);
    message->counts = counts;
}

static double *point_list(bd_dvec3 point)
{
    double *list = malloc(3 * sizeof *list);
    BD_ASSERT(list);
    list[0] = point.x;
    list[1] = point.y;
    list[2] = point.z;
    return list;
}

Bounced__Scene *bd_scene_message(const struct bd_store_entry *entry)
{
    NEW(Scene, message)
    bounced__scene__init(message);
    message->id = bd_answer_text(entry->id);
    message->name = bd_answer_text(entry->name);
    BD_SET(message, revision, entry->revision);
    if (entry->transient) BD_SET(message, transient, entry->transient);
    message->hash = hash_text(entry->scene->content_sha256);
    fill_names(message, entry->scene);
    fill_counts(message, entry->scene);
    message->n_bounds_min = message->n_bounds_max = 3;
    message->bounds_min = point_list(entry->scene->features.bounds_min);
    message->bounds_max = point_list(entry->scene->features.bounds_max);
    return message;
}

struct bd_answer bd_answer_scene(const struct bd_store_entry *entry)
{
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_SCENE, bd_scene_message(entry));
}

Bounced__Device *bd_device_message(const struct bd_sched_stats *stats)
{
    NEW(Device, device)
    bounced__device__init(device);
    device->name = bd_answer_text(stats->device_name);
    device->class_ = bd_answer_text(stats->device_class);
    BD_SET(device, software, stats->software);
    BD_SET(device, in_use, 1);
    BD_SET(device, memory_mib, stats->gpu_memory_limit_mib);
    return device;
}

// --- reports -------------------------------------------------------------------------------------

void *bd_answer_zeroed(size_t count, size_t item_bytes)
{
    void *bytes = calloc(count ? count : 1, item_bytes);
    BD_ASSERT(bytes);
    return bytes;
}

static void fill_parameters(Bounced__Report *message, const struct bd_param_list *params)
{
    message->parameters = bd_answer_zeroed(params->count, sizeof(Bounced__KeyValue *));
    for (uint32_t i = 0; i < params->count; i++) {
        Bounced__KeyValue *pair = bd_answer_zeroed(1, sizeof *pair);
        bounced__key_value__init(pair);
        pair->key = bd_answer_text(params->pairs[i].key);
        pair->value = bd_answer_text(params->pairs[i].value);
        message->parameters[message->n_parameters++] = pair;
    }
}

static void fill_device(Bounced__Report *message, const struct bd_report *report)
{
    Bounced__ReportDevice *device = bd_answer_zeroed(1, sizeof *device);
    bounced__report_device__init(device);
    device->name = bd_answer_text(report->device.name);
    device->class_ = bd_answer_text(report->device.device_class);
    BD_SET(device, software, report->device.software);
    message->device = device;
}

static void fill_time(Bounced__Report *message, const struct bd_report *report, double load_ms,
                      double encode_ms)
{
    Bounced__ReportTime *time = bd_answer_zeroed(1, sizeof *time);
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
    message->passes = bd_answer_zeroed(report->pass_count, sizeof(Bounced__ReportPass *));
    for (uint32_t i = 0; i < report->pass_count; i++) {
        Bounced__ReportPass *pass = bd_answer_zeroed(1, sizeof *pass);
        bounced__report_pass__init(pass);
        pass->name = bd_answer_text(report->passes[i].name);
        BD_SET(pass, ms, report->passes[i].ms);
        pass->state = bd_answer_text(bd_pass_state_name(report->passes[i].state));
        if (report->passes[i].sub_frames > 0)
            BD_SET(pass, sub_frames, report->passes[i].sub_frames);
        message->passes[message->n_passes++] = pass;
    }
    message->omitted = bd_answer_zeroed(report->omitted_count, sizeof(Bounced__ReportOmitted *));
    for (uint32_t i = 0; i < report->omitted_count; i++) {
        Bounced__ReportOmitted *omitted = bd_answer_zeroed(1, sizeof *omitted);
        bounced__report_omitted__init(omitted);
        omitted->pass = bd_answer_text(report->omitted[i].pass);
        omitted->reason = bd_answer_text(report->omitted[i].reason);
        message->omitted[message->n_omitted++] = omitted;
    }
}

static void fill_report_counts(Bounced__Report *message, const struct bd_report *report)
{
    Bounced__ReportCounts *counts = bd_answer_zeroed(1, sizeof *counts);
    bounced__report_counts__init(counts);
    BD_SET(counts, lights, report->counts.lights);
    BD_SET(counts, vpls, report->counts.vpls);
    BD_SET(counts, fragments, report->counts.fragments);
    BD_SET(counts, triangles, report->counts.triangles);
    if (report->counts.rays > 0) {
        BD_SET(counts, rays, report->counts.rays);
        BD_SET(counts, mrays_per_s, report->counts.mrays_per_s);
    }
    if (report->counts.screen_parts > 0) BD_SET(counts, screen_parts, report->counts.screen_parts);
    if (report->counts.subsplats_tested > 0) {
        BD_SET(counts, subsplats, report->counts.subsplats);
        BD_SET(counts, subsplats_tested, report->counts.subsplats_tested);
        BD_SET(counts, subsplats_split, report->counts.subsplats_split);
    }
    message->counts = counts;
    Bounced__ReportMemory *memory = bd_answer_zeroed(1, sizeof *memory);
    bounced__report_memory__init(memory);
    BD_SET(memory, gpu, report->memory_gpu_mib);
    BD_SET(memory, gpu_peak, report->memory_gpu_peak_mib);
    if (report->memory_reference_mib > 0) BD_SET(memory, reference, report->memory_reference_mib);
    message->memory_mib = memory;
}

static void fill_flags(Bounced__Report *message, const struct bd_report *report)
{
    message->flags = bd_answer_zeroed(report->flag_count, sizeof(char *));
    for (uint32_t i = 0; i < report->flag_count; i++)
        message->flags[message->n_flags++] = bd_answer_text(report->flags[i]);
}

static void fill_errors(Bounced__Report *message, const struct bd_report *report)
{
    message->error = bd_answer_zeroed(report->error_count, sizeof(Bounced__ReportError *));
    for (uint32_t i = 0; i < report->error_count; i++) {
        Bounced__ReportError *error = bd_answer_zeroed(1, sizeof *error);
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
    Bounced__Report *message = bd_answer_zeroed(1, sizeof *message);
    bounced__report__init(message);
    message->scene = bd_answer_text(report->scene);
    BD_SET(message, revision, revision);
    message->size = bd_answer_zeroed(2, sizeof *message->size);
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
    fill_report_counts(message, report);
    fill_flags(message, report);
    fill_errors(message, report);
    BD_SET(message, nonfinite_pixels, report->nonfinite_pixels);
    if (exposure_stops) BD_SET(message, exposure_stops, (double)*exposure_stops);
    if (report->has_own_estimate) BD_SET(message, own_estimate, report->own_estimate);
    if (report->has_own_estimate) BD_SET(message, shown_estimate, report->shown_estimate);
    if (report->executor[0]) message->executor = bd_answer_text(report->executor);
    message->stopped = bd_answer_text(bd_stopped_name(report->stopped));
    return message;
}
