// Buffers, views and accessors: that each lies within what it is of, before anything reads them.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/gltf/gltf_schema.h"
#include "scene/model/object_fields.h"

// What the caller of CHECK_INDEX needs when an index is out of range.
static enum bd_err unresolved(struct bd_gltf_reader *reader, struct bd_gltf_path path,
                              int32_t index, uint32_t count)
{
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, path.text,
                      "index %d out of range, there are %u", index, count);
}

static bool is_optional_index(int32_t index, uint32_t count)
{
    return index == BD_NONE || (index >= 0 && (uint32_t)index < count);
}

static bool is_index(int32_t index, uint32_t count)
{
    return index >= 0 && (uint32_t)index < count;
}

#define CHECK(found, index, count, ...)                                                            \
    do {                                                                                           \
        if (!found(index, count))                                                                  \
            return unresolved(reader, bd_gltf_path(__VA_ARGS__), index, count);                    \
    } while (0)

uint32_t bd_gltf_component_bytes(uint32_t component_type)
{
    switch (component_type) {
    case 5120:
        return 1;
    case 5121:
        return 1;
    case 5122:
        return 2;
    case 5123:
        return 2;
    case 5125:
        return 4;
    case 5126:
        return 4;
    default:
        return 0;
    }
}

// Each column of a matrix starts at a multiple of four bytes.
uint32_t bd_gltf_element_bytes(const struct bd_gltf_accessor *accessor)
{
    uint32_t column = accessor->row_count * bd_gltf_component_bytes(accessor->component_type);
    if (accessor->column_count > 1) column = (column + 3) & ~3u;
    return column * accessor->column_count;
}

// The last element of an accessor need not have the padding after its last column.
static uint32_t last_element_bytes(const struct bd_gltf_accessor *accessor)
{
    uint32_t column = accessor->row_count * bd_gltf_component_bytes(accessor->component_type);
    return bd_gltf_element_bytes(accessor) / accessor->column_count * (accessor->column_count - 1) +
           column;
}

uint32_t bd_gltf_stride_bytes(const struct bd_gltf_reader *reader,
                              const struct bd_gltf_accessor *accessor)
{
    uint32_t stride =
        accessor->view == BD_NONE ? 0 : reader->doc->views[accessor->view].stride_bytes;
    return stride ? stride : bd_gltf_element_bytes(accessor);
}

static enum bd_err check_views(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    for (uint32_t i = 0; i < doc->view_count; i++) {
        const struct bd_gltf_view *view = &doc->views[i];
        CHECK(is_index, view->buffer, doc->buffer_count, "bufferViews[%u].buffer", i);
        uint64_t size = doc->buffers[view->buffer].size_bytes;
        if (view->offset_bytes > size || view->length_bytes > size - view->offset_bytes)
            return bd_err_set(
                reader->detail, BD_ERR_BAD_INPUT, bd_gltf_path("bufferViews[%u]", i).text,
                "bytes %llu + %llu lie outside buffer %d of %llu bytes",
                (unsigned long long)view->offset_bytes, (unsigned long long)view->length_bytes,
                view->buffer, (unsigned long long)size);
    }
    return BD_ERR_OK;
}

// `count` elements of `element` bytes, `stride` apart, from `offset` inside the view? Counts are
// compared by division, so that no product overflows.
static bool fits(const struct bd_gltf_view *view, uint64_t offset, uint64_t count, uint64_t element,
                 uint64_t stride)
{
    if (count == 0) return true;
    if (offset > view->length_bytes || element > view->length_bytes - offset) return false;
    return count - 1 <= (view->length_bytes - offset - element) / stride;
}

static enum bd_err too_long(struct bd_gltf_reader *reader, struct bd_gltf_path path, int32_t view)
{
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, path.text,
                      "elements lie outside buffer view %d of %llu bytes", view,
                      (unsigned long long)reader->doc->views[view].length_bytes);
}

