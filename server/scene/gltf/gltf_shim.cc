// tinygltf behind C: the bytes of a document in, plain structs out, nothing thrown.

#include "scene/gltf/gltf_shim.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <vector>

// Debian ships the library compiled with its own image code, which is never called: both loaders
// below replace it. The header is only its interface.
//
// tinygltf 2.7.0 leaves out properties of the wrong type without a word, shifts the indices of
// later primitives where ParsePrimitive fails, and wants byteLength to be exactly the file's size.
#include <tiny_gltf.h>

#include "scene/model/scene.h"

namespace
{

// Serves files from the table, and counts.
struct FileTable {
    const struct bd_import_file *files;
    uint32_t count;
    uint64_t bytes_left;
};

int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::string percent_decoded(const std::string &text)
{
    std::string out;
    for (size_t i = 0; i < text.size(); i++) {
        bool escaped = text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 &&
                       hex_digit(text[i + 2]) >= 0;
        if (!escaped) {
            out += text[i];
            continue;
        }
        out += (char)(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
        i += 2;
    }
    return out;
}

const struct bd_import_file *find_file(const struct bd_import_file *files, uint32_t count,
                                       const std::string &uri)
{
    std::string decoded = percent_decoded(uri);
    for (uint32_t i = 0; i < count; i++)
        if (files[i].uri == uri || files[i].uri == decoded ||
            percent_decoded(files[i].uri) == decoded)
            return &files[i];
    return nullptr;
}

bool file_exists(const std::string &name, void *user)
{
    auto *table = static_cast<FileTable *>(user);
    return find_file(table->files, table->count, name) != nullptr;
}

std::string expand_path(const std::string &name, void *)
{
    return name;
}

bool read_file(std::vector<unsigned char> *out, std::string *error, const std::string &name,
               void *user)
{
    auto *table = static_cast<FileTable *>(user);
    const struct bd_import_file *file = find_file(table->files, table->count, name);
    if (!file) return false;
    if (file->size_bytes > table->bytes_left) {
        *error = "files are named too many times";
        return false;
    }
    table->bytes_left -= file->size_bytes;
    auto *bytes = static_cast<const unsigned char *>(file->bytes);
    out->assign(bytes, bytes + file->size_bytes);
    return true;
}

bool write_file(std::string *, const std::string &, const std::vector<unsigned char> &, void *)
{
    return false;
}

// Keeps what only tinygltf has: the bytes of a data uri. A picture in a buffer view or in a file
// of the table is found again by gltf_pictures.c, which checks bounds (tinygltf does not).
bool keep_encoded(tinygltf::Image *image, const int, std::string *, std::string *, int, int,
                  const unsigned char *bytes, int size, void *)
{
    if (image->bufferView == -1 && image->uri.empty() && size > 0)
        image->image.assign(bytes, bytes + size);
    return true;
}

// Every array of the document, freed with it.
class Document : public bd_gltf_document
{
  public:
    Document() : bd_gltf_document() {}

    tinygltf::Model model;

    template <typename T> T *array(size_t count)
    {
        auto block = std::make_unique<unsigned char[]>(count * sizeof(T) + 1); // zeroed
        T *items = reinterpret_cast<T *>(block.get());
        blocks_.push_back(std::move(block));
        return items;
    }

  private:
    std::vector<std::unique_ptr<unsigned char[]>> blocks_;
};

// Of an array that may be shorter than asked: the rest stays as it is.
void copy_numbers(double *out, size_t count, const std::vector<double> &in)
{
    for (size_t i = 0; i < count && i < in.size(); i++) out[i] = in[i];
}

const tinygltf::Value *extension(const tinygltf::ExtensionMap &map, const char *name)
{
    auto found = map.find(name);
    return found != map.end() && found->second.IsObject() ? &found->second : nullptr;
}

double number(const tinygltf::Value *object, const char *key, double otherwise)
{
    if (!object || !object->Has(key) || !object->Get(key).IsNumber()) return otherwise;
    return object->Get(key).GetNumberAsDouble();
}

bool boolean(const tinygltf::Value *object, const char *key, bool otherwise)
{
    if (!object || !object->Has(key) || !object->Get(key).IsBool()) return otherwise;
    return object->Get(key).Get<bool>();
}

int32_t integer(const tinygltf::Value *object, const char *key, int32_t otherwise)
{
    double value = number(object, key, otherwise);
    return value >= -1 && value <= std::numeric_limits<int32_t>::max() ? (int32_t)value : otherwise;
}

void numbers(const tinygltf::Value *object, const char *key, double *out, int count)
{
    if (!object || !object->Has(key) || !object->Get(key).IsArray()) return;
    const tinygltf::Value &array = object->Get(key);
    for (int i = 0; i < count && i < (int)array.ArrayLen(); i++)
        if (array.Get(i).IsNumber()) out[i] = array.Get(i).GetNumberAsDouble();
}

bd_gltf_texture_info texture_info(int32_t texture, int32_t uv_set, const tinygltf::Value *transform)
{
    bd_gltf_texture_info info = {texture, uv_set, {0, 0}, 0, {1, 1}};
    info.uv_set = integer(transform, "texCoord", uv_set);
    info.rotation = number(transform, "rotation", 0);
    numbers(transform, "offset", info.offset, 2);
    numbers(transform, "scale", info.scale, 2);
    return info;
}

template <typename Info> bd_gltf_texture_info texture_info_of(const Info &info)
{
    return texture_info(info.index, info.texCoord,
                        extension(info.extensions, "KHR_texture_transform"));
}

// A texture info inside an extension is a generic value.
bd_gltf_texture_info texture_info_in(const tinygltf::Value *info)
{
    if (!info || !info->IsObject()) return texture_info(BD_NONE, 0, nullptr);
    const tinygltf::Value *transform = nullptr;
    if (info->Has("extensions") && info->Get("extensions").IsObject() &&
        info->Get("extensions").Get("KHR_texture_transform").IsObject())
        transform = &info->Get("extensions").Get("KHR_texture_transform");
    return texture_info(integer(info, "index", BD_NONE), integer(info, "texCoord", 0), transform);
}

void copy_buffers(Document *doc)
{
    const tinygltf::Model &model = doc->model;
    doc->buffer_count = (uint32_t)model.buffers.size();
    doc->buffers = doc->array<bd_gltf_buffer>(doc->buffer_count);
    for (uint32_t i = 0; i < doc->buffer_count; i++)
        doc->buffers[i] = {model.buffers[i].data.data(), model.buffers[i].data.size()};
    doc->view_count = (uint32_t)model.bufferViews.size();
    doc->views = doc->array<bd_gltf_view>(doc->view_count);
    for (uint32_t i = 0; i < doc->view_count; i++) {
        const tinygltf::BufferView &view = model.bufferViews[i];
        doc->views[i] = {view.buffer, view.byteOffset, view.byteLength, (uint32_t)view.byteStride};
    }
}

void set_shape(bd_gltf_accessor *out, int type)
{
    switch (type) {
    case TINYGLTF_TYPE_VEC2:
        out->row_count = 2, out->column_count = 1;
        return;
    case TINYGLTF_TYPE_VEC3:
        out->row_count = 3, out->column_count = 1;
        return;
    case TINYGLTF_TYPE_VEC4:
        out->row_count = 4, out->column_count = 1;
        return;
    case TINYGLTF_TYPE_MAT2:
        out->row_count = 2, out->column_count = 2;
        return;
    case TINYGLTF_TYPE_MAT3:
        out->row_count = 3, out->column_count = 3;
        return;
    case TINYGLTF_TYPE_MAT4:
        out->row_count = 4, out->column_count = 4;
        return;
    default:
        out->row_count = 1, out->column_count = 1;
        return;
    }
}

void copy_accessors(Document *doc)
{
    doc->accessor_count = (uint32_t)doc->model.accessors.size();
    doc->accessors = doc->array<bd_gltf_accessor>(doc->accessor_count);
    for (uint32_t i = 0; i < doc->accessor_count; i++) {
        const tinygltf::Accessor &in = doc->model.accessors[i];
        bd_gltf_accessor *out = &doc->accessors[i];
        out->view = in.bufferView;
        out->offset_bytes = in.byteOffset;
        out->count = in.count;
        out->component_type = (uint32_t)in.componentType;
        set_shape(out, in.type);
        out->normalized = in.normalized;
        out->is_sparse = in.sparse.isSparse;
        if (!in.sparse.isSparse) continue;
        out->sparse_count = in.sparse.count;
        out->sparse_index_view = in.sparse.indices.bufferView;
        out->sparse_index_offset_bytes = in.sparse.indices.byteOffset;
        out->sparse_index_type = (uint32_t)in.sparse.indices.componentType;
        out->sparse_value_view = in.sparse.values.bufferView;
        out->sparse_value_offset_bytes = in.sparse.values.byteOffset;
    }
}

bd_gltf_attributes attributes_of(Document *doc, const std::map<std::string, int> &in)
{
    auto *items = doc->array<bd_gltf_attribute>(in.size());
    uint32_t count = 0;
    for (const auto &entry : in) items[count++] = {entry.first.c_str(), entry.second};
    return {count, items};
}

void copy_primitive(Document *doc, const tinygltf::Primitive &in, bd_gltf_primitive *out)
{
    out->attributes = attributes_of(doc, in.attributes);
    out->target_count = (uint32_t)in.targets.size();
    auto *targets = doc->array<bd_gltf_attributes>(in.targets.size());
    for (uint32_t i = 0; i < out->target_count; i++) targets[i] = attributes_of(doc, in.targets[i]);
    out->targets = targets;
    out->indices = in.indices;
    out->material = in.material;
    out->mode = in.mode;
}

void copy_meshes(Document *doc)
{
    doc->mesh_count = (uint32_t)doc->model.meshes.size();
    doc->meshes = doc->array<bd_gltf_mesh>(doc->mesh_count);
    for (uint32_t i = 0; i < doc->mesh_count; i++) {
        const tinygltf::Mesh &in = doc->model.meshes[i];
        auto *primitives = doc->array<bd_gltf_primitive>(in.primitives.size());
        for (size_t p = 0; p < in.primitives.size(); p++)
            copy_primitive(doc, in.primitives[p], &primitives[p]);
        doc->meshes[i] = {in.name.c_str(), (uint32_t)in.primitives.size(), primitives,
                          (uint32_t)in.weights.size(), in.weights.data()};
    }
}

void copy_node(const tinygltf::Node &in, bd_gltf_node *out)
{
    *out = {in.name.c_str(),
            in.mesh,
            in.skin,
            in.camera,
            BD_NONE,
            !boolean(extension(in.extensions, "KHR_node_visibility"), "visible", true),
            (uint32_t)in.children.size(),
            in.children.data(),
            false,
            {},
            {0, 0, 0},
            {0, 0, 0, 1},
            {1, 1, 1},
            (uint32_t)in.weights.size(),
            in.weights.data()};
    out->light = integer(extension(in.extensions, "KHR_lights_punctual"), "light", BD_NONE);
    out->has_matrix = !in.matrix.empty();
    copy_numbers(out->matrix, 16, in.matrix);
    copy_numbers(out->translation, 3, in.translation);
    copy_numbers(out->rotation, 4, in.rotation);
    copy_numbers(out->scale, 3, in.scale);
}

void copy_hierarchy(Document *doc)
{
    const tinygltf::Model &model = doc->model;
    doc->node_count = (uint32_t)model.nodes.size();
    doc->nodes = doc->array<bd_gltf_node>(doc->node_count);
    for (uint32_t i = 0; i < doc->node_count; i++) copy_node(model.nodes[i], &doc->nodes[i]);
    doc->skin_count = (uint32_t)model.skins.size();
    doc->skins = doc->array<bd_gltf_skin>(doc->skin_count);
    for (uint32_t i = 0; i < doc->skin_count; i++)
        doc->skins[i] = {(uint32_t)model.skins[i].joints.size(), model.skins[i].joints.data(),
                         model.skins[i].inverseBindMatrices};
    doc->scene_count = (uint32_t)model.scenes.size();
    doc->scenes = doc->array<bd_gltf_scene>(doc->scene_count);
    for (uint32_t i = 0; i < doc->scene_count; i++)
        doc->scenes[i] = {(uint32_t)model.scenes[i].nodes.size(), model.scenes[i].nodes.data()};
    doc->default_scene = model.defaultScene;
}

// --- materials, by paths
// --------------------------------------------------------------------------

// "extensions.KHR_materials_ior.ior" without its first part, which is returned.
std::string_view first_part(std::string_view *path)
{
    const size_t dot = std::min(path->find('.'), path->size());
    const std::string_view part = path->substr(0, dot);
    path->remove_prefix(std::min(dot + 1, path->size()));
    return part;
}

// Without a copy of the key, so that nothing is thrown.
template <typename Map> const typename Map::mapped_type *find(const Map &map, std::string_view key)
{
    for (const auto &entry : map)
        if (entry.first == key) return &entry.second;
    return nullptr;
}

const tinygltf::Value *find_in(const tinygltf::Value *object, std::string_view key)
{
    if (!object || !object->IsObject()) return nullptr;
    return find(object->Get<tinygltf::Value::Object>(), key);
}

// A property of the material itself, of its "pbrMetallicRoughness", or within an extension.
struct Place {
    const tinygltf::Parameter *parameter;
    const tinygltf::Value *value;
    std::string_view rest; // a property of the parameter's
};

Place place_of(const tinygltf::Material &in, std::string_view path)
{
    std::string_view first = first_part(&path);
    if (first == "extensions") {
        const tinygltf::Value *value = find(in.extensions, first_part(&path));
        return {nullptr, path.empty() ? value : find_in(value, path), {}};
    }
    const bool is_pbr = first == "pbrMetallicRoughness";
    if (is_pbr) first = first_part(&path);
    return {find(is_pbr ? in.values : in.additionalValues, first), nullptr, path};
}

// What tinygltf reads of the core's maps; those of extensions are values.
bd_gltf_texture_info core_map(const tinygltf::Material &in, std::string_view path)
{
    const tinygltf::PbrMetallicRoughness &pbr = in.pbrMetallicRoughness;
    if (path == "pbrMetallicRoughness.baseColorTexture")
        return texture_info_of(pbr.baseColorTexture);
    if (path == "pbrMetallicRoughness.metallicRoughnessTexture")
        return texture_info_of(pbr.metallicRoughnessTexture);
    if (path == "normalTexture") return texture_info_of(in.normalTexture);
    if (path == "occlusionTexture") return texture_info_of(in.occlusionTexture);
    if (path == "emissiveTexture") return texture_info_of(in.emissiveTexture);
    return texture_info(BD_NONE, 0, nullptr);
}

void copy_materials(Document *doc)
{
    const tinygltf::Model &model = doc->model;
    doc->material_count = (uint32_t)model.materials.size();
    doc->texture_count = (uint32_t)model.textures.size();
    doc->textures = doc->array<bd_gltf_texture>(doc->texture_count);
    for (uint32_t i = 0; i < doc->texture_count; i++)
        doc->textures[i] = {model.textures[i].sampler, model.textures[i].source};
    doc->sampler_count = (uint32_t)model.samplers.size();
    doc->samplers = doc->array<bd_gltf_sampler>(doc->sampler_count);
    for (uint32_t i = 0; i < doc->sampler_count; i++)
        doc->samplers[i] = {model.samplers[i].magFilter, model.samplers[i].wrapS,
                            model.samplers[i].wrapT};
    doc->image_count = (uint32_t)model.images.size();
    doc->images = doc->array<bd_gltf_image>(doc->image_count);
    for (uint32_t i = 0; i < doc->image_count; i++) {
        const tinygltf::Image &in = model.images[i];
        doc->images[i] = {in.bufferView, in.uri.c_str(), in.image.data(), in.image.size()};
    }
}

void copy_lights(Document *doc)
{
    doc->light_count = (uint32_t)doc->model.lights.size();
    doc->lights = doc->array<bd_gltf_light>(doc->light_count);
    for (uint32_t i = 0; i < doc->light_count; i++) {
        const tinygltf::Light &in = doc->model.lights[i];
        bd_gltf_light *out = &doc->lights[i];
        *out = {in.name.c_str(),        in.type.c_str(),       {1, 1, 1}, in.intensity, in.range,
                in.spot.innerConeAngle, in.spot.outerConeAngle};
        copy_numbers(out->color, 3, in.color);
    }
}

void copy_cameras(Document *doc)
{
    doc->camera_count = (uint32_t)doc->model.cameras.size();
    doc->cameras = doc->array<bd_gltf_camera>(doc->camera_count);
    for (uint32_t i = 0; i < doc->camera_count; i++) {
        const tinygltf::Camera &in = doc->model.cameras[i];
        bool flat = in.type == "orthographic";
        doc->cameras[i] = {in.name.c_str(),
                           flat,
                           in.perspective.yfov,
                           in.orthographic.xmag,
                           in.orthographic.ymag,
                           flat ? in.orthographic.znear : in.perspective.znear,
                           flat ? in.orthographic.zfar : in.perspective.zfar};
    }
}

void copy_environment(Document *doc)
{
    const tinygltf::Value *in = extension(doc->model.extensions, "BOUNCED_environment");
    bd_gltf_environment *out = &doc->environment;
    out->is_there = in != nullptr;
    numbers(in, "radiance", out->radiance, 3);
    numbers(in, "rotation", out->rotation, 4);
    out->has_map = in && in->Has("map") && in->Get("map").IsObject();
    if (!out->has_map) return;
    const tinygltf::Value &map = in->Get("map");
    out->map = {integer(&map, "accessor", BD_NONE), integer(&map, "width", 0),
                integer(&map, "height", 0)};
}

void copy_model(Document *doc)
{
    copy_buffers(doc);
    copy_accessors(doc);
    copy_meshes(doc);
    copy_hierarchy(doc);
    copy_materials(doc);
    copy_lights(doc);
    copy_cameras(doc);
    copy_environment(doc);
    doc->extension_used_count = (uint32_t)doc->model.extensionsUsed.size();
    doc->extensions_used = doc->array<const char *>(doc->extension_used_count);
    for (uint32_t i = 0; i < doc->extension_used_count; i++)
        doc->extensions_used[i] = doc->model.extensionsUsed[i].c_str();
}

// Every file may be wanted as a buffer and as a few pictures, not a thousand times.
uint64_t read_budget_bytes(const struct bd_import_file *files, uint32_t count)
{
    uint64_t sum = 1 << 20;
    for (uint32_t i = 0; i < count; i++) sum += 8 * (uint64_t)files[i].size_bytes;
    return sum;
}

bool load(Document *doc, const uint8_t *bytes, size_t size, bool is_glb, FileTable *table,
          std::string *error)
{
    tinygltf::TinyGLTF loader;
    std::string warnings;
    loader.SetFsCallbacks({file_exists, expand_path, read_file, write_file, table});
    loader.SetImageLoader(keep_encoded, nullptr);
    if (is_glb)
        return loader.LoadBinaryFromMemory(&doc->model, error, &warnings, bytes, (unsigned int)size,
                                           "");
    return loader.LoadASCIIFromString(&doc->model, error, &warnings,
                                      reinterpret_cast<const char *>(bytes), (unsigned int)size,
                                      "");
}

std::string at(const char *array, size_t index, const char *member)
{
    return std::string(array) + "[" + std::to_string(index) + "]" + member;
}

// The primitive over whose indices tinygltf stopped, if it did.
std::string bad_indices(const tinygltf::Model &model)
{
    for (size_t m = 0; m < model.meshes.size(); m++)
        for (size_t p = 0; p < model.meshes[m].primitives.size(); p++) {
            int index = model.meshes[m].primitives[p].indices;
            if (index < 0) continue;
            std::string path = at("meshes", m, "") + at(".primitives", p, ".indices");
            if ((size_t)index >= model.accessors.size()) return path;
            int view = model.accessors[(size_t)index].bufferView;
            if (view < 0 || (size_t)view >= model.bufferViews.size()) return path;
        }
    return "";
}

// tinygltf does not say where it stopped; but it reads one array after the other, so what it has
// got tells what it was at.
enum bd_err refused(const tinygltf::Model &model, const std::string &error,
                    struct bd_err_detail *detail)
{
    std::string path;
    bool before_nodes = model.nodes.empty() && model.scenes.empty() && model.materials.empty();
    if (before_nodes && model.meshes.empty() && model.accessors.empty() &&
        model.bufferViews.empty())
        path = at("buffers", model.buffers.size(), ".uri");
    else if (before_nodes && !bad_indices(model).empty())
        path = bad_indices(model);
    else if (model.textures.empty() && model.skins.empty() && model.cameras.empty())
        path = at("images", model.images.size(), "");
    return bd_err_set(detail, BD_ERR_BAD_INPUT, path.c_str(), "%s",
                      error.substr(0, error.find('\n')).c_str());
}

const tinygltf::Material &material_of(const bd_gltf_document *document, uint32_t i)
{
    return static_cast<const Document *>(document)->model.materials[i];
}

} // namespace

const char *bd_gltf_material_name(const struct bd_gltf_document *document, uint32_t i)
{
    return material_of(document, i).name.c_str();
}

void bd_gltf_material_numbers(const struct bd_gltf_document *document, uint32_t i, const char *path,
                              uint32_t count, double *out)
{
    const Place place = place_of(material_of(document, i), path);
    if (place.parameter && !place.rest.empty()) {
        const double *number = find(place.parameter->json_double_value, place.rest);
        if (number) *out = *number;
    } else if (place.parameter && count > 1) {
        copy_numbers(out, count, place.parameter->number_array);
    } else if (place.parameter && place.parameter->has_number_value) {
        *out = place.parameter->number_value;
    } else if (place.value && place.value->IsNumber()) {
        *out = place.value->GetNumberAsDouble();
    } else if (place.value && place.value->IsArray()) {
        for (uint32_t n = 0; n < count && n < place.value->ArrayLen(); n++)
            if (place.value->Get((int)n).IsNumber())
                out[n] = place.value->Get((int)n).GetNumberAsDouble();
    }
}

bool bd_gltf_material_switch(const struct bd_gltf_document *document, uint32_t i, const char *path)
{
    const Place place = place_of(material_of(document, i), path);
    return place.parameter ? place.parameter->bool_value : place.value != nullptr;
}

const char *bd_gltf_material_text(const struct bd_gltf_document *document, uint32_t i,
                                  const char *path)
{
    const Place place = place_of(material_of(document, i), path);
    return place.parameter ? place.parameter->string_value.c_str() : "";
}

struct bd_gltf_texture_info bd_gltf_material_map(const struct bd_gltf_document *document,
                                                 uint32_t i, const char *path)
{
    const tinygltf::Material &material = material_of(document, i);
    const Place place = place_of(material, path);
    return place.value ? texture_info_in(place.value) : core_map(material, path);
}

const struct bd_import_file *bd_gltf_find_file(const struct bd_import_file *files,
                                               uint32_t file_count, const char *uri)
{
    try {
        return find_file(files, file_count, uri);
    } catch (const std::exception &) {
        return nullptr;
    }
}

enum bd_err bd_gltf_parse(const uint8_t *bytes, size_t size, bool is_glb,
                          const struct bd_import_file *files, uint32_t file_count,
                          struct bd_gltf_document **out, struct bd_err_detail *detail)
{
    *out = nullptr;
    if (size > std::numeric_limits<unsigned int>::max())
        return bd_err_set(detail, BD_ERR_LIMIT, "", "file of %zu bytes, limit 4 GiB", size);
    try {
        auto doc = std::make_unique<Document>();
        FileTable table = {files, file_count, read_budget_bytes(files, file_count)};
        std::string error;
        if (!load(doc.get(), bytes, size, is_glb, &table, &error))
            return refused(doc->model, error, detail);
        copy_model(doc.get());
        *out = doc.release();
        return BD_ERR_OK;
    } catch (const std::bad_alloc &) {
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory to parse the document");
    } catch (const std::exception &exception) {
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "%s", exception.what());
    }
}

void bd_gltf_document_destroy(struct bd_gltf_document **document)
{
    delete static_cast<Document *>(*document);
    *document = nullptr;
}
