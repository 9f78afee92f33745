#include "protocol/frame_options.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "base/nearest.h"
#include "image/tonemap.h"
#include "protocol/field_text.h"
#include "protocol/frame_words.h"

// --- the table ----------------------------------------------------------------------------------

static const char *const tonemaps[] = {BD_TONEMAP_WORDS, NULL};
static const char *const encodings[] = {"png", "jpeg", "jpg", "exr", "half", "none", NULL};
static const char *const fresh[] = {BD_FRESH_WORDS, NULL};
static const char *const against[] = {BD_AGAINST_WORDS, NULL};
static const char *const automatic[] = {"auto", NULL};

const struct bd_frame_option bd_frame_options[] = {
    {.name = "size",
     .form = "WxH",
     .count = 2,
     .between = 'x',
     .standard = "512x512",
     .help = "pixels"},
    {.name = "camera",
     .form = "NAME|INDEX",
     .standard = "the scene's first, or one that frames it",
     .help = "a node's name, a camera's, or its index"},
    {.name = "pose",
     .form = "EYE,TARGET[,UP][,YFOV]",
     .standard = "up +y, yfov that of the scene's first camera",
     .help = "instead of a camera: 6, 7, 9 or 10 numbers, places in metres, the vertical angle in "
             "radians"},
    {.name = "technique",
     .form = "NAME",
     .standard =
         "auto: many_light, in steps until its own estimate of the picture's error is below "
         "5 %, or one that reads the parameters that are given",
     .help = "`bounce techniques` lists them"},
    {.name = "parameters",
     .alias = "set",
     .form = "KEY=VALUE",
     .help = "of the technique; repeatable: vpls=256"},
    {.name = "aa",
     .form = "N",
     .least = 1,
     .most = 4096,
     .standard = "1; by `bounce` 16 to PNG and JPEG",
     .help = "sub-frames averaged"},
    {.name = "layers",
     .form = "A,B,C",
     .standard = "beauty",
     .help = "beauty,direct,indirect,emission,albedo,normal,depth,noise,blur: an EXR holds all of "
             "them, other pictures one"},
    {.name = "exposure",
     .form = "auto|STOPS",
     .words = automatic,
     .or_number = true,
     .least = -(double)BD_EXPOSURE_STOPS_MAX,
     .most = (double)BD_EXPOSURE_STOPS_MAX,
     .standard = "auto",
     .help = "of PNG and JPEG: pixel = luminance * 2^stops"},
    {.name = "tonemap",
     .form = "NAME",
     .words = tonemaps,
     .standard = "neutral",
     .help = "of PNG and JPEG"},
    {.name = "encoding",
     .form = "NAME",
     .words = encodings,
     .standard = "png; of a view jpeg",
     .help = "half: four 16-bit floats a pixel; none: the report alone"},
    {.name = "jpeg_quality",
     .alias = "quality",
     .form = "N",
     .least = 1,
     .most = 100,
     .standard = "90",
     .help = "of JPEG"},
    {.name = "exr_half",
     .alias = "half",
     .standard = "32 bits",
     .help = "EXR with 16 bits a channel where these hold it"},
    {.name = "exr_raw",
     .standard = "compressed",
     .help = "EXR that is not compressed, for who reads it at once"},
    {.name = "seed", .form = "N", .standard = "0", .help = "same seed, same bytes"},
    {.name = "deadline_ms",
     .form = "N",
     .of_now = true,
     .standard = "0: none",
     .help = "after this long what stands: the technique's cheapest settings (flag deadline_rung), "
             "with target_error the best so far"},
    {.name = "budget_ms",
     .form = "N",
     .of_one = true,
     .of_now = true,
     .standard = "0: none",
     .help = "the best settings that so many milliseconds of rendering are good for (flag "
             "chosen_by_clock)"},
    {.name = "check",
     .form = "N[:full|:model]",
     .least = 16,
     .most = 65536,
     .or_none = true,
     .of_one = true,
     .standard = "0: none",
     .help =
         "estimate the relative RMSE from N pixels that the reference traces: against the whole "
         "rendering equation and the technique's own model, which leaves out what no setting "
         "brings back"},
    {.name = "target_error",
     .form = "PCT[:full|:model]",
     .least = 1e-6,
     .most = 1e4,
     .of_one = true,
     .of_now = true,
     .standard = "none",
     .help = "per cent: better and better parameters until the error is below, from those that are "
             "given on, or a line with what reaches it"},
    {.name = "against",
     .form = "NAME",
     .words = against,
     .standard = "full",
     .help = "which of the two errors decides"},
    {.name = "region",
     .form = "X,Y,WIDTH,HEIGHT",
     .count = 4,
     .between = ',',
     .standard = "all",
     .help = "technique reference: trace only these pixels"},
    {.name = "fresh",
     .form = "none|camera|all",
     .words = fresh,
     .of_now = true,
     .standard = "none",
     .help =
         "to time a frame: take nothing over from earlier ones of the camera's side, or nothing "
         "at all but the uploaded scene"},
    {.name = "plan_only",
     .alias = "plan",
     .of_one = true,
     .of_now = true,
     .standard = "no",
     .help = "what would run and what is left out; nothing is rendered"},
};
const uint32_t bd_frame_option_count = sizeof bd_frame_options / sizeof bd_frame_options[0];