static enum bd_err check_sparse(struct bd_gltf_reader *reader, uint32_t i)
{
    const struct bd_gltf_document *doc = reader->doc;
    const struct bd_gltf_accessor *accessor = &doc->accessors[i];
    CHECK(is_index, accessor->sparse_index_view, doc->view_count,
          "accessors[%u].sparse.indices.bufferView", i);
    CHECK(is_index, accessor->sparse_value_view, doc->view_count,
          "accessors[%u].sparse.values.bufferView", i);
    uint32_t index_bytes = bd_gltf_component_bytes(accessor->sparse_index_type);
    if (index_bytes == 0 || accessor->sparse_index_type == 5120 ||
        accessor->sparse_index_type == 5122 || accessor->sparse_index_type == 5126)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                          bd_gltf_path("accessors[%u].sparse.indices.componentType", i).text,
                          "%u is not an unsigned integer type", accessor->sparse_index_type);
    if (accessor->sparse_count < 0 || (uint64_t)accessor->sparse_count > accessor->count)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                          bd_gltf_path("accessors[%u].sparse.count", i).text,
                          "%lld of %llu elements", (long long)accessor->sparse_count,
                          (unsigned long long)accessor->count);
    uint64_t count = (uint64_t)accessor->sparse_count, element = bd_gltf_element_bytes(accessor);
    int64_t index_offset = accessor->sparse_index_offset_bytes;
    int64_t value_offset = accessor->sparse_value_offset_bytes;
    if (index_offset < 0 || !fits(&doc->views[accessor->sparse_index_view], (uint64_t)index_offset,
                                  count, index_bytes, index_bytes))
        return too_long(reader, bd_gltf_path("accessors[%u].sparse.indices", i),
                        accessor->sparse_index_view);
    if (value_offset < 0 || !fits(&doc->views[accessor->sparse_value_view], (uint64_t)value_offset,
                                  count, last_element_bytes(accessor), element))
        return too_long(reader, bd_gltf_path("accessors[%u].sparse.values", i),
                        accessor->sparse_value_view);
    return BD_ERR_OK;
}

// An accessor without a view is all zeros, and costs the file nothing: what it may then make us
// allocate is tied to the file's size.
static enum bd_err check_zeros(struct bd_gltf_reader *reader, uint32_t i)
{
    uint64_t most = reader->input_bytes > 65536 ? reader->input_bytes : 65536;
    if (reader->doc->accessors[i].count <= most) return BD_ERR_OK;
    return bd_err_set(reader->detail, BD_ERR_LIMIT, bd_gltf_path("accessors[%u].count", i).text,
                      "%llu elements without a buffer view, limit %llu",
                      (unsigned long long)reader->doc->accessors[i].count,
                      (unsigned long long)most);
}

static enum bd_err check_accessor(struct bd_gltf_reader *reader, uint32_t i)
{
    const struct bd_gltf_document *doc = reader->doc;
    const struct bd_gltf_accessor *accessor = &doc->accessors[i];
    CHECK(is_optional_index, accessor->view, doc->view_count, "accessors[%u].bufferView", i);
    if (bd_gltf_component_bytes(accessor->component_type) == 0)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                          bd_gltf_path("accessors[%u].componentType", i).text,
                          "%u is not a component type", accessor->component_type);
    if (accessor->count > INT32_MAX)
        return bd_err_set(reader->detail, BD_ERR_LIMIT, bd_gltf_path("accessors[%u].count", i).text,
                          "%llu elements, limit %d", (unsigned long long)accessor->count,
                          INT32_MAX);
    if (accessor->view == BD_NONE) {
        enum bd_err err = check_zeros(reader, i);
        if (err != BD_ERR_OK) return err;
    } else {
        uint32_t stride = bd_gltf_stride_bytes(reader, accessor);
        uint32_t element = bd_gltf_element_bytes(accessor);
        if (stride < element)
            return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                              bd_gltf_path("bufferViews[%d].byteStride", accessor->view).text,
                              "%u bytes, elements of accessor %u have %u", stride, i, element);
        if (!fits(&doc->views[accessor->view], accessor->offset_bytes, accessor->count,
                  last_element_bytes(accessor), stride))
            return too_long(reader, bd_gltf_path("accessors[%u]", i), accessor->view);
    }
    return accessor->is_sparse ? check_sparse(reader, i) : BD_ERR_OK;
}

static enum bd_err check_attributes(struct bd_gltf_reader *reader, struct bd_gltf_path path,
                                    const struct bd_gltf_attributes *attributes)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < attributes->count; i++) {
        const struct bd_gltf_attribute *attribute = &attributes->items[i];
        CHECK(is_index, attribute->accessor, reader->doc->accessor_count, "%.80s.%.40s", path.text,
              attribute->name);
        uint64_t own = reader->doc->accessors[attribute->accessor].count;
        if (i > 0 && own != count)
            return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                              bd_gltf_path("%.80s.%.40s", path.text, attribute->name).text,
                              "%llu elements, other attributes have %llu", (unsigned long long)own,
                              (unsigned long long)count);
        count = own;
    }
    return BD_ERR_OK;
}

