// The binary chunk and what names its stretches: one view for each accessor and each picture.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_write_parts.h"

static uint64_t padded(uint64_t bytes)
{
    return (bytes + 3) & ~3ull;
}

int32_t bd_gltf_add_view(struct bd_gltf_writer *writer, const struct bd_gltf_out_view *view)
{
    if (writer->view_count == writer->view_room) {
        uint32_t room = 2 * writer->view_room + 64;
        struct bd_gltf_out_view *longer = realloc(writer->views, room * sizeof *longer);
        if (!longer) {
            free(view->own);
            return BD_NONE;
        }
        writer->views = longer;
        writer->view_room = room;
    }
    uint64_t offset = bd_gltf_views_bytes(writer);
    writer->views[writer->view_count] = *view;
    writer->views[writer->view_count].offset_bytes = offset;
    return (int32_t)writer->view_count++;
}

int32_t bd_gltf_add_accessor(struct bd_gltf_writer *writer,
                             const struct bd_gltf_out_accessor *accessor,
                             const struct bd_gltf_out_view *view)
{
    int32_t at = bd_gltf_add_view(writer, view);
    if (at == BD_NONE) return BD_NONE;
    if (writer->accessor_count == writer->accessor_room) {
        uint32_t room = 2 * writer->accessor_room + 64;
        struct bd_gltf_out_accessor *longer = realloc(writer->accessors, room * sizeof *longer);
        if (!longer) return BD_NONE;
        writer->accessors = longer;
        writer->accessor_room = room;
    }
    writer->accessors[writer->accessor_count] = *accessor;
    writer->accessors[writer->accessor_count].view = (uint32_t)at;
    return (int32_t)writer->accessor_count++;
}

uint64_t bd_gltf_views_bytes(const struct bd_gltf_writer *writer)
{
    if (writer->view_count == 0) return 0;
    const struct bd_gltf_out_view *last = &writer->views[writer->view_count - 1];
    return last->offset_bytes + padded(last->size_bytes);
}

void bd_gltf_copy_views(const struct bd_gltf_writer *writer, uint8_t *out)
{
    for (uint32_t i = 0; i < writer->view_count; i++) {
        const struct bd_gltf_out_view *view = &writer->views[i];
        uint8_t *at = out + view->offset_bytes;
        memcpy(at, view->bytes, view->size_bytes);
        memset(at + view->size_bytes, 0, padded(view->size_bytes) - view->size_bytes);
    }
}

static void write_accessor(struct bd_gltf_json *json, const struct bd_gltf_out_accessor *accessor)
{
    static const char *const types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    bd_gltf_json_open(json, NULL, '{');
    bd_gltf_json_uint(json, "bufferView", accessor->view);
    bd_gltf_json_uint(json, "componentType", accessor->component_type);
    bd_gltf_json_uint(json, "count", accessor->count);
    bd_gltf_json_text(json, "type", types[accessor->type]);
    if (accessor->has_bounds) {
        bd_gltf_json_f32s(json, "min", accessor->least, 3);
        bd_gltf_json_f32s(json, "max", accessor->most, 3);
    }
    bd_gltf_json_close(json, '{');
}

static void write_view(struct bd_gltf_json *json, const struct bd_gltf_out_view *view)
{
    bd_gltf_json_open(json, NULL, '{');
    bd_gltf_json_uint(json, "buffer", 0);
    if (view->offset_bytes) bd_gltf_json_uint(json, "byteOffset", view->offset_bytes);
    bd_gltf_json_uint(json, "byteLength", view->size_bytes);
    if (view->target) bd_gltf_json_uint(json, "target", view->target);
    bd_gltf_json_close(json, '{');
}

void bd_gltf_write_views(struct bd_gltf_writer *writer)
{
    struct bd_gltf_json *json = &writer->json;
    if (writer->accessor_count) {
        bd_gltf_json_open(json, "accessors", '[');
        for (uint32_t i = 0; i < writer->accessor_count; i++)
            write_accessor(json, &writer->accessors[i]);
        bd_gltf_json_close(json, '[');
    }
    if (!writer->view_count) return;
    bd_gltf_json_open(json, "bufferViews", '[');
    for (uint32_t i = 0; i < writer->view_count; i++) write_view(json, &writer->views[i]);
    bd_gltf_json_close(json, '[');
    bd_gltf_json_open(json, "buffers", '[');
    bd_gltf_json_open(json, NULL, '{');
    bd_gltf_json_uint(json, "byteLength", bd_gltf_views_bytes(writer));
    bd_gltf_json_close(json, '{');
    bd_gltf_json_close(json, '[');
}

void bd_gltf_free_views(struct bd_gltf_writer *writer)
{
    for (uint32_t i = 0; i < writer->view_count; i++) free(writer->views[i].own);
    free(writer->views);
    free(writer->accessors);
}
