#include "frame/invalidate.h"

#include <string.h>

#include "frame/plan.h"
#include "upload/render_space.h"

enum {
    READS_SURFACES = 1u << 0,     // geometry, transforms, materials: what is uploaded
    READS_LIGHT_SHAPES = 1u << 1, // where they are and where to, not how bright
    READS_LIGHTS = 1u << 2,
    READS_ENVIRONMENT = 1u << 3,
    READS_CAMERA = 1u << 4,
    READS_ALL = 0xff, // and is never kept
};

static const struct {
    const char *name;
    uint32_t reads;
} passes[] = {
    {"gbuffer", READS_SURFACES | READS_CAMERA},
    {"shadow_map", READS_SURFACES | READS_LIGHT_SHAPES},
    {"direct", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"rsm", READS_SURFACES | READS_LIGHT_SHAPES},
    {"vpl_grid", READS_SURFACES | READS_LIGHTS},
    {"vpl_clusters", READS_SURFACES | READS_LIGHTS},
    {"vpl_tree", READS_SURFACES | READS_LIGHTS},
    {"discontinuity", READS_SURFACES | READS_CAMERA},
    {"fragments", READS_SURFACES | READS_CAMERA},
    {"surfaces", READS_SURFACES | READS_CAMERA},
    {"gather", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"splat", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"subsplats", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"glossy", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"upsample", READS_SURFACES | READS_LIGHTS | READS_CAMERA},
    {"bvh", READS_SURFACES | READS_LIGHTS | READS_ENVIRONMENT},
    {"trace", READS_ALL},
    {"composite", READS_ALL},
    {"readback", READS_ALL},
};

static uint32_t reads_of(const char *pass)
{
    for (size_t i = 0; i < sizeof passes / sizeof passes[0]; i++)
        if (strcmp(passes[i].name, pass) == 0) return passes[i].reads;
    return READS_ALL;
}

static bool is_same_shape(const struct bd_scene *a, const struct bd_placement *from,
                          const struct bd_scene *b, const struct bd_placement *to)
{
    const struct bd_light *left = &a->lights[from->object], *right = &b->lights[to->object];
    return memcmp(&from->position, &to->position, sizeof from->position) == 0 &&
           memcmp(&from->axis_x, &to->axis_x, sizeof from->axis_x) == 0 &&
           memcmp(&from->axis_y, &to->axis_y, sizeof from->axis_y) == 0 &&
           memcmp(&from->axis_z, &to->axis_z, sizeof from->axis_z) == 0 &&
           left->kind == right->kind && left->cone_inner == right->cone_inner &&
           left->cone_outer == right->cone_outer;
}

static bool had_shape(const struct bd_scene *before, const struct bd_scene *after,
                      const struct bd_placement *light)
{
    for (uint32_t i = 0; i < before->placed_light_count; i++)
        if (bd_plan_light_shines(before, i) &&
            is_same_shape(before, &before->placed_lights[i], after, light))
            return true;
    return false;
}

// Whether some light that shines now was not there, or not so.
static bool some_shape_is_new(const struct bd_scene *before, const struct bd_scene *after)
{
    for (uint32_t i = 0; i < after->placed_light_count; i++)
        if (bd_plan_light_shines(after, i) && !had_shape(before, after, &after->placed_lights[i]))
            return true;
    return false;
}

static bool is_same_camera(const struct bd_camera *a, const struct bd_camera *b)
{
    return a->orthographic == b->orthographic && a->yfov == b->yfov && a->xmag == b->xmag &&
           a->ymag == b->ymag && a->near_m == b->near_m && a->far_m == b->far_m;
}

static bool is_same_view(const struct bd_scene *a, int32_t camera_a, const struct bd_scene *b,
                         int32_t camera_b)
{
    const struct bd_placement *from = &a->placed_cameras[camera_a];
    const struct bd_placement *to = &b->placed_cameras[camera_b];
    return memcmp(&from->position, &to->position, sizeof from->position) == 0 &&
           memcmp(&from->axis_x, &to->axis_x, sizeof from->axis_x) == 0 &&
           memcmp(&from->axis_y, &to->axis_y, sizeof from->axis_y) == 0 &&
           memcmp(&from->axis_z, &to->axis_z, sizeof from->axis_z) == 0 &&
           is_same_camera(&a->cameras[from->object], &b->cameras[to->object]);
}

// Emission is kept in the scene's unit of light, which follows the brightest.
static bool unit_is_new(const struct bd_plan *plan, const struct bd_scene *before,
                        const struct bd_scene *after)
{
    return plan->emission &&
           bd_render_space_of(before).unit_cd_m2 != bd_render_space_of(after).unit_cd_m2;
}

static uint32_t changed(const struct bd_plan *plan, const struct bd_scene *before,
                        const struct bd_scene *after)
{
    const struct bd_aspects *a = &before->aspects, *b = &after->aspects;
    uint32_t bits = 0;
    if (a->geometry != b->geometry || a->transforms != b->transforms ||
        a->materials != b->materials)
        bits |= READS_SURFACES;
    if (a->lights != b->lights) {
        bits |= READS_LIGHTS;
        // A budget of VPLs is split by flux, and a map is as fine as its light's share asks.
        if (plan->params.vpl_budget > 0 || some_shape_is_new(before, after))
            bits |= READS_LIGHT_SHAPES;
        if (unit_is_new(plan, before, after)) bits |= READS_CAMERA;
    }
    if (a->environment != b->environment) bits |= READS_ENVIRONMENT;
    return bits;
}

static bool was_planned(const struct bd_report *report, const char *pass)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, pass) == 0) return true;
    return false;
}

// The table's own text, which outlives the report.
static const char *name_of(const char *pass)
{
    for (size_t i = 0; i < sizeof passes / sizeof passes[0]; i++)
        if (strcmp(passes[i].name, pass) == 0) return passes[i].name;
    return "other";
}

enum bd_err bd_invalidate(const struct bd_scene *before, const struct bd_scene *after,
                          const struct bd_frame_request *request, struct bd_invalidation *out,
                          struct bd_fault *fault)
{
    struct bd_plan plan_before, plan_after;
    struct bd_report report_before, report_after;
    *out = (struct bd_invalidation){0};
    enum bd_err err = bd_plan_make(after, request, &plan_after, &report_after, fault);
    if (err) return err;
    bool had_plan = !bd_plan_make(before, request, &plan_before, &report_before, NULL);
    uint32_t bits = had_plan ? changed(&plan_after, before, after) : READS_ALL;
    if (had_plan && !request->pose.is_set &&
        !is_same_view(before, plan_before.camera, after, plan_after.camera))
        bits |= READS_CAMERA;
    for (uint32_t i = 0; i < report_after.pass_count; i++) {
        const char *pass = report_after.passes[i].name;
        const uint32_t reads = reads_of(pass);
        bool runs = reads == READS_ALL || (reads & bits) || !was_planned(&report_before, pass);
        if (runs)
            out->run[out->run_count++] = name_of(pass);
        else
            out->kept[out->kept_count++] = name_of(pass);
    }
    return BD_ERR_OK;
}
