// Pictures of a document: those that some material shows, decoded, and their textures.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/model/object_fields.h"

static enum bd_wrap wrap_of(int32_t gl_name)
{
    switch (gl_name) {
    case 33071:
        return BD_WRAP_CLAMP;
    case 33648:
        return BD_WRAP_MIRROR;
    default:
        return BD_WRAP_REPEAT;
    }
}

static void read_texture(const struct bd_gltf_document *doc, const struct bd_gltf_texture *in,
                         struct bd_texture *out)
{
    *out = (struct bd_texture){.picture = in->source};
    if (in->sampler == BD_NONE) return;
    const struct bd_gltf_sampler *sampler = &doc->samplers[in->sampler];
    out->wrap_s = wrap_of(sampler->wrap_s);
    out->wrap_t = wrap_of(sampler->wrap_t);
    out->nearest = sampler->mag_filter == 9728;
}

static void mark_picture(const struct bd_scene *scene, const struct bd_texture_ref *ref,
                         enum bd_texel_kind kind, uint8_t *uses)
{
    if (ref->texture == BD_NONE) return;
    int32_t picture = scene->textures[ref->texture].picture;
    if (picture != BD_NONE) uses[picture] |= (uint8_t)(1u << kind);
}

// Only what some material's map shows is decoded: occlusion maps and leftovers are not.
static void mark_pictures(const struct bd_scene *scene, uint8_t *uses)
{
    for (uint32_t i = 0; i < scene->material_count; i++) {
        const struct bd_texture_ref *map;
        for (uint32_t n = 0; (map = bd_material_map(&scene->materials[i], n)); n++)
            mark_picture(scene, map, bd_material_map_row(n)->texels, uses);
    }
}

// Of one that is several things, the eye sees the colour first.
static enum bd_texel_kind kind_of(uint8_t uses)
{
    if (uses & 1u << BD_TEXEL_COLOR) return BD_TEXEL_COLOR;
    return uses & 1u << BD_TEXEL_DATA ? BD_TEXEL_DATA : BD_TEXEL_NORMAL;
}

static enum bd_err find_encoded(struct bd_gltf_reader *reader, uint32_t i,
                                struct bd_encoded_picture *out)
{
    const struct bd_gltf_image *image = &reader->doc->images[i];
    out->image = i;
    out->is_in_view = image->view != BD_NONE;
    if (out->is_in_view) {
        const struct bd_gltf_view *view = &reader->doc->views[image->view];
        out->bytes = reader->doc->buffers[view->buffer].bytes + view->offset_bytes;
        out->size_bytes = view->length_bytes;
        return BD_ERR_OK;
    }
    if (!image->uri[0]) {
        out->bytes = image->encoded;
        out->size_bytes = image->encoded_bytes;
        return BD_ERR_OK;
    }
    const struct bd_import_file *file =
        bd_gltf_find_file(reader->files, reader->file_count, image->uri);
    if (!file)
        return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, bd_gltf_path("images[%u].uri", i).text,
                          "file \"%.200s\" is not among those given", image->uri);
    out->bytes = file->bytes;
    out->size_bytes = file->size_bytes;
    return BD_ERR_OK;
}

// Pictures keep their order; the unwanted ones leave no gap, so textures are renumbered.
static enum bd_err add_wanted(struct bd_gltf_reader *reader, const uint8_t *uses,
                              int32_t *renumbered)
{
    struct bd_scene *scene = reader->scene;
    for (uint32_t i = 0; i < reader->doc->image_count; i++) {
        renumbered[i] = BD_NONE;
        if (!uses[i]) continue;
        struct bd_encoded_picture encoded = {.kind = kind_of(uses[i])};
        enum bd_err err = find_encoded(reader, i, &encoded);
        if (err != BD_ERR_OK) return err;
        struct bd_picture *picture = calloc(1, sizeof *picture);
        if (!picture) return bd_gltf_no_memory(reader, "images");
        picture->reference_count = 1;
        renumbered[i] = (int32_t)scene->picture_count;
        scene->pictures[scene->picture_count++] = picture;
        if (!bd_picture_queue_add(reader->pictures, &encoded))
            return bd_gltf_no_memory(reader, "images");
    }
    for (uint32_t i = 0; i < scene->texture_count; i++)
        if (scene->textures[i].picture != BD_NONE)
            scene->textures[i].picture = renumbered[scene->textures[i].picture];
    return BD_ERR_OK;
}

static enum bd_err begin_decoding(struct bd_gltf_reader *reader)
{
    struct bd_scene *scene = reader->scene;
    struct bd_shrunk_pictures shrunk;
    enum bd_err err =
        bd_picture_queue_begin(reader->pictures, reader->limits, &shrunk, reader->detail);
    if (err != BD_ERR_OK) return err;
    for (uint32_t i = 0; i < scene->picture_count; i++)
        bd_picture_queue_size(reader->pictures, i, &scene->pictures[i]->width_px,
                              &scene->pictures[i]->height_px);
    if (shrunk.count)
        bd_scene_flag(scene, "shrunk_pictures: %u of %u, to %llu of %llu texels (picture_texels)",
                      shrunk.count, scene->picture_count, (unsigned long long)shrunk.texels_after,
                      (unsigned long long)shrunk.texels_before);
    return BD_ERR_OK;
}

enum bd_err bd_gltf_read_pictures(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    size_t image_count = doc->image_count + (size_t)1;
    scene->textures = calloc(doc->texture_count + (size_t)1, sizeof *scene->textures);
    scene->pictures = calloc(image_count, sizeof *scene->pictures);
    uint8_t *uses = calloc(image_count, sizeof *uses);
    int32_t *renumbered = calloc(image_count, sizeof *renumbered);
    enum bd_err err;
    if (!scene->textures || !scene->pictures || !uses || !renumbered) {
        err = bd_gltf_no_memory(reader, "images");
    } else {
        for (uint32_t i = 0; i < doc->texture_count; i++)
            read_texture(doc, &doc->textures[i], &scene->textures[i]);
        scene->texture_count = doc->texture_count;
        mark_pictures(scene, uses);
        err = add_wanted(reader, uses, renumbered);
        if (err == BD_ERR_OK) err = begin_decoding(reader);
    }
    free(renumbered);
    free(uses);
    return err;
}