// The shapes and types that the specification and KHR_mesh_quantization allow, as far as reading
// depends on them.
static enum bd_err check_attribute_shapes(struct bd_gltf_reader *reader, struct bd_gltf_path path,
                                          const struct bd_gltf_attributes *attributes)
{
    static const struct {
        const char *name;
        uint32_t rows_min, rows_max;
        bool prefix;
    } shapes[] = {{"POSITION", 3, 3, false}, {"NORMAL", 3, 3, false}, {"TANGENT", 3, 4, false},
                  {"TEXCOORD_", 2, 2, true}, {"COLOR_", 3, 4, true},  {"JOINTS_", 4, 4, true},
                  {"WEIGHTS_", 4, 4, true}};
    for (uint32_t i = 0; i < attributes->count; i++) {
        const char *name = attributes->items[i].name;
        const struct bd_gltf_accessor *accessor =
            &reader->doc->accessors[attributes->items[i].accessor];
        for (size_t s = 0; s < sizeof shapes / sizeof shapes[0]; s++) {
            bool same = shapes[s].prefix
                            ? strncmp(name, shapes[s].name, strlen(shapes[s].name)) == 0
                            : strcmp(name, shapes[s].name) == 0;
            if (!same) continue;
            if (accessor->column_count != 1 || accessor->row_count < shapes[s].rows_min ||
                accessor->row_count > shapes[s].rows_max || accessor->component_type == 5125)
                return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                                  bd_gltf_path("%.80s.%.40s", path.text, name).text,
                                  "accessor %d has the wrong type for this attribute",
                                  attributes->items[i].accessor);
        }
    }
    return BD_ERR_OK;
}

static enum bd_err check_indices(struct bd_gltf_reader *reader, struct bd_gltf_path path,
                                 int32_t indices)
{
    CHECK(is_optional_index, indices, reader->doc->accessor_count, "%.100s.indices", path.text);
    if (indices == BD_NONE) return BD_ERR_OK;
    const struct bd_gltf_accessor *accessor = &reader->doc->accessors[indices];
    bool is_unsigned = accessor->component_type == 5121 || accessor->component_type == 5123 ||
                       accessor->component_type == 5125;
    if (is_unsigned && accessor->row_count == 1 && accessor->column_count == 1) return BD_ERR_OK;
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                      bd_gltf_path("%.100s.indices", path.text).text,
                      "accessor %d is not of unsigned scalars", indices);
}

static enum bd_err check_primitive(struct bd_gltf_reader *reader, uint32_t m, uint32_t p)
{
    const struct bd_gltf_primitive *primitive = &reader->doc->meshes[m].primitives[p];
    struct bd_gltf_path path = bd_gltf_path("meshes[%u].primitives[%u]", m, p);
    struct bd_gltf_path attributes = bd_gltf_path("%.80s.attributes", path.text);
    if (primitive->mode < 0 || primitive->mode > 6)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                          bd_gltf_path("%.100s.mode", path.text).text, "%d is not a mode",
                          primitive->mode);
    CHECK(is_optional_index, primitive->material, reader->doc->material_count, "%.100s.material",
          path.text);
    enum bd_err err = check_indices(reader, path, primitive->indices);
    if (err == BD_ERR_OK) err = check_attributes(reader, attributes, &primitive->attributes);
    if (err == BD_ERR_OK) err = check_attribute_shapes(reader, attributes, &primitive->attributes);
    for (uint32_t t = 0; err == BD_ERR_OK && t < primitive->target_count; t++) {
        struct bd_gltf_path target = bd_gltf_path("%.80s.targets[%u]", path.text, t);
        err = check_attributes(reader, target, &primitive->targets[t]);
        if (err == BD_ERR_OK) err = check_attribute_shapes(reader, target, &primitive->targets[t]);
        int32_t position = bd_gltf_attribute(&primitive->attributes, "POSITION");
        if (err == BD_ERR_OK && position != BD_NONE && primitive->targets[t].count > 0 &&
            reader->doc->accessors[primitive->targets[t].items[0].accessor].count !=
                reader->doc->accessors[position].count)
            err = bd_err_set(reader->detail, BD_ERR_BAD_INPUT, target.text,
                             "not as many elements as the attributes");
    }
    return err;
}

static enum bd_err check_map(struct bd_gltf_reader *reader, uint32_t i, const char *path)
{
    const struct bd_gltf_texture_info info = bd_gltf_material_map(reader->doc, i, path);
    CHECK(is_optional_index, info.texture, reader->doc->texture_count, "materials[%u].%s.index", i,
          path);
    return BD_ERR_OK;
}

