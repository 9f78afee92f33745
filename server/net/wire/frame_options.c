#include "net/wire/frame_options.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/frame_options.h"

static enum bd_err copy_text(const char *field, const char *text, char *out, size_t size,
                             struct bd_err_detail *detail)
{
    if (!text) return BD_ERR_OK;
    if (strlen(text) >= size)
        return bd_err_set(detail, BD_ERR_USAGE, field, "%s is longer than %zu bytes", field,
                          size - 1);
    memcpy(out, text, strlen(text) + 1);
    return BD_ERR_OK;
}

// The number of an option's word, which is right by now; 0, the standard, where it is not set.
static int word_of(const char *option, const char *text)
{
    return text ? bd_frame_option_word(bd_frame_option_named(option, NULL), text) : 0;
}

static enum bd_err read_size(const Bounced__FrameRequest *request, struct bd_frame_request *frame,
                             struct bd_err_detail *detail)
{
    if (request->n_size == 0) return BD_ERR_OK;
    if (request->n_size != 2)
        return bd_err_set(detail, BD_ERR_USAGE, "size",
                          "size is a width and a height, not %zu "
                          "numbers",
                          request->n_size);
    frame->width_px = request->size[0];
    frame->height_px = request->size[1];
    return BD_ERR_OK;
}

static enum bd_err read_parameters(const Bounced__FrameRequest *request,
                                   struct bd_frame_request *frame, struct bd_err_detail *detail)
{
    if (request->n_parameters > BD_PARAM_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "parameters", "there are more than %d parameters",
                          BD_PARAM_MAX);
    struct bd_param_list *params = &frame->params;
    for (size_t i = 0; i < request->n_parameters; i++) {
        const Bounced__KeyValue *pair = request->parameters[i];
        enum bd_err err = copy_text("parameters", pair->key ? pair->key : "",
                                    params->pairs[params->count].key, BD_PARAM_KEY_MAX, detail);
        if (!err)
            err = copy_text(pair->key, pair->value ? pair->value : "",
                            params->pairs[params->count].value, BD_PARAM_VALUE_MAX, detail);
        if (err) return err;
        params->count++;
    }
    return BD_ERR_OK;
}

static enum bd_err read_layers(const Bounced__FrameRequest *request, struct bd_frame_options *out,
                               struct bd_err_detail *detail)
{
    out->frame.layers = 1u << BD_LAYER_BEAUTY;
    for (size_t i = 0; i < request->n_layers; i++) {
        uint32_t named = bd_layers_named(request->layers[i]);
        if (!named)
            return bd_err_set(detail, BD_ERR_USAGE, "layers", "there is no layer \"%s\"",
                              request->layers[i]);
        out->frame.layers |= named;
        if (i == 0) out->shown = (enum bd_layer)__builtin_ctz(named);
    }
    return BD_ERR_OK;
}

static enum bd_err read_region(const Bounced__FrameRequest *request, struct bd_frame_request *frame,
                               struct bd_err_detail *detail)
{
    if (request->n_region == 0) return BD_ERR_OK;
    if (request->n_region != 4 || !request->region[2] || !request->region[3])
        return bd_err_set(detail, BD_ERR_USAGE, "region",
                          "region is x, y, width and height, the last two at least 1");
    memcpy(frame->region, request->region, sizeof frame->region);
    return BD_ERR_OK;
}

// Words and ranges are right by now.
static void read_check(const Bounced__FrameRequest *request, struct bd_frame_request *frame)
{
    frame->check_pixels = request->check;
    frame->target_error = request->target_error / 100;
    frame->against = (enum bd_against)word_of("against", request->against);
}

static void read_exposure(const char *text, struct bd_encode_request *encode)
{
    if (!text) return;
    const struct bd_frame_option *exposure = bd_frame_option_named("exposure", NULL);
    encode->exposure_auto = bd_frame_option_word(exposure, text) >= 0;
    if (!encode->exposure_auto) encode->exposure_stops = strtof(text, NULL);
}