static const ProtobufCFieldDescriptor *field_of(const struct bd_frame_option *option)
{
    const ProtobufCFieldDescriptor *field = protobuf_c_message_descriptor_get_field_by_name(
        &bounced__frame_request__descriptor, option->name);
    BD_ASSERT(field);
    return field;
}

static bool is_name(const char *name, const char *given)
{
    for (; *name && (*given == *name || (*given == '-' && *name == '_')); name++) given++;
    return !*name && !*given;
}

const struct bd_frame_option *bd_frame_option_named(const char *name, struct bd_err_detail *detail)
{
    char hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, name);
    for (uint32_t i = 0; i < bd_frame_option_count; i++) {
        const struct bd_frame_option *option = &bd_frame_options[i];
        if (is_name(option->name, name) || (option->alias && is_name(option->alias, name)))
            return option;
        bd_nearest_consider(&nearest, option->name);
    }
    bd_err_set(detail, BD_ERR_USAGE, name, "there is no option \"%.60s\"%s", name,
               bd_nearest_hint(&nearest, hint));
    return NULL;
}

bool bd_frame_option_is_flag(const struct bd_frame_option *option)
{
    return !option->form;
}

int bd_frame_option_word(const struct bd_frame_option *option, const char *text)
{
    for (int i = 0; option->words && option->words[i]; i++)
        if (strcasecmp(option->words[i], text) == 0) return i;
    return -1;
}

// --- what it takes ------------------------------------------------------------------------------

static void list_words(const struct bd_frame_option *option, char *out, size_t bytes)
{
    for (uint32_t i = 0; option->words[i]; i++) {
        const char *before = i == 0                                      ? ""
                             : option->words[i + 1] || option->or_number ? ", "
                                                                         : " or ";
        const size_t used = strlen(out);
        snprintf(out + used, bytes - used, "%s%s", before, option->words[i]);
    }
}

static void list_range(const struct bd_frame_option *option, bool whole, char *out, size_t bytes)
{
    const size_t used = strlen(out);
    const char *before = option->words ? ", or " : "";
    const char *what = whole ? "a whole number" : option->words ? "stops" : "a number";
    if (option->least < option->most)
        snprintf(out + used, bytes - used, "%s%s from %.9g to %.9g%s", before, what, option->least,
                 option->most, option->or_none ? ", or 0" : "");
    else
        snprintf(out + used, bytes - used, "%s%s", before, what);
}

const char *bd_frame_option_takes(const struct bd_frame_option *option,
                                  char out[BD_FRAME_OPTION_TAKES_BYTES])
{
    const ProtobufCType type = field_of(option)->type;
    const bool whole = type == PROTOBUF_C_TYPE_UINT32 || type == PROTOBUF_C_TYPE_UINT64;
    *out = 0;
    if (option->words) list_words(option, out, BD_FRAME_OPTION_TAKES_BYTES);
    if (option->or_number || type == PROTOBUF_C_TYPE_DOUBLE || (whole && option->count == 0))
        list_range(option, whole, out, BD_FRAME_OPTION_TAKES_BYTES);
    if (!*out)
        snprintf(out, BD_FRAME_OPTION_TAKES_BYTES, "%s", option->form ? option->form : "0 or 1");
    return out;
}

static enum bd_err refuse(const struct bd_frame_option *option, const char *given,
                          struct bd_err_detail *detail)
{
    char takes[BD_FRAME_OPTION_TAKES_BYTES];
    return bd_err_set(detail, BD_ERR_USAGE, option->name, "%s is %s, not \"%.60s\"", option->name,
                      bd_frame_option_takes(option, takes), given);
}

// --- from text ----------------------------------------------------------------------------------

static void *copy_of(const void *from, size_t bytes)
{
    void *to = malloc(bytes);
    BD_ASSERT(to);
    memcpy(to, from, bytes);
    return to;
}

static char *text_of(const char *text, size_t length)
{
    char *copy = malloc(length + 1);
    BD_ASSERT(copy);
    memcpy(copy, text, length);
    copy[length] = 0;
    return copy;
}

