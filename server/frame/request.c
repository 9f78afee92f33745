#include "frame/request.h"

#include <stddef.h>

#include "shared/composite.h"
#include "technique/technique.h"

_Static_assert(BD_LAYER_BEAUTY == BD_COMPOSITE_BEAUTY, "C and GLSL agree");
_Static_assert(BD_LAYER_DIRECT == BD_COMPOSITE_DIRECT, "C and GLSL agree");
_Static_assert(BD_LAYER_INDIRECT == BD_COMPOSITE_INDIRECT, "C and GLSL agree");
_Static_assert(BD_LAYER_EMISSION == BD_COMPOSITE_EMISSION, "C and GLSL agree");
_Static_assert(BD_LAYER_ALBEDO == BD_COMPOSITE_ALBEDO, "C and GLSL agree");
_Static_assert(BD_LAYER_NORMAL == BD_COMPOSITE_NORMAL, "C and GLSL agree");
_Static_assert(BD_LAYER_DEPTH == BD_COMPOSITE_DEPTH, "C and GLSL agree");

#define AA_MAX 64

const struct bd_frame_request bd_frame_request_default = {
    .technique = "rsm",
    .width_px = 512,
    .height_px = 512,
    .layers = 1u << BD_LAYER_BEAUTY,
    .aa = 1,
};

const char *bd_layer_name(enum bd_layer layer)
{
    switch (layer) {
    case BD_LAYER_BEAUTY: return "beauty";
    case BD_LAYER_DIRECT: return "direct";
    case BD_LAYER_INDIRECT: return "indirect";
    case BD_LAYER_EMISSION: return "emission";
    case BD_LAYER_ALBEDO: return "albedo";
    case BD_LAYER_NORMAL: return "normal";
    case BD_LAYER_DEPTH: return "depth";
    case BD_LAYER_COUNT: break;
    }
    return NULL;
}

const char *bd_fresh_name(enum bd_fresh fresh)
{
    switch (fresh) {
    case BD_FRESH_NONE: return "none";
    case BD_FRESH_CAMERA: return "camera";
    case BD_FRESH_ALL: return "all";
    }
    return NULL;
}

static enum bd_err check_size(const struct bd_frame_request *request,
                              const struct bd_frame_limits *limits, struct bd_fault *fault)
{
    uint32_t side_max = limits->side_px_max;
    if (request->width_px < 1 || request->height_px < 1 || request->width_px > side_max ||
        request->height_px > side_max)
        return bd_fault_set(fault, BD_ERR_LIMIT, "size", "%ux%u: each side must be from 1 to %u px",
                            request->width_px, request->height_px, side_max);
    if ((uint64_t)request->width_px * request->height_px > limits->pixel_count_max)
        return bd_fault_set(fault, BD_ERR_LIMIT, "size", "%ux%u: more than %llu pixels",
                            request->width_px, request->height_px,
                            (unsigned long long)limits->pixel_count_max);
    return BD_ERR_OK;
}

enum bd_err bd_frame_request_check(const struct bd_frame_request *request,
                                   const struct bd_frame_limits *limits, struct bd_fault *fault)
{
    enum bd_err err = check_size(request, limits, fault);
    if (err) return err;
    if (request->aa < 1 || request->aa > AA_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "aa", "%u: must be from 1 to %d", request->aa,
                            AA_MAX);
    if (request->layers >> BD_LAYER_COUNT)
        return bd_fault_set(fault, BD_ERR_USAGE, "layers", "no such layer");
    const char *name = request->technique[0] ? request->technique : "rsm";
    const struct bd_technique *technique = bd_technique_find(name, fault);
    if (!technique) return BD_ERR_USAGE;
    struct bd_params params;
    return bd_params_read(&request->params, technique->params_read, name, &params, fault);
}
