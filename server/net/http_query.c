// The query of a frame: NAME=VALUE pairs into the schema's Render.

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/nearest.h"
#include "net/answer.h"
#include "net/http_route.h"

#define PAIRS_MAX 256

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

bool bd_http_query_decode(char *text)
{
    char *out = text;
    for (const char *at = text; *at; at++) {
        char c = *at == '+' ? ' ' : *at;
        if (c == '%') {
            int high = hex_digit(at[1]);
            int low = high < 0 ? -1 : hex_digit(at[2]);
            if (low < 0 || (high == 0 && low == 0)) return false;
            c = (char)(high * 16 + low);
            at += 2;
        }
        *out++ = c;
    }
    *out = 0;
    return true;
}

bool bd_http_query_number(const char *text, uint64_t most, uint64_t *out)
{
    char *end;
    if (*text < '0' || *text > '9') return false;
    errno = 0;
    *out = strtoull(text, &end, 10);
    return !errno && *end == 0 && *out <= most;
}

static bool read_u32(const char *text, uint32_t *out)
{
    uint64_t wide;
    if (!bd_http_query_number(text, UINT32_MAX, &wide)) return false;
    *out = (uint32_t)wide;
    return true;
}

static bool read_flag(const char *text, protobuf_c_boolean *out)
{
    *out = strcmp(text, "1") == 0;
    return *out || strcmp(text, "0") == 0;
}

static void replace_text(char **field, const char *value)
{
    free(*field);
    *field = bd_answer_text(value);
}

static bool read_size(char *value, Bounced__FrameRequest *request)
{
    char *x = strchr(value, 'x');
    uint32_t size[2];
    if (!x) return false;
    *x = 0;
    bool good = read_u32(value, &size[0]) && read_u32(x + 1, &size[1]);
    *x = 'x';
    if (!good) return false;
    if (!request->size) request->size = malloc(sizeof size);
    BD_ASSERT(request->size);
    memcpy(request->size, size, sizeof size);
    request->n_size = 2;
    return true;
}

static void grow(void **list, size_t count, size_t size)
{
    void *grown = realloc(*list, (count + 1) * size);
    BD_ASSERT(grown);
    *list = grown;
}

static bool add_parameter(char *value, Bounced__FrameRequest *request)
{
    char *equals = strchr(value, '=');
    if (!equals) return false;
    Bounced__KeyValue *pair = malloc(sizeof *pair);
    BD_ASSERT(pair);
    bounced__key_value__init(pair);
    *equals = 0;
    pair->key = bd_answer_text(value);
    pair->value = bd_answer_text(equals + 1);
    grow((void **)&request->parameters, request->n_parameters, sizeof(Bounced__KeyValue *));
    request->parameters[request->n_parameters++] = pair;
    return true;
}

static bool add_layers(char *value, Bounced__FrameRequest *request)
{
    char *rest = NULL;
    for (char *name = strtok_r(value, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        grow((void **)&request->layers, request->n_layers, sizeof(char *));
        request->layers[request->n_layers++] = bd_answer_text(name);
    }
    return true;
}

static bool set_camera(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->camera, value);
    return true;
}

static bool set_technique(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->technique, value);
    return true;
}

static bool set_exposure(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->exposure, value);
    return true;
}

static bool set_tonemap(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->tonemap, value);
    return true;
}

static bool set_region(char *value, Bounced__FrameRequest *request)
{
    uint32_t region[4];
    for (int i = 0; i < 4; i++) {
        char *comma = strchr(value, ',');
        if ((i < 3) != (comma != NULL)) return false;
        if (comma) *comma = 0;
        if (!read_u32(value, &region[i])) return false;
        value = comma ? comma + 1 : value;
    }
    if (!request->region) request->region = malloc(sizeof region);
    BD_ASSERT(request->region);
    memcpy(request->region, region, sizeof region);
    request->n_region = 4;
    return true;
}

static bool set_encoding(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->encoding, strcmp(value, "json") == 0 ? "none" : value);
    return true;
}