// One more of a repeated field that holds pointers.
static void append(Bounced__FrameRequest *request, const ProtobufCFieldDescriptor *field,
                   void *item)
{
    size_t *count = bd_field_presence(&request->base, field);
    void ***list = bd_field_value(&request->base, field);
    void **grown = realloc(*list, (*count + 1) * sizeof *grown);
    BD_ASSERT(grown);
    grown[(*count)++] = item;
    *list = grown;
}

static bool add_names(Bounced__FrameRequest *request, const ProtobufCFieldDescriptor *field,
                      const char *text)
{
    for (const char *at = text;; at++) {
        const size_t length = strcspn(at, ",");
        if (length == 0) return false;
        append(request, field, text_of(at, length));
        at += length;
        if (!*at) return true;
    }
}

static bool add_pair(Bounced__FrameRequest *request, const ProtobufCFieldDescriptor *field,
                     const char *text)
{
    const char *equals = strchr(text, '=');
    if (!equals || equals == text) return false;
    Bounced__KeyValue *pair = malloc(sizeof *pair);
    BD_ASSERT(pair);
    bounced__key_value__init(pair);
    pair->key = text_of(text, (size_t)(equals - text));
    pair->value = text_of(equals + 1, strlen(equals + 1));
    append(request, field, pair);
    return true;
}

static bool set_row(const struct bd_frame_option *option, Bounced__FrameRequest *request,
                    const ProtobufCFieldDescriptor *field, const char *text)
{
    uint32_t numbers[4];
    char copy[64], *at = copy;
    if (strlen(text) >= sizeof copy) return false;
    strcpy(copy, text);
    for (uint32_t i = 0; i < option->count; i++) {
        char *end = at + strcspn(at, (const char[]){option->between, 0});
        const bool last = i + 1 == option->count;
        uint64_t wide;
        if (last != !*end) return false;
        *end = 0;
        if (!bd_text_whole(at, UINT32_MAX, &wide)) return false;
        numbers[i] = (uint32_t)wide;
        at = end + 1;
    }
    uint32_t **list = bd_field_value(&request->base, field);
    free(*list);
    *list = copy_of(numbers, option->count * sizeof *numbers);
    *(size_t *)bd_field_presence(&request->base, field) = option->count;
    return true;
}

static void set_point(double **list, size_t *count, const double numbers[3])
{
    *list = copy_of(numbers, 3 * sizeof *numbers);
    *count = 3;
}

#define POSE_NUMBERS_MAX 10

// Eye and target, up where there are three more, and the angle where one is left.
static bool set_pose(Bounced__FrameRequest *request, const char *text)
{
    double numbers[POSE_NUMBERS_MAX];
    uint32_t count = 1;
    for (const char *at = text; *at; at++) count += *at == ',';
    if (count != 6 && count != 7 && count != 9 && count != 10) return false;
    for (uint32_t i = 0; i < count; i++)
        if (!bd_text_number(&text, i + 1 < count ? ',' : 0, &numbers[i])) return false;
    if (request->pose) bounced__camera_pose__free_unpacked(request->pose, NULL);
    Bounced__CameraPose *pose = request->pose = malloc(sizeof *pose);
    BD_ASSERT(pose);
    bounced__camera_pose__init(pose);
    set_point(&pose->eye, &pose->n_eye, numbers);
    set_point(&pose->target, &pose->n_target, numbers + 3);
    if (count >= 9) set_point(&pose->up, &pose->n_up, numbers + 6);
    pose->has_yfov = count == 7 || count == 10;
    if (pose->has_yfov) pose->yfov = numbers[count - 1];
    return true;
}

static bool set_text(const struct bd_frame_option *option, const char *text,
                     Bounced__FrameRequest *request)
{
    const ProtobufCFieldDescriptor *field = field_of(option);
    if (option->count > 0) return set_row(option, request, field, text);
    if (field->type == PROTOBUF_C_TYPE_MESSAGE)
        return field->label == PROTOBUF_C_LABEL_REPEATED ? add_pair(request, field, text)
                                                         : set_pose(request, text);
    if (field->label == PROTOBUF_C_LABEL_REPEATED) return add_names(request, field, text);
    return bd_field_set_text(&request->base, field, text);
}

// ":full" or ":model" is cut off into `against`: both figures are measured against one thing.
static enum bd_err cut_against(const struct bd_frame_option *option, char *text,
                               Bounced__FrameRequest *request, struct bd_err_detail *detail)
{
    char *colon = option->form && strchr(option->form, ':') ? strchr(text, ':') : NULL;
    if (!colon) return BD_ERR_OK;
    *colon = 0;
    const struct bd_frame_option *other = bd_frame_option_named("against", NULL);
    if (bd_frame_option_word(other, colon + 1) < 0) return refuse(other, colon + 1, detail);
    if (request->against && strcmp(request->against, colon + 1) != 0)
        return bd_err_set(
            detail, BD_ERR_USAGE, option->name,
            "%s: errors of one frame are measured against one thing, not %s and %.20s",
            option->name, request->against, colon + 1);
    return bd_frame_option_set(other, colon + 1, request, detail);
}

