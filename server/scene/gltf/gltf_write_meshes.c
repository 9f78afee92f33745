// Meshes, their streams shared among those that hold the same.

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_write_parts.h"

#define GL_UNSIGNED_SHORT       5123
#define GL_UNSIGNED_INT         5125
#define GL_FLOAT                5126
#define GL_ARRAY_BUFFER         34962
#define GL_ELEMENT_ARRAY_BUFFER 34963

static const struct {
    const char *attribute;
    uint32_t width;
    enum bd_gltf_out_type type;
} streams[BD_GLTF_STREAM_INDEX] = {
    [BD_GLTF_STREAM_POSITION] = {"POSITION", 3, BD_GLTF_OUT_VEC3},
    [BD_GLTF_STREAM_NORMAL] = {"NORMAL", 3, BD_GLTF_OUT_VEC3},
    [BD_GLTF_STREAM_TANGENT] = {"TANGENT", 4, BD_GLTF_OUT_VEC4},
    [BD_GLTF_STREAM_UV0] = {"TEXCOORD_0", 2, BD_GLTF_OUT_VEC2},
    [BD_GLTF_STREAM_UV1] = {"TEXCOORD_1", 2, BD_GLTF_OUT_VEC2},
    [BD_GLTF_STREAM_COLOR] = {"COLOR_0", 4, BD_GLTF_OUT_VEC4},
};

static const float *stream_of(const struct bd_primitive *primitive, int stream)
{
    const float *const of[BD_GLTF_STREAM_INDEX] = {
        [BD_GLTF_STREAM_POSITION] = primitive->position,
        [BD_GLTF_STREAM_NORMAL] = primitive->normal,
        [BD_GLTF_STREAM_TANGENT] = primitive->tangent,
        [BD_GLTF_STREAM_UV0] = primitive->uv[0],
        [BD_GLTF_STREAM_UV1] = primitive->uv[1],
        [BD_GLTF_STREAM_COLOR] = primitive->color,
    };
    return of[stream];
}

static void find_bounds(const struct bd_primitive *primitive, struct bd_gltf_out_accessor *out)
{
    out->has_bounds = true;
    for (int axis = 0; axis < 3; axis++) {
        float least = FLT_MAX, most = -FLT_MAX;
        for (uint32_t v = 0; v < primitive->vertex_count; v++) {
            least = fminf(least, primitive->position[3 * (size_t)v + (size_t)axis]);
            most = fmaxf(most, primitive->position[3 * (size_t)v + (size_t)axis]);
        }
        out->least[axis] = least;
        out->most[axis] = most;
    }
}

static bool add_stream(struct bd_gltf_writer *writer, const struct bd_primitive *primitive,
                       int stream, int32_t *accessor)
{
    const float *values = stream_of(primitive, stream);
    if (!values) return true;
    struct bd_gltf_out_accessor out = {
        .count = primitive->vertex_count, .component_type = GL_FLOAT, .type = streams[stream].type};
    if (stream == BD_GLTF_STREAM_POSITION) find_bounds(primitive, &out);
    const struct bd_gltf_out_view view = {
        .bytes = values,
        .size_bytes = primitive->vertex_count * (uint64_t)streams[stream].width * sizeof *values,
        .target = GL_ARRAY_BUFFER};
    *accessor = bd_gltf_add_accessor(writer, &out, &view);
    return *accessor != BD_NONE;
}

// 16 bits where they do: the largest of them ends strips, so it can be no index.
static bool add_indices(struct bd_gltf_writer *writer, const struct bd_primitive *primitive,
                        int32_t *accessor)
{
    const size_t count = primitive->index_count;
    struct bd_gltf_out_accessor out = {.count = primitive->index_count,
                                       .component_type = GL_UNSIGNED_INT};
    struct bd_gltf_out_view view = {.bytes = primitive->index,
                                    .size_bytes = count * sizeof(uint32_t),
                                    .target = GL_ELEMENT_ARRAY_BUFFER};
    if (primitive->vertex_count <= UINT16_MAX) {
        uint16_t *narrow = malloc((count + 1) * sizeof *narrow);
        if (!narrow) return false;
        for (size_t i = 0; i < count; i++) narrow[i] = (uint16_t)primitive->index[i];
        out.component_type = GL_UNSIGNED_SHORT;
        view.bytes = view.own = narrow;
        view.size_bytes = count * sizeof *narrow;
    }
    *accessor = bd_gltf_add_accessor(writer, &out, &view);
    return *accessor != BD_NONE;
}

static bool add_streams(struct bd_gltf_writer *writer, struct bd_gltf_out_mesh *out)
{
    bool ok = true;
    for (uint32_t p = 0; ok && p < out->mesh.primitive_count; p++) {
        const struct bd_primitive *primitive = &out->mesh.primitives[p];
        int32_t *accessors = out->accessors[p];
        for (int s = 0; s < BD_GLTF_STREAM_COUNT; s++) accessors[s] = BD_NONE;
        for (int s = 0; ok && s < BD_GLTF_STREAM_INDEX; s++)
            ok = add_stream(writer, primitive, s, &accessors[s]);
        ok = ok && add_indices(writer, primitive, &accessors[BD_GLTF_STREAM_INDEX]);
    }
    return ok;
}

static void write_primitive(struct bd_gltf_json *json, const struct bd_primitive *primitive,
                            const int32_t accessors[BD_GLTF_STREAM_COUNT])
{
    bd_gltf_json_open(json, NULL, '{');
    bd_gltf_json_open(json, "attributes", '{');
    for (int s = 0; s < BD_GLTF_STREAM_INDEX; s++)
        if (accessors[s] != BD_NONE)
            bd_gltf_json_uint(json, streams[s].attribute, (uint64_t)accessors[s]);
    bd_gltf_json_close(json, '{');
    bd_gltf_json_uint(json, "indices", (uint64_t)accessors[BD_GLTF_STREAM_INDEX]);
    bd_gltf_json_uint(json, "material", (uint64_t)primitive->material);
    bd_gltf_json_close(json, '{');
}

static void write_mesh(struct bd_gltf_writer *writer, const struct bd_gltf_out_mesh *out)
{
    struct bd_gltf_json *json = &writer->json;
    bd_gltf_json_open(json, NULL, '{');
    if (out->mesh.name[0]) bd_gltf_json_text(json, "name", out->mesh.name);
    bd_gltf_json_open(json, "primitives", '[');
    for (uint32_t p = 0; p < out->mesh.primitive_count; p++)
        write_primitive(json, &out->mesh.primitives[p], writer->meshes[out->same_as].accessors[p]);
    bd_gltf_json_close(json, '[');
    bd_gltf_json_close(json, '{');
}

bool bd_gltf_write_meshes(struct bd_gltf_writer *writer)
{
    bool ok = true;
    if (!writer->mesh_count) return true;
    for (uint32_t m = 0; ok && m < writer->mesh_count; m++)
        if (writer->meshes[m].same_as == (int32_t)m) ok = add_streams(writer, &writer->meshes[m]);
    if (!ok) return false;
    bd_gltf_json_open(&writer->json, "meshes", '[');
    for (uint32_t m = 0; m < writer->mesh_count; m++) write_mesh(writer, &writer->meshes[m]);
    bd_gltf_json_close(&writer->json, '[');
    return true;
}
