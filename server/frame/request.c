#include "frame/request.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "shared/composite.h"
#include "technique/technique.h"

_Static_assert(BD_LAYER_BEAUTY == BD_COMPOSITE_BEAUTY, "C and GLSL agree");
_Static_assert(BD_LAYER_DIRECT == BD_COMPOSITE_DIRECT, "C and GLSL agree");
_Static_assert(BD_LAYER_INDIRECT == BD_COMPOSITE_INDIRECT, "C and GLSL agree");
_Static_assert(BD_LAYER_EMISSION == BD_COMPOSITE_EMISSION, "C and GLSL agree");
_Static_assert(BD_LAYER_ALBEDO == BD_COMPOSITE_ALBEDO, "C and GLSL agree");
_Static_assert(BD_LAYER_NORMAL == BD_COMPOSITE_NORMAL, "C and GLSL agree");
_Static_assert(BD_LAYER_DEPTH == BD_COMPOSITE_DEPTH, "C and GLSL agree");
_Static_assert(BD_LAYER_NOISE == BD_COMPOSITE_NOISE, "C and GLSL agree");
_Static_assert(BD_LAYER_BLUR == BD_COMPOSITE_BLUR, "C and GLSL agree");
_Static_assert(BD_LAYER_RENDERED_COUNT == BD_COMPOSITE_LAYERS, "C and GLSL agree");

const struct bd_frame_request bd_frame_request_default = {
    .width_px = 512,
    .height_px = 512,
    .layers = 1u << BD_LAYER_BEAUTY,
    .aa = 1,
};

static const struct {
    const char *name;
    uint32_t channel_count;
} layers[BD_LAYER_COUNT] = {
    [BD_LAYER_BEAUTY] = {"beauty", 4},
    [BD_LAYER_DIRECT] = {"direct", 3},
    [BD_LAYER_INDIRECT] = {"indirect", 3},
    [BD_LAYER_EMISSION] = {"emission", 3},
    [BD_LAYER_ALBEDO] = {"albedo", 3},
    [BD_LAYER_NORMAL] = {"normal", 3},
    [BD_LAYER_DEPTH] = {"depth", 1},
    [BD_LAYER_NOISE] = {"noise", 3},
    [BD_LAYER_BLUR] = {"blur", 1},
    [BD_LAYER_HALF_A] = {"half_a", 3}, // names of halves: image/layers.h
    [BD_LAYER_HALF_A + 1] = {"half_a.direct", 3},
    [BD_LAYER_HALF_A + 2] = {"half_a.indirect", 3},
    [BD_LAYER_HALF_A + 3] = {"half_a.emission", 3},
    [BD_LAYER_HALF_B] = {"half_b", 3},
    [BD_LAYER_HALF_B + 1] = {"half_b.direct", 3},
    [BD_LAYER_HALF_B + 2] = {"half_b.indirect", 3},
    [BD_LAYER_HALF_B + 3] = {"half_b.emission", 3},
    [BD_LAYER_VARIANCE] = {"variance", 3},
    [BD_LAYER_DIRECT_VARIANCE] = {"direct_variance", 3},
    [BD_LAYER_INDIRECT_VARIANCE] = {"indirect_variance", 3},
    [BD_LAYER_NORMAL_LENGTH] = {"normal_length", 1},
};

const char *bd_layer_name(enum bd_layer layer)
{
    return layer < BD_LAYER_COUNT ? layers[layer].name : NULL;
}

uint32_t bd_layer_channel_count(enum bd_layer layer)
{
    return layers[layer].channel_count;
}

uint32_t bd_layers_named(const char *name)
{
    if (strcmp(name, "halves") == 0) return 0xffu << BD_LAYER_HALF_A;
    if (strcmp(name, "variance") == 0) return 7u << BD_LAYER_VARIANCE;
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++)
        if (strcmp(layers[l].name, name) == 0) return 1u << l;
    return 0;
}

bool bd_frame_request_is_checked(const struct bd_frame_request *request)
{
    return !request->plan_only && (request->check_pixels > 0 || request->target_error > 0);
}

static enum bd_err check_size(const struct bd_frame_request *request,
                              const struct bd_frame_limits *limits, struct bd_err_detail *detail)
{
    uint32_t side_max = limits->side_px_max;
    if (request->width_px < 1 || request->height_px < 1 || request->width_px > side_max ||
        request->height_px > side_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "size", "%ux%u: each side must be from 1 to %u px",
                          request->width_px, request->height_px, side_max);
    if ((uint64_t)request->width_px * request->height_px > limits->pixel_count_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "size", "%ux%u: more than %llu pixels",
                          request->width_px, request->height_px,
                          (unsigned long long)limits->pixel_count_max);
    return BD_ERR_OK;
}

// Without an error to fill: an unknown name is not traced.
bool bd_frame_request_is_traced(const struct bd_frame_request *request)
{
    const struct bd_technique *technique =
        bd_technique_for(request->technique, &request->params, NULL);
    return technique && technique->is_reference;
}

static enum bd_err check_rendered(const struct bd_frame_request *request, const char *name,
                                  struct bd_err_detail *detail)
{
    uint32_t traced = request->layers >> BD_LAYER_RENDERED_COUNT;
    if (traced) {
        uint32_t layer = BD_LAYER_RENDERED_COUNT + (uint32_t)__builtin_ctz(traced);
        return bd_err_set(detail, BD_ERR_USAGE, "layers",
                          "layer %s: technique %s has none; reference does", layers[layer].name,
                          name);
    }
    const uint32_t *r = request->region;
    if (r[0] || r[1] || r[2] || r[3])
        return bd_err_set(detail, BD_ERR_USAGE, "region",
                          "technique %s renders whole frames; reference traces a region", name);
    return BD_ERR_OK;
}

