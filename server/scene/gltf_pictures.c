#include <stdlib.h>
#include <string.h>

#include "image/decode.h"
#include "scene/gltf_reader.h"

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
                         bool *wanted)
{
    if (ref->texture == BD_NONE) return;
    int32_t picture = scene->textures[ref->texture].picture;
    if (picture != BD_NONE) wanted[picture] = true;
}

// Only what some material's map shows is decoded: occlusion maps and leftovers are not.
static void mark_pictures(const struct bd_scene *scene, bool *wanted)
{
    for (uint32_t i = 0; i < scene->material_count; i++) {
        const struct bd_material *material = &scene->materials[i];
        mark_picture(scene, &material->base_color_map, wanted);
        mark_picture(scene, &material->metallic_roughness_map, wanted);
        mark_picture(scene, &material->normal_map, wanted);
        mark_picture(scene, &material->emissive_map, wanted);
        mark_picture(scene, &material->transmission_map, wanted);
    }
}

struct encoded {
    const void *bytes;
    size_t size;
    struct bd_gltf_path path;
};

static enum bd_err find_encoded(struct bd_gltf_reader *reader, uint32_t i, struct encoded *out)
{
    const struct bd_gltf_image *image = &reader->doc->images[i];
    if (image->view != BD_NONE) {
        const struct bd_gltf_view *view = &reader->doc->views[image->view];
        out->path = bd_gltf_path("images[%u].bufferView", i);
        out->bytes = reader->doc->buffers[view->buffer].bytes + view->offset_bytes;
        out->size = view->length_bytes;
        return BD_ERR_OK;
    }
    out->path = bd_gltf_path("images[%u].uri", i);
    if (!image->uri[0]) {
        out->bytes = image->encoded;
        out->size = image->encoded_bytes;
        return BD_ERR_OK;
    }
    const struct bd_import_file *file =
        bd_gltf_find_file(reader->files, reader->file_count, image->uri);
    if (!file)
        return bd_fault_set(reader->fault, BD_ERR_BAD_INPUT, out->path.text,
                            "file \"%.200s\" is not among those given", image->uri);
    out->bytes = file->bytes;
    out->size = file->size_bytes;
    return BD_ERR_OK;
}

static enum bd_err decode(struct bd_gltf_reader *reader, uint32_t i, uint64_t *texels_left,
                          struct bd_picture **out)
{
    struct encoded encoded;
    enum bd_err err = find_encoded(reader, i, &encoded);
    if (err != BD_ERR_OK) return err;
    struct bd_picture *picture = calloc(1, sizeof *picture);
    if (!picture) return bd_gltf_no_memory(reader, encoded.path.text);
    struct bd_decode_limits limits = {reader->limits->picture_side_px, *texels_left};
    err = bd_picture_decode(encoded.bytes, encoded.size, &limits, encoded.path.text,
                            &picture->width_px, &picture->height_px, &picture->rgba, reader->fault);
    if (err != BD_ERR_OK) {
        free(picture);
        return err;
    }
    picture->reference_count = 1;
    *texels_left -= (uint64_t)picture->width_px * picture->height_px;
    *out = picture;
    return BD_ERR_OK;
}

// Pictures keep their order; the unwanted ones leave no gap, so textures are renumbered.
static enum bd_err decode_wanted(struct bd_gltf_reader *reader, const bool *wanted,
                                 int32_t *renumbered)
{
    struct bd_scene *scene = reader->scene;
    uint64_t texels_left = reader->limits->picture_texels;
    for (uint32_t i = 0; i < reader->doc->image_count; i++) {
        renumbered[i] = BD_NONE;
        if (!wanted[i]) continue;
        enum bd_err err = decode(reader, i, &texels_left, &scene->pictures[scene->picture_count]);
        if (err != BD_ERR_OK) return err;
        renumbered[i] = (int32_t)scene->picture_count++;
    }
    for (uint32_t i = 0; i < scene->texture_count; i++)
        if (scene->textures[i].picture != BD_NONE)
            scene->textures[i].picture = renumbered[scene->textures[i].picture];
    return BD_ERR_OK;
}

enum bd_err bd_gltf_read_pictures(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    size_t image_count = doc->image_count + (size_t)1;
    scene->textures = calloc(doc->texture_count + (size_t)1, sizeof *scene->textures);
    scene->pictures = calloc(image_count, sizeof *scene->pictures);
    bool *wanted = calloc(image_count, sizeof *wanted);
    int32_t *renumbered = calloc(image_count, sizeof *renumbered);
    enum bd_err err;
    if (!scene->textures || !scene->pictures || !wanted || !renumbered) {
        err = bd_gltf_no_memory(reader, "images");
    } else {
        for (uint32_t i = 0; i < doc->texture_count; i++)
            read_texture(doc, &doc->textures[i], &scene->textures[i]);
        scene->texture_count = doc->texture_count;
        mark_pictures(scene, wanted);
        err = decode_wanted(reader, wanted, renumbered);
    }
    free(renumbered);
    free(wanted);
    return err;
}
