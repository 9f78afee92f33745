// Numbers of accessors, sparse ones included, read into streams.

#include <string.h>

#include "scene/gltf/gltf_reader.h"

// Accessors need not be aligned in memory (lint, for us), so each component is copied out.
static uint32_t load_unsigned(const uint8_t *at, uint32_t component_type)
{
    uint16_t half;
    uint32_t word;
    switch (component_type) {
    case 5121:
        return *at;
    case 5123:
        memcpy(&half, at, sizeof half);
        return half;
    default:
        memcpy(&word, at, sizeof word);
        return word;
    }
}

static float load_float(const uint8_t *at, uint32_t component_type, bool normalized)
{
    int16_t half;
    float real, value;
    switch (component_type) {
    case 5120:
        value = (float)(int8_t)*at;
        return !normalized ? value : value < -127 ? -1 : value / 127;
    case 5121:
        value = (float)*at;
        return normalized ? value / 255 : value;
    case 5122:
        memcpy(&half, at, sizeof half);
        value = (float)half;
        return !normalized ? value : value < -32767 ? -1 : value / 32767;
    case 5123:
        value = (float)load_unsigned(at, component_type);
        return normalized ? value / 65535 : value;
    case 5125:
        return (float)load_unsigned(at, component_type);
    default:
        memcpy(&real, at, sizeof real);
        return real;
    }
}

static void load_element(const struct bd_gltf_accessor *accessor, const uint8_t *at, uint32_t width,
                         float *out)
{
    uint32_t component = bd_gltf_component_bytes(accessor->component_type);
    uint32_t column = bd_gltf_element_bytes(accessor) / accessor->column_count;
    for (uint32_t c = 0; c < accessor->column_count; c++)
        for (uint32_t r = 0; r < accessor->row_count; r++) {
            uint32_t slot = c * accessor->row_count + r;
            if (slot >= width) return;
            out[slot] = load_float(at + c * column + r * component, accessor->component_type,
                                   accessor->normalized);
        }
}

static const uint8_t *view_bytes(const struct bd_gltf_reader *reader, int32_t view, uint64_t offset)
{
    const struct bd_gltf_view *in = &reader->doc->views[view];
    return reader->doc->buffers[in->buffer].bytes + in->offset_bytes + offset;
}

static enum bd_err sparse_index(struct bd_gltf_reader *reader, int32_t index, int64_t i,
                                uint64_t *out)
{
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[index];
    uint32_t bytes = bd_gltf_component_bytes(accessor->sparse_index_type);
    const uint8_t *base = view_bytes(reader, accessor->sparse_index_view,
                                     (uint64_t)accessor->sparse_index_offset_bytes);
    *out = load_unsigned(base + (uint64_t)i * bytes, accessor->sparse_index_type);
    if (*out < accessor->count) return BD_ERR_OK;
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                      bd_gltf_path("accessors[%d].sparse.indices", index).text,
                      "element %lld names %llu of %llu", (long long)i, (unsigned long long)*out,
                      (unsigned long long)accessor->count);
}

static const uint8_t *sparse_value(const struct bd_gltf_reader *reader,
                                   const struct bd_gltf_accessor *accessor, int64_t i)
{
    const uint8_t *base = view_bytes(reader, accessor->sparse_value_view,
                                     (uint64_t)accessor->sparse_value_offset_bytes);
    return base + (uint64_t)i * bd_gltf_element_bytes(accessor);
}

// Where in the ascending `pick` an element is; BD_NONE if it was not picked.
static int64_t find_pick(const uint32_t *pick, uint32_t pick_count, uint64_t element)
{
    uint32_t low = 0, high = pick_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (pick[middle] < element)
            low = middle + 1;
        else
            high = middle;
    }
    return low < pick_count && pick[low] == element ? (int64_t)low : BD_NONE;
}

static enum bd_err read_sparse_floats(struct bd_gltf_reader *reader, int32_t index,
                                      const uint32_t *pick, uint32_t pick_count, uint32_t width,
                                      float *out)
{
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[index];
    for (int64_t i = 0; i < accessor->sparse_count; i++) {
        uint64_t element;
        enum bd_err err = sparse_index(reader, index, i, &element);
        if (err != BD_ERR_OK) return err;
        int64_t at = find_pick(pick, pick_count, element);
        if (at != BD_NONE)
            load_element(accessor, sparse_value(reader, accessor, i), width,
                         out + (uint64_t)at * width);
    }
    return BD_ERR_OK;
}

enum bd_err bd_gltf_read_floats(struct bd_gltf_reader *reader, int32_t index, const uint32_t *pick,
                                uint32_t pick_count, uint32_t width, float *out)
{
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[index];
    if (accessor->view != BD_NONE) {
        const uint8_t *base = view_bytes(reader, accessor->view, accessor->offset_bytes);
        uint64_t stride = bd_gltf_stride_bytes(reader, accessor);
        for (uint32_t i = 0; i < pick_count; i++)
            load_element(accessor, base + pick[i] * stride, width, out + (uint64_t)i * width);
    } else {
        uint32_t own = accessor->row_count * accessor->column_count;
        for (uint32_t i = 0; i < pick_count; i++)
            memset(out + (uint64_t)i * width, 0, (own < width ? own : width) * sizeof *out);
    }
    if (!accessor->is_sparse) return BD_ERR_OK;
    return read_sparse_floats(reader, index, pick, pick_count, width, out);
}

enum bd_err bd_gltf_read_indices(struct bd_gltf_reader *reader, int32_t index, uint32_t *out)
{
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[index];
    if (accessor->view == BD_NONE) {
        memset(out, 0, accessor->count * sizeof *out);
    } else {
        const uint8_t *base = view_bytes(reader, accessor->view, accessor->offset_bytes);
        uint64_t stride = bd_gltf_stride_bytes(reader, accessor);
        for (uint64_t i = 0; i < accessor->count; i++)
            out[i] = load_unsigned(base + i * stride, accessor->component_type);
    }
    for (int64_t i = 0; accessor->is_sparse && i < accessor->sparse_count; i++) {
        uint64_t element;
        enum bd_err err = sparse_index(reader, index, i, &element);
        if (err != BD_ERR_OK) return err;
        out[element] = load_unsigned(sparse_value(reader, accessor, i), accessor->component_type);
    }
    return BD_ERR_OK;
}

int32_t bd_gltf_attribute(const struct bd_gltf_attributes *attributes, const char *name)
{
    for (uint32_t i = 0; i < attributes->count; i++)
        if (strcmp(attributes->items[i].name, name) == 0) return attributes->items[i].accessor;
    return BD_NONE;
}