static enum bd_err check_reach(const char *field, bd_dvec3 v, struct bd_err_detail *detail)
{
    const double most = BD_COORDINATE_MAX_M;
    if (fabs(v.x) <= most && fabs(v.y) <= most && fabs(v.z) <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, field,
                      "%s: %.9g %.9g %.9g: each number must be in [%g, %g]", field, v.x, v.y, v.z,
                      -most, most);
}

// So small a part of their product is left of a cross product that its direction is chance.
#define POSE_SINE_MIN 1e-7

static enum bd_err check_pose(const struct bd_pose *pose, struct bd_err_detail *detail)
{
    const double pi = 3.141592653589793;
    enum bd_err err = check_reach("pose.eye", pose->eye_m, detail);
    if (!err) err = check_reach("pose.target", pose->target_m, detail);
    if (!err) err = check_reach("pose.up", pose->up, detail);
    if (err) return err;
    bd_dvec3 sight = bd_dvec3_sub(pose->target_m, pose->eye_m);
    double far_m = fmax(bd_dvec3_length(pose->eye_m), bd_dvec3_length(pose->target_m));
    double length_m = bd_dvec3_length(sight);
    if (!(length_m > far_m * 0x1p-44) || !isfinite(length_m))
        return bd_err_set(detail, BD_ERR_USAGE, "pose.target",
                          "pose.target: must not be the eye, nor too near to it to tell");
    double sine = bd_dvec3_length(bd_dvec3_cross(sight, pose->up));
    if (!(sine > POSE_SINE_MIN * length_m * bd_dvec3_length(pose->up)))
        return bd_err_set(detail, BD_ERR_USAGE, "pose.up",
                          "pose.up: must have a length, and not lie along the line of sight");
    if (!(pose->yfov >= 0 && pose->yfov < pi))
        return bd_err_set(detail, BD_ERR_USAGE, "pose.yfov",
                          "pose.yfov: %g: must be above 0 and below pi radians", pose->yfov);
    return BD_ERR_OK;
}

// Traced layers lie in the host's memory, many of them, and their samples take long: what would be
// too large an answer is refused before.
static enum bd_err check_traced_bytes(const struct bd_frame_request *request, uint64_t most,
                                      struct bd_err_detail *detail)
{
    uint64_t channels = 0;
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++)
        if (l == BD_LAYER_BEAUTY || request->layers >> l & 1) channels += layers[l].channel_count;
    uint64_t bytes = channels * sizeof(float) * request->width_px * request->height_px;
    if (most == 0 || bytes <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "reply_bytes",
                      "%ux%u pixels of %llu planes are %llu bytes, above the limit reply_bytes "
                      "of %llu",
                      request->width_px, request->height_px, (unsigned long long)channels,
                      (unsigned long long)bytes, (unsigned long long)most);
}

static enum bd_err check_traced(const struct bd_frame_request *request,
                                const struct bd_frame_limits *limits, struct bd_err_detail *detail)
{
    if (request->layers & BD_LAYERS_DOUBT)
        return bd_err_set(detail, BD_ERR_USAGE, "layers",
                          "noise, blur: technique reference has no such layer; halves and "
                          "variance tell how noisy it is");
    if (request->aa != 1)
        return bd_err_set(detail, BD_ERR_USAGE, "aa",
                          "aa=%u: technique reference has no sub-frames; spp and filter=box "
                          "sample a pixel",
                          request->aa);
    if (request->budget_ms > 0)
        return bd_err_set(detail, BD_ERR_USAGE, "budget_ms",
                          "budget_ms: technique reference has none; spp says how far it goes");
    if (request->check_pixels > 0 || request->target_error > 0)
        return bd_err_set(detail, BD_ERR_USAGE, request->check_pixels ? "check" : "target_error",
                          "technique reference is what other frames are checked against; its "
                          "variance layers say how noisy it is");
    const uint32_t *r = request->region;
    bool whole = !r[0] && !r[1] && !r[2] && !r[3];
    bool inside = r[2] && r[3] && r[2] <= request->width_px && r[3] <= request->height_px &&
                  r[0] <= request->width_px - r[2] && r[1] <= request->height_px - r[3];
    if (!whole && !inside)
        return bd_err_set(detail, BD_ERR_USAGE, "region",
                          "region %u,%u,%u,%u: must be pixels of the %ux%u picture", r[0], r[1],
                          r[2], r[3], request->width_px, request->height_px);
    return check_traced_bytes(request, limits->reply_bytes_max, detail);
}

enum bd_err bd_frame_request_check(const struct bd_frame_request *request,
                                   const struct bd_frame_limits *limits,
                                   struct bd_err_detail *detail)
{
    enum bd_err err = check_size(request, limits, detail);
    if (err) return err;
    if (request->layers >> BD_LAYER_COUNT)
        return bd_err_set(detail, BD_ERR_USAGE, "layers", "no such layer");
    const struct bd_technique *technique =
        bd_technique_for(request->technique, &request->params, detail);
    if (!technique) return BD_ERR_USAGE;
    err = technique->is_reference ? check_traced(request, limits, detail)
                                  : check_rendered(request, technique->name, detail);
    if (err) return err;
    if (request->budget_ms > 0 && request->target_error > 0)
        err = bd_err_set(detail, BD_ERR_USAGE, "budget_ms", "budget_ms or target_error, not both");
    if (!err && request->pose.is_set && request->camera[0])
        err = bd_err_set(detail, BD_ERR_USAGE, "pose", "pose or camera, not both");
    if (!err && request->pose.is_set) err = check_pose(&request->pose, detail);
    if (err) return err;
    struct bd_params params;
    return bd_params_read(&request->params, technique, &params, detail);
}
