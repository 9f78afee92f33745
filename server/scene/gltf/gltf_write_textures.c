// Textures, their samplers, and pictures as PNG, whatever they came as: a snapshot holds texels.

#include <stdlib.h>
#include <string.h>

#include "image/png.h"
#include "scene/gltf/gltf_write_parts.h"

// --- samplers -------------------------------------------------------------------------------

#define SAMPLER_COUNT (3 * 3 * 2)

// Without a sampler a texture repeats and is smooth.
static int sampler_key(const struct bd_texture *texture)
{
    return ((int)texture->wrap_s * 3 + (int)texture->wrap_t) * 2 + texture->nearest;
}

static void write_sampler(struct bd_gltf_json *json, int key)
{
    static const uint32_t wraps[] = {
        [BD_WRAP_REPEAT] = 10497, [BD_WRAP_CLAMP] = 33071, [BD_WRAP_MIRROR] = 33648};
    bd_gltf_json_open(json, NULL, '{');
    bd_gltf_json_uint(json, "magFilter", key % 2 ? 9728 : 9729);
    bd_gltf_json_uint(json, "minFilter", key % 2 ? 9984 : 9987); // of the nearest, smooth: mipmaps
    bd_gltf_json_uint(json, "wrapS", wraps[key / 6]);
    bd_gltf_json_uint(json, "wrapT", wraps[key / 2 % 3]);
    bd_gltf_json_close(json, '{');
}

// Those that some texture has, by key. `numbers` says under which number each is written.
static void write_samplers(struct bd_gltf_writer *writer, int32_t numbers[SAMPLER_COUNT])
{
    bool used[SAMPLER_COUNT] = {false};
    int32_t count = 0;
    for (uint32_t i = 0; i < writer->slots.textures; i++)
        if (!writer->scene->textures[i].is_removed)
            used[sampler_key(&writer->scene->textures[i])] = true;
    for (int key = 0; key < SAMPLER_COUNT; key++)
        numbers[key] = used[key] && key != 0 ? count++ : BD_NONE;
    if (count == 0) return;
    bd_gltf_json_open(&writer->json, "samplers", '[');
    for (int key = 0; key < SAMPLER_COUNT; key++)
        if (numbers[key] != BD_NONE) write_sampler(&writer->json, key);
    bd_gltf_json_close(&writer->json, '[');
}

// --- textures -------------------------------------------------------------------------------

static void write_texture(struct bd_gltf_writer *writer, const struct bd_texture *texture,
                          const int32_t samplers[SAMPLER_COUNT])
{
    struct bd_gltf_json *json = &writer->json;
    int32_t sampler = samplers[sampler_key(texture)], source = BD_NONE;
    if (texture->picture != BD_NONE) source = writer->numbers.pictures[texture->picture];
    bd_gltf_json_open(json, NULL, '{');
    if (sampler != BD_NONE) bd_gltf_json_uint(json, "sampler", (uint64_t)sampler);
    if (source != BD_NONE) bd_gltf_json_uint(json, "source", (uint64_t)source);
    bd_gltf_json_close(json, '{');
}

static bool has_textures(const struct bd_gltf_writer *writer)
{
    for (uint32_t i = 0; i < writer->slots.textures; i++)
        if (!writer->scene->textures[i].is_removed) return true;
    return false;
}

// --- pictures -------------------------------------------------------------------------------

static bool is_opaque(const struct bd_picture *picture, size_t texels)
{
    size_t i = 0;
    while (i < texels && picture->rgba[4 * i + 3] == 255) i++;
    return i == texels;
}

// Without the fourth channel; NULL without memory.
static uint8_t *without_alpha(const struct bd_picture *picture, size_t texels)
{
    uint8_t *rgb = malloc(3 * texels + 1);
    for (size_t i = 0; rgb && i < texels; i++) memcpy(rgb + 3 * i, picture->rgba + 4 * i, 3);
    return rgb;
}

static enum bd_err encode(const struct bd_picture *picture, struct bd_bytes *out,
                          struct bd_err_detail *detail)
{
    static const struct bd_manifest no_manifest;
    const size_t texels = (size_t)picture->width_px * picture->height_px;
    struct bd_pixels8 pixels = {picture->width_px, picture->height_px, 4, picture->rgba};
    uint8_t *rgb = NULL;
    if (is_opaque(picture, texels)) {
        rgb = without_alpha(picture, texels);
        if (!rgb) return bd_err_set(detail, BD_ERR_NO_MEMORY, "images", "no memory for a picture");
        pixels.channel_count = 3;
        pixels.samples = rgb;
    }
    enum bd_err err = bd_png_encode(&pixels, &no_manifest, out, detail);
    free(rgb);
    return err;
}

static enum bd_err write_picture(struct bd_gltf_writer *writer, const struct bd_picture *picture)
{
    struct bd_bytes png = {0};
    enum bd_err err = encode(picture, &png, writer->detail);
    if (err != BD_ERR_OK) return err;
    const struct bd_gltf_out_view view = {
        .bytes = png.data, .own = png.data, .size_bytes = png.size_bytes};
    int32_t at = bd_gltf_add_view(writer, &view);
    if (at == BD_NONE)
        return bd_err_set(writer->detail, BD_ERR_NO_MEMORY, "images", "no memory for a picture");
    bd_gltf_json_open(&writer->json, NULL, '{');
    bd_gltf_json_uint(&writer->json, "bufferView", (uint64_t)at);
    bd_gltf_json_text(&writer->json, "mimeType", "image/png");
    bd_gltf_json_close(&writer->json, '{');
    return BD_ERR_OK;
}

static enum bd_err write_pictures(struct bd_gltf_writer *writer)
{
    enum bd_err err = BD_ERR_OK;
    bool any = false;
    for (uint32_t i = 0; err == BD_ERR_OK && i < writer->slots.pictures; i++) {
        if (writer->numbers.pictures[i] == BD_NONE) continue;
        if (!any) bd_gltf_json_open(&writer->json, "images", '[');
        any = true;
        err = write_picture(writer, writer->scene->pictures[i]);
    }
    if (any) bd_gltf_json_close(&writer->json, '[');
    return err;
}

enum bd_err bd_gltf_write_textures(struct bd_gltf_writer *writer)
{
    int32_t samplers[SAMPLER_COUNT];
    if (!has_textures(writer)) return BD_ERR_OK;
    write_samplers(writer, samplers);
    bd_gltf_json_open(&writer->json, "textures", '[');
    for (uint32_t i = 0; i < writer->slots.textures; i++)
        if (!writer->scene->textures[i].is_removed)
            write_texture(writer, &writer->scene->textures[i], samplers);
    bd_gltf_json_close(&writer->json, '[');
    return write_pictures(writer);
}
