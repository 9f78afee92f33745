// BOUNCED_environment, our own extension of the document, since glTF has no environments:
//
//     "BOUNCED_environment": {"radiance": [r, g, b], "rotation": [x, y, z, w],
//                             "map": {"accessor": 3, "width": 64, "height": 32}}
//
// as struct bd_environment has them, texels as VEC3 of floats. Written by exports; any other file
// may have it too.

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/gltf/gltf_write_parts.h"

#define MAP_PATH "extensions.BOUNCED_environment.map"

static enum bd_err refuse(struct bd_gltf_reader *reader, const char *what)
{
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, MAP_PATH, "%s", what);
}

static enum bd_err check_map(struct bd_gltf_reader *reader,
                             const struct bd_gltf_environment_map *in)
{
    const uint32_t float_type = 5126;
    if (in->accessor < 0 || (uint32_t)in->accessor >= reader->doc->accessor_count)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, MAP_PATH,
                          "index %d out of range, there are %u", in->accessor,
                          reader->doc->accessor_count);
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[in->accessor];
    if (accessor->component_type != float_type || accessor->row_count != 3 ||
        accessor->column_count != 1 || accessor->is_sparse || accessor->view == BD_NONE)
        return refuse(reader, "its accessor has to hold VEC3 of floats, all of them in a view");
    if (in->width < 1 || in->height < 1 || in->width > BD_SKY_MAP_SIDE_MAX_PX ||
        in->height > BD_SKY_MAP_SIDE_MAX_PX)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, MAP_PATH,
                          "%d x %d texels; each side goes from 1 to %d", in->width, in->height,
                          BD_SKY_MAP_SIDE_MAX_PX);
    if (accessor->count != (uint64_t)in->width * (uint64_t)in->height)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, MAP_PATH,
                          "%d x %d texels, its accessor has %llu", in->width, in->height,
                          (unsigned long long)accessor->count);
    return BD_ERR_OK;
}

static enum bd_err read_row(struct bd_gltf_reader *reader, int32_t accessor, uint32_t first,
                            uint32_t *pick, struct bd_sky_map *map)
{
    float *row = map->rgb + 3 * (size_t)first;
    for (uint32_t i = 0; i < map->width_px; i++) pick[i] = first + i;
    enum bd_err err = bd_gltf_read_floats(reader, accessor, pick, map->width_px, 3, row);
    for (size_t i = 0; err == BD_ERR_OK && i < 3 * (size_t)map->width_px; i++)
        if (!(row[i] >= 0 && row[i] <= FLT_MAX))
            err = refuse(reader, "a texel is negative or not finite");
    return err;
}

static enum bd_err read_map(struct bd_gltf_reader *reader, const struct bd_gltf_environment_map *in)
{
    enum bd_err err = check_map(reader, in);
    if (err != BD_ERR_OK) return err;
    const size_t texels = (size_t)in->width * (size_t)in->height;
    struct bd_sky_map *map = calloc(1, sizeof *map);
    uint32_t *pick = malloc((size_t)in->width * sizeof *pick);
    if (map) {
        *map = (struct bd_sky_map){.reference_count = 1,
                                   .width_px = (uint32_t)in->width,
                                   .height_px = (uint32_t)in->height,
                                   .rgb = malloc(3 * texels * sizeof *map->rgb)};
        reader->scene->environment.map = map; // freed with the scene
    }
    if (!map || !pick || !map->rgb) err = bd_gltf_no_memory(reader, MAP_PATH);
    for (uint32_t y = 0; err == BD_ERR_OK && y < map->height_px; y++)
        err = read_row(reader, in->accessor, y * map->width_px, pick, map);
    free(pick);
    return err;
}

static enum bd_err read_rotation(struct bd_gltf_reader *reader, const double rotation[4])
{
    bool is_turned = false;
    for (int c = 0; c < 4; c++) {
        if (!(fabs(rotation[c]) <= 1))
            return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                              "extensions.BOUNCED_environment.rotation", "%g is not in [-1, 1]",
                              rotation[c]);
        is_turned = is_turned || rotation[c] != 0;
    }
    if (is_turned) bd_environment_turn(&reader->scene->environment, rotation);
    return BD_ERR_OK;
}

enum bd_err bd_gltf_read_environment(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_environment *in = &reader->doc->environment;
    if (!in->is_there) return BD_ERR_OK;
    for (int c = 0; c < 3; c++) {
        if (!(in->radiance[c] >= 0 && in->radiance[c] <= (double)FLT_MAX))
            return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                              "extensions.BOUNCED_environment.radiance", "%g is not in [0, %g]",
                              in->radiance[c], (double)FLT_MAX);
        reader->scene->environment.radiance[c] = (float)in->radiance[c];
    }
    enum bd_err err = read_rotation(reader, in->rotation);
    return err || !in->has_map ? err : read_map(reader, &in->map);
}

// --- out ------------------------------------------------------------------------------------

static bool write_map(struct bd_gltf_writer *writer, const struct bd_sky_map *map)
{
    const uint32_t float_type = 5126, texels = map->width_px * map->height_px;
    const struct bd_gltf_out_accessor accessor = {
        .count = texels, .component_type = float_type, .type = BD_GLTF_OUT_VEC3};
    const struct bd_gltf_out_view view = {.bytes = map->rgb,
                                          .size_bytes = 3 * sizeof *map->rgb * (uint64_t)texels};
    int32_t at = bd_gltf_add_accessor(writer, &accessor, &view);
    if (at == BD_NONE) return false;
    bd_gltf_json_open(&writer->json, "map", '{');
    bd_gltf_json_uint(&writer->json, "accessor", (uint64_t)at);
    bd_gltf_json_uint(&writer->json, "width", map->width_px);
    bd_gltf_json_uint(&writer->json, "height", map->height_px);
    bd_gltf_json_close(&writer->json, '{');
    return true;
}

bool bd_gltf_has_environment(const struct bd_scene *scene)
{
    const struct bd_environment *environment = &scene->environment;
    return environment->map || environment->radiance[0] > 0 || environment->radiance[1] > 0 ||
           environment->radiance[2] > 0;
}

void bd_gltf_write_environment(struct bd_gltf_writer *writer)
{
    const struct bd_environment *environment = &writer->scene->environment;
    if (!bd_gltf_has_environment(writer->scene)) return;
    bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_ENVIRONMENT);
    bd_gltf_json_f32s(&writer->json, "radiance", environment->radiance, 3);
    if (bd_environment_is_turned(environment))
        bd_gltf_json_f32s(&writer->json, "rotation", environment->rotation, 4);
    if (environment->map && !write_map(writer, environment->map)) writer->json.no_memory = true;
    bd_gltf_json_close(&writer->json, '{');
}
