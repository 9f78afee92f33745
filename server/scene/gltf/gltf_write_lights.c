// Cameras and lights.

#include <math.h>

#include "scene/gltf/gltf_write_parts.h"
#include "scene/model/object_fields.h"

// An orthographic camera has to have a far plane: one that no float reaches is none.
static const double beyond_all_m = 1e39;

static void write_perspective(struct bd_gltf_json *json, const struct bd_camera *camera)
{
    bd_gltf_json_text(json, "type", "perspective");
    bd_gltf_json_open(json, "perspective", '{');
    bd_gltf_json_f32(json, "yfov", camera->yfov);
    bd_gltf_json_f32(json, "znear", camera->near_m);
    if (isfinite(camera->far_m)) bd_gltf_json_f32(json, "zfar", camera->far_m);
    bd_gltf_json_close(json, '{');
}

static void write_orthographic(struct bd_gltf_json *json, const struct bd_camera *camera)
{
    bd_gltf_json_text(json, "type", "orthographic");
    bd_gltf_json_open(json, "orthographic", '{');
    bd_gltf_json_f32(json, "xmag", camera->xmag);
    bd_gltf_json_f32(json, "ymag", camera->ymag);
    bd_gltf_json_f32(json, "znear", camera->near_m);
    if (isfinite(camera->far_m))
        bd_gltf_json_f32(json, "zfar", camera->far_m);
    else
        bd_gltf_json_f64(json, "zfar", beyond_all_m);
    bd_gltf_json_close(json, '{');
}

void bd_gltf_write_cameras(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    if (bd_scene_count(writer->scene).cameras == 0) return;
    bd_gltf_json_open(json, "cameras", '[');
    for (uint32_t i = 0; i < writer->slots.cameras; i++) {
        const struct bd_camera *camera = &writer->scene->cameras[i];
        if (camera->is_removed) continue;
        bd_gltf_json_open(json, NULL, '{');
        if (camera->name[0]) bd_gltf_json_text(json, "name", camera->name);
        if (camera->orthographic)
            write_orthographic(json, camera);
        else
            write_perspective(json, camera);
        bd_gltf_json_close(json, '{');
    }
    bd_gltf_json_close(json, '[');
}

static void write_spot(struct bd_gltf_json *json, const struct bd_light *light)
{
    bd_gltf_json_open(json, "spot", '{');
    bd_gltf_json_f32(json, "innerConeAngle", light->cone_inner);
    bd_gltf_json_f32(json, "outerConeAngle", light->cone_outer);
    bd_gltf_json_close(json, '{');
}

static void write_light(struct bd_gltf_json *json, const struct bd_light *light)
{
    const struct bd_object_field *kind = bd_object_field(BD_OBJECT_LIGHT, "kind");
    bd_gltf_json_open(json, NULL, '{');
    if (light->name[0]) bd_gltf_json_text(json, "name", light->name);
    bd_gltf_json_text(json, "type", kind->words[light->kind]);
    bd_gltf_json_f32s(json, "color", light->color, 3);
    bd_gltf_json_f32(json, "intensity", light->intensity);
    if (isfinite(light->range_m)) bd_gltf_json_f32(json, "range", light->range_m);
    if (light->kind == BD_LIGHT_SPOT) write_spot(json, light);
    bd_gltf_json_close(json, '{');
}

void bd_gltf_write_lights(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    if (bd_scene_count(writer->scene).lights == 0) return;
    bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_LIGHTS);
    bd_gltf_json_open(json, "lights", '[');
    for (uint32_t i = 0; i < writer->slots.lights; i++)
        if (!writer->scene->lights[i].is_removed) write_light(json, &writer->scene->lights[i]);
    bd_gltf_json_close(json, '[');
    bd_gltf_json_close(json, '{');
}