static bool is_allowed(const struct bd_frame_option *option, const Bounced__FrameRequest *request);

enum bd_err bd_frame_option_set(const struct bd_frame_option *option, const char *text,
                                Bounced__FrameRequest *request, struct bd_err_detail *detail)
{
    char *own = text_of(text, strlen(text));
    enum bd_err err = cut_against(option, own, request, detail);
    if (!err && (!set_text(option, own, request) || !is_allowed(option, request)))
        err = refuse(option, text, detail);
    free(own);
    return err;
}

// --- what is set --------------------------------------------------------------------------------

static bool is_within(const struct bd_frame_option *option, double number)
{
    if (option->or_none && number == 0) return true;
    if (!(option->least < option->most)) return true;
    return number >= option->least && number <= option->most;
}

static bool is_word_or_number(const struct bd_frame_option *option, const char *text)
{
    double number;
    if (!text || !option->words || bd_frame_option_word(option, text) >= 0) return true;
    return option->or_number && bd_text_number(&text, 0, &number) && is_within(option, number);
}

// Of one that is not set, or that anything goes for.
static bool is_allowed(const struct bd_frame_option *option, const Bounced__FrameRequest *request)
{
    const ProtobufCFieldDescriptor *field = field_of(option);
    const void *const at = bd_field_value(&request->base, field);
    if (field->label == PROTOBUF_C_LABEL_REPEATED || field->type == PROTOBUF_C_TYPE_MESSAGE)
        return true;
    if (field->type == PROTOBUF_C_TYPE_STRING) return is_word_or_number(option, *(char *const *)at);
    if (!*(const protobuf_c_boolean *)bd_field_presence(&request->base, field)) return true;
    if (field->type == PROTOBUF_C_TYPE_UINT32) return is_within(option, *(const uint32_t *)at);
    return field->type != PROTOBUF_C_TYPE_DOUBLE || is_within(option, *(const double *)at);
}

const char *bd_frame_option_type(const struct bd_frame_option *option, bool *has_many)
{
    const ProtobufCFieldDescriptor *field = field_of(option);
    *has_many = field->label == PROTOBUF_C_LABEL_REPEATED;
    switch (field->type) {
    case PROTOBUF_C_TYPE_BOOL:
        return "switch";
    case PROTOBUF_C_TYPE_STRING:
        return "text";
    case PROTOBUF_C_TYPE_DOUBLE:
        return "number";
    case PROTOBUF_C_TYPE_MESSAGE:
        return "message";
    default:
        return "whole";
    }
}

bool bd_frame_option_is_set(const struct bd_frame_option *option,
                            const Bounced__FrameRequest *request)
{
    const ProtobufCFieldDescriptor *field = field_of(option);
    const void *const at = bd_field_value(&request->base, field);
    if (field->label == PROTOBUF_C_LABEL_REPEATED)
        return *(const size_t *)bd_field_presence(&request->base, field);
    switch (field->type) {
    case PROTOBUF_C_TYPE_BOOL:
        return *(const protobuf_c_boolean *)at;
    case PROTOBUF_C_TYPE_UINT32:
        return *(const uint32_t *)at != 0;
    case PROTOBUF_C_TYPE_UINT64:
        return *(const uint64_t *)at != 0;
    case PROTOBUF_C_TYPE_DOUBLE:
        return *(const double *)at != 0;
    default:
        return *(void *const *)at != NULL;
    }
}

bool bd_frame_options_are_lasting(const Bounced__FrameRequest *request)
{
    for (uint32_t i = 0; i < bd_frame_option_count; i++)
        if (bd_frame_options[i].of_now && bd_frame_option_is_set(&bd_frame_options[i], request))
            return false;
    return true;
}

static void write_value(const ProtobufCFieldDescriptor *field, const Bounced__FrameRequest *request,
                        char *out, size_t bytes)
{
    const void *const at = bd_field_value(&request->base, field);
    if (field->type == PROTOBUF_C_TYPE_STRING)
        snprintf(out, bytes, "%s", *(char *const *)at);
    else if (field->type == PROTOBUF_C_TYPE_UINT32)
        snprintf(out, bytes, "%" PRIu32, *(const uint32_t *)at);
    else
        snprintf(out, bytes, "%g", *(const double *)at);
}

enum bd_err bd_frame_options_check(const Bounced__FrameRequest *request,
                                   struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < bd_frame_option_count; i++) {
        char value[64];
        if (is_allowed(&bd_frame_options[i], request)) continue;
        write_value(field_of(&bd_frame_options[i]), request, value, sizeof value);
        return refuse(&bd_frame_options[i], value, detail);
    }
    return BD_ERR_OK;
}