// Maps that nobody reads here, too: a file that names what it has not is refused.
static enum bd_err check_material(struct bd_gltf_reader *reader, uint32_t i)
{
    const struct bd_object_field *row;
    enum bd_err err = BD_ERR_OK;
    for (int n = 0; !err && bd_gltf_unread_maps[n]; n++)
        err = check_map(reader, i, bd_gltf_unread_maps[n]);
    for (uint32_t n = 0; !err && (row = bd_material_map_row(n)); n++)
        err = check_map(reader, i, row->gltf);
    return err;
}

static enum bd_err check_textures(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    for (uint32_t i = 0; i < doc->texture_count; i++) {
        CHECK(is_optional_index, doc->textures[i].source, doc->image_count, "textures[%u].source",
              i);
        CHECK(is_optional_index, doc->textures[i].sampler, doc->sampler_count,
              "textures[%u].sampler", i);
    }
    for (uint32_t i = 0; i < doc->image_count; i++)
        CHECK(is_optional_index, doc->images[i].view, doc->view_count, "images[%u].bufferView", i);
    return BD_ERR_OK;
}

static enum bd_err check_skin(struct bd_gltf_reader *reader, uint32_t i)
{
    const struct bd_gltf_document *doc = reader->doc;
    const struct bd_gltf_skin *skin = &doc->skins[i];
    for (uint32_t j = 0; j < skin->joint_count; j++)
        CHECK(is_index, skin->joints[j], doc->node_count, "skins[%u].joints[%u]", i, j);
    int32_t matrices = skin->inverse_bind_matrices;
    CHECK(is_optional_index, matrices, doc->accessor_count, "skins[%u].inverseBindMatrices", i);
    if (matrices == BD_NONE) return BD_ERR_OK;
    const struct bd_gltf_accessor *accessor = &doc->accessors[matrices];
    if (accessor->column_count == 4 && accessor->component_type == 5126 &&
        accessor->count >= skin->joint_count)
        return BD_ERR_OK;
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                      bd_gltf_path("skins[%u].inverseBindMatrices", i).text,
                      "accessor %d is not of %u float matrices", matrices, skin->joint_count);
}

static enum bd_err check_node(struct bd_gltf_reader *reader, uint32_t i)
{
    const struct bd_gltf_document *doc = reader->doc;
    const struct bd_gltf_node *node = &doc->nodes[i];
    CHECK(is_optional_index, node->mesh, doc->mesh_count, "nodes[%u].mesh", i);
    CHECK(is_optional_index, node->skin, doc->skin_count, "nodes[%u].skin", i);
    CHECK(is_optional_index, node->camera, doc->camera_count, "nodes[%u].camera", i);
    CHECK(is_optional_index, node->light, doc->light_count,
          "nodes[%u].extensions.KHR_lights_punctual.light", i);
    for (uint32_t c = 0; c < node->child_count; c++)
        CHECK(is_index, node->children[c], doc->node_count, "nodes[%u].children[%u]", i, c);
    return BD_ERR_OK;
}

// Which of "scene", "scenes[0]" is shown; BD_NONE if the file has no scenes.
static enum bd_err check_scenes(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    CHECK(is_optional_index, doc->default_scene, doc->scene_count, "scene%s", "");
    for (uint32_t i = 0; i < doc->scene_count; i++)
        for (uint32_t n = 0; n < doc->scenes[i].node_count; n++)
            CHECK(is_index, doc->scenes[i].nodes[n], doc->node_count, "scenes[%u].nodes[%u]", i, n);
    return BD_ERR_OK;
}

enum bd_err bd_gltf_check(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    enum bd_err err = check_views(reader);
    for (uint32_t i = 0; err == BD_ERR_OK && i < doc->accessor_count; i++)
        err = check_accessor(reader, i);
    for (uint32_t m = 0; err == BD_ERR_OK && m < doc->mesh_count; m++)
        for (uint32_t p = 0; err == BD_ERR_OK && p < doc->meshes[m].primitive_count; p++)
            err = check_primitive(reader, m, p);
    for (uint32_t i = 0; err == BD_ERR_OK && i < doc->material_count; i++)
        err = check_material(reader, i);
    if (err == BD_ERR_OK) err = check_textures(reader);
    for (uint32_t i = 0; err == BD_ERR_OK && i < doc->skin_count; i++) err = check_skin(reader, i);
    for (uint32_t i = 0; err == BD_ERR_OK && i < doc->node_count; i++) err = check_node(reader, i);
    if (err == BD_ERR_OK) err = check_scenes(reader);
    return err;
}