static enum bd_err read_encoding(const Bounced__FrameRequest *request, struct bd_frame_options *out,
                                 struct bd_err_detail *detail)
{
    const char *name = request->encoding ? request->encoding : "png";
    out->wants_image = bd_encode_format_from_name(name, &out->encode.format);
    out->encode.tonemap = (enum bd_tonemap)word_of("tonemap", request->tonemap);
    if (request->has_jpeg_quality) out->encode.jpeg_quality = (int)request->jpeg_quality;
    out->encode.exr_half = request->exr_half;
    out->encode.exr_raw = request->exr_raw;
    read_exposure(request->exposure, &out->encode);
    if (out->wants_image && out->encode.format != BD_ENCODE_EXR && request->n_layers > 1)
        return bd_err_set(detail, BD_ERR_USAGE, "layers", "%s holds one layer, exr all of them",
                          bd_encode_format_name(out->encode.format));
    return BD_ERR_OK;
}

static enum bd_err read_point(const char *field, const double *numbers, size_t count, bd_dvec3 *out,
                              struct bd_err_detail *detail)
{
    if (count != 3)
        return bd_err_set(detail, BD_ERR_USAGE, field, "%s is three numbers, not %zu", field,
                          count);
    *out = (bd_dvec3){numbers[0], numbers[1], numbers[2]};
    return BD_ERR_OK;
}

enum bd_err bd_pose_read(const Bounced__CameraPose *pose, struct bd_pose *out,
                         struct bd_err_detail *detail)
{
    *out = (struct bd_pose){.is_set = true, .up = {0, 1, 0}};
    enum bd_err err = read_point("pose.eye", pose->eye, pose->n_eye, &out->eye_m, detail);
    if (!err) err = read_point("pose.target", pose->target, pose->n_target, &out->target_m, detail);
    if (!err && pose->n_up > 0) err = read_point("pose.up", pose->up, pose->n_up, &out->up, detail);
    if (!err && pose->has_yfov) {
        out->yfov = pose->yfov;
        if (!(pose->yfov > 0)) // 0 stands for "not set" from here on
            err = bd_err_set(detail, BD_ERR_USAGE, "pose.yfov",
                             "pose.yfov: %g: must be above 0 and below pi radians", pose->yfov);
    }
    return err;
}

enum bd_err bd_frame_options_read(const Bounced__FrameRequest *request,
                                  struct bd_frame_options *out, struct bd_err_detail *detail)
{
    static const Bounced__FrameRequest empty = BOUNCED__FRAME_REQUEST__INIT;
    if (!request) request = &empty;
    *out = (struct bd_frame_options){.frame = bd_frame_request_default,
                                     .encode = bd_encode_request_default,
                                     .shown = BD_LAYER_BEAUTY};
    struct bd_frame_request *frame = &out->frame;
    enum bd_err err = bd_frame_options_check(request, detail);
    if (!err)
        err = copy_text("technique", request->technique, frame->technique, sizeof frame->technique,
                        detail);
    if (!err)
        err = copy_text("camera", request->camera, frame->camera, sizeof frame->camera, detail);
    if (!err && request->pose) err = bd_pose_read(request->pose, &frame->pose, detail);
    if (!err) err = read_size(request, frame, detail);
    if (!err) err = read_parameters(request, frame, detail);
    if (!err) err = read_layers(request, out, detail);
    if (!err) err = read_region(request, frame, detail);
    if (!err) err = read_encoding(request, out, detail);
    frame->auto_exposure = out->wants_image && out->encode.exposure_auto;
    if (err) return err;
    read_check(request, frame);
    if (request->has_aa) frame->aa = request->aa;
    frame->fresh = (enum bd_fresh)word_of("fresh", request->fresh);
    frame->seed = request->seed;
    frame->deadline_ms = request->deadline_ms;
    frame->budget_ms = request->budget_ms;
    frame->plan_only = request->plan_only;
    return BD_ERR_OK;
}