static bool set_aa(char *value, Bounced__FrameRequest *request)
{
    request->has_aa = read_u32(value, &request->aa);
    return request->has_aa;
}

static bool set_seed(char *value, Bounced__FrameRequest *request)
{
    request->has_seed = bd_http_query_number(value, UINT64_MAX, &request->seed);
    return request->has_seed;
}

static bool set_half(char *value, Bounced__FrameRequest *request)
{
    request->has_exr_half = read_flag(value, &request->exr_half);
    return request->has_exr_half;
}

static bool set_quality(char *value, Bounced__FrameRequest *request)
{
    request->has_jpeg_quality = read_u32(value, &request->jpeg_quality);
    return request->has_jpeg_quality;
}

static bool set_deadline(char *value, Bounced__FrameRequest *request)
{
    request->has_deadline_ms = read_u32(value, &request->deadline_ms);
    return request->has_deadline_ms;
}

static bool set_budget(char *value, Bounced__FrameRequest *request)
{
    request->has_budget_ms = read_u32(value, &request->budget_ms);
    return request->has_budget_ms;
}

static bool set_check(char *value, Bounced__FrameRequest *request)
{
    request->has_check = read_u32(value, &request->check);
    return request->has_check;
}

static bool set_target_error(char *value, Bounced__FrameRequest *request)
{
    char *end;
    request->target_error = strtod(value, &end);
    request->has_target_error = end != value && !*end;
    return request->has_target_error;
}

static bool set_against(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->against, value);
    return true;
}

static bool set_plan(char *value, Bounced__FrameRequest *request)
{
    request->has_plan_only = read_flag(value, &request->plan_only);
    return request->has_plan_only;
}

static bool set_fresh(char *value, Bounced__FrameRequest *request)
{
    replace_text(&request->fresh, value);
    return true;
}

static const struct option {
    const char *name;
    bool (*set)(char *value, Bounced__FrameRequest *request);
    const char *wanted;
} options[] = {
    {"size", read_size, "WIDTHxHEIGHT"},
    {"camera", set_camera, ""},
    {"technique", set_technique, ""},
    {"set", add_parameter, "KEY=VALUE"},
    {"layers", add_layers, ""},
    {"aa", set_aa, "a whole number"},
    {"seed", set_seed, "a whole number"},
    {"exposure", set_exposure, ""},
    {"tonemap", set_tonemap, ""},
    {"half", set_half, "0 or 1"},
    {"quality", set_quality, "a whole number"},
    {"region", set_region, "X,Y,WIDTH,HEIGHT"},
    {"deadline_ms", set_deadline, "a whole number"},
    {"budget_ms", set_budget, "a whole number"},
    {"check", set_check, "a whole number"},
    {"target_error", set_target_error, "per cent"},
    {"against", set_against, ""},
    {"plan", set_plan, "0 or 1"},
    {"fresh", set_fresh, ""},
    {"encoding", set_encoding, ""}, // last: where the path says it, the query may not
};
#define OPTION_COUNT (sizeof options / sizeof options[0])

// Their range is checked where an environment is read, whoever sent it.
static bool read_radiance(const char *text, Bounced__Environment *out)
{
    double radiance[3];
    for (int c = 0; c < 3; c++) {
        char *end;
        radiance[c] = strtod(text, &end);
        if (end == text || *end != (c < 2 ? ',' : 0)) return false;
        text = end + 1;
    }
    if (!out->radiance) out->radiance = malloc(sizeof radiance);
    BD_ASSERT(out->radiance);
    memcpy(out->radiance, radiance, sizeof radiance);
    out->n_radiance = 3;
    return true;
}

// Given twice, as numbers and as a map, it is both: the numbers are then a factor.
static bool set_environment(char *value, Bounced__Render *render)
{
    if (!render->environment) {
        render->environment = malloc(sizeof *render->environment);
        BD_ASSERT(render->environment);
        bounced__environment__init(render->environment);
    }
    if (strncmp(value, "sha256:", 7) != 0) return read_radiance(value, render->environment);
    replace_text(&render->environment->map, value);
    return true;
}

