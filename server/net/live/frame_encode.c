#include "net/live/frame_encode.h"

#include <stdio.h>

#include "base/assert.h"
#include "base/clock.h"

#define MANIFEST_ENTRY_MAX 16
#define POSE_BYTES         256

struct manifest {
    struct bd_manifest_entry entries[MANIFEST_ENTRY_MAX];
    size_t count;
    char revision[24], seed[24], aa[16], region[48], pose[POSE_BYTES];
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

// Digits that give the same numbers back.
static void join_pose(const struct bd_pose *pose, char out[POSE_BYTES])
{
    const double numbers[] = {pose->eye_m.x,    pose->eye_m.y,    pose->eye_m.z, pose->target_m.x,
                              pose->target_m.y, pose->target_m.z, pose->up.x,    pose->up.y,
                              pose->up.z,       pose->yfov};
    size_t used = 0;
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        used += (size_t)snprintf(out + used, POSE_BYTES - used, "%s%.17g", i ? " " : "", numbers[i]);
}

// Everything that makes the picture, nothing that varies with the run: the same request twice
// gives the same bytes.
static void fill_manifest(struct manifest *manifest, const struct bd_report *report,
                          const struct bd_pose *pose, uint64_t revision)
{
    snprintf(manifest->revision, sizeof manifest->revision, "%llu", (unsigned long long)revision);
    snprintf(manifest->seed, sizeof manifest->seed, "%llu", (unsigned long long)report->seed);
    snprintf(manifest->aa, sizeof manifest->aa, "%u", report->aa);
    if (report->region[2])
        snprintf(manifest->region, sizeof manifest->region, "%u,%u,%u,%u", report->region[0],
                 report->region[1], report->region[2], report->region[3]);
    if (pose->is_set) join_pose(pose, manifest->pose);
    join_parameters(&report->params, manifest->parameters, sizeof manifest->parameters);
    add_entry(manifest, "scene", report->scene);
    add_entry(manifest, "revision", manifest->revision);
    add_entry(manifest, "camera", report->camera);
    add_entry(manifest, "pose", manifest->pose);
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

// What the frame's own request did not ask for was made for the exposure.
static bool is_asked(const struct bd_frame_options *options, enum bd_layer layer)
{
    return layer == BD_LAYER_BEAUTY || (options->frame.layers >> layer & 1);
}

// An EXR holds them all, beauty first. The others show one, and take the exposure from beauty.
static size_t choose_layers(const struct bd_frame_options *options,
                            const struct bd_job_result *result,
                            struct bd_named_layer layers[BD_LAYER_COUNT])
{
    size_t count = 0;
    if (options->encode.format == BD_ENCODE_EXR) {
        for (int layer = 0; layer < BD_LAYER_COUNT; layer++)
            if (is_asked(options, (enum bd_layer)layer))
                add_layer(layers, &count, result, (enum bd_layer)layer);
        return count;
    }
    add_layer(layers, &count, result, options->shown);
    if (options->shown != BD_LAYER_BEAUTY)
        add_layer(layers, &count, result, BD_LAYER_BEAUTY);
    return count;
}

// Where indirect light comes through walls, automatic exposure follows the rest.
static struct bd_encode_request encode_request_of(const struct bd_frame_encode *frame)
{
    struct bd_encode_request request = frame->options->encode;
    struct bd_image *const *layers = frame->result->layers;
    if (!request.exposure_auto || !frame->result->report.unoccluded || !layers[BD_LAYER_DIRECT])
        return request;
    request.exposure_auto = false;
    request.exposure_stops = bd_exposure_auto_lit(
        layers[BD_LAYER_DIRECT], layers[BD_LAYER_EMISSION], layers[BD_LAYER_BEAUTY]);
    return request;
}

enum bd_err bd_frame_encode(const struct bd_frame_encode *frame, struct bd_encoded *out,
                            double *encode_ms, struct bd_err_detail *detail)
{
    const struct bd_job_result *result = frame->result;
    struct bd_named_layer layers[BD_LAYER_COUNT];
    size_t layer_count = choose_layers(frame->options, result, layers);
    struct manifest manifest = {0};
    fill_manifest(&manifest, &result->report, &frame->options->frame.pose, frame->revision);
    struct bd_manifest pairs = {.entries = manifest.entries, .count = manifest.count};
    uint64_t start_ns = bd_clock_ns();
    const struct bd_encode_request request = encode_request_of(frame);
    enum bd_err err = bd_encode(&request, layers, layer_count, &pairs, out, detail);
    *encode_ms = bd_ms_since(start_ns);
    if (!err && out->bytes.size_bytes > frame->bytes_max)
        err = bd_err_set(detail, BD_ERR_LIMIT, "reply_bytes",
                         "the image of %zu bytes is above the limit reply_bytes of %llu",
                         out->bytes.size_bytes, (unsigned long long)frame->bytes_max);
    return err;
}