static enum bd_err refuse(const char *name, const char *wanted, const char *value,
                          struct bd_fault *fault)
{
    return bd_fault_set(fault, BD_ERR_USAGE, name, "%s is %s, not \"%.60s\"", name, wanted, value);
}

static enum bd_err refuse_name(const char *name, size_t option_count, struct bd_fault *fault)
{
    char hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, name);
    bd_nearest_consider(&nearest, "environment");
    for (size_t i = 0; i < option_count; i++) bd_nearest_consider(&nearest, options[i].name);
    return bd_fault_set(fault, BD_ERR_USAGE, name, "there is no option \"%.60s\"%s", name,
                        bd_nearest_hint(&nearest, hint));
}

static enum bd_err set_pair(const char *name, char *value, size_t option_count,
                            Bounced__Render *render, struct bd_fault *fault)
{
    // The one that is beside the frame.
    if (strcmp(name, "environment") == 0) {
        if (set_environment(value, render)) return BD_ERR_OK;
        return refuse(name, "R,G,B in cd/m^2, or sha256:HEX of a map", value, fault);
    }
    for (size_t i = 0; i < option_count; i++) {
        if (strcmp(name, options[i].name) != 0) continue;
        if (options[i].set(value, render->frame)) return BD_ERR_OK;
        return refuse(name, options[i].wanted, value, fault);
    }
    return refuse_name(name, option_count, fault);
}

static enum bd_err read_pairs(char *text, size_t option_count, Bounced__Render *render,
                              struct bd_fault *fault)
{
    char *rest = NULL;
    int count = 0;
    for (char *pair = strtok_r(text, "&", &rest); pair; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (!value || ++count > PAIRS_MAX)
            return bd_fault_set(fault, BD_ERR_USAGE, "query", "a query is up to %d NAME=VALUE",
                                PAIRS_MAX);
        *value++ = 0;
        if (!bd_http_query_decode(pair) || !bd_http_query_decode(value))
            return bd_fault_set(fault, BD_ERR_USAGE, "query", "the query has a broken %%-escape");
        enum bd_err err = set_pair(pair, value, option_count, render, fault);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static Bounced__Render *new_render(void)
{
    Bounced__Render *render = malloc(sizeof *render);
    BD_ASSERT(render);
    bounced__render__init(render);
    render->frame = malloc(sizeof *render->frame);
    BD_ASSERT(render->frame);
    bounced__frame_request__init(render->frame);
    return render;
}

enum bd_err bd_http_query_read(const char *query, const char *extension, Bounced__Render **out,
                               struct bd_fault *fault)
{
    Bounced__Render *render = new_render();
    char *text = bd_answer_text(query);
    const size_t option_count = extension[0] ? OPTION_COUNT - 1 : OPTION_COUNT;
    if (extension[0])
        replace_text(&render->frame->encoding, strcmp(extension, "json") == 0 ? "none" : extension);
    enum bd_err err = read_pairs(text, option_count, render, fault);
    free(text);
    if (err)
        bounced__render__free_unpacked(render, NULL);
    else
        *out = render;
    return err;
}

// Cuts "fps=NUMBER" out of a query. False if it is no number.
static bool take_fps(char *query, double *frames_per_second)
{
    for (char *at = query; *at;) {
        size_t length = strcspn(at, "&");
        char *next = at + length + (at[length] == '&');
        if (strncmp(at, "fps=", 4) != 0) {
            at = next;
            continue;
        }
        char *end;
        *frames_per_second = strtod(at + 4, &end);
        if (end == at + 4 || end != at + length) return false;
        memmove(at, next, strlen(next) + 1);
    }
    return true;
}

enum bd_err bd_http_query_read_stream(const char *query, Bounced__Render **out,
                                      double *frames_per_second, struct bd_fault *fault)
{
    char *text = bd_answer_text(query);
    *frames_per_second = 0;
    enum bd_err err = take_fps(text, frames_per_second)
                          ? bd_http_query_read(text, "jpg", out, fault)
                          : bd_fault_set(fault, BD_ERR_USAGE, "fps", "fps is a number");
    free(text);
    return err;
}
