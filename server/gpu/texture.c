// Textures: formats, sizes, uploads, levels.

#include <inttypes.h>
#include <stdlib.h>

#include "base/assert.h"
#include "gpu/gpu_internal.h"

const struct bd_format_info *bd_format_info(enum bd_format format)
{
    // clang-format off
    static const struct bd_format_info infos[] = { // ... bytes, is_uint, is_depth, is_image, is_float
        [BD_FORMAT_RGBA8]      = {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, 0, 0, 1, 0},
        [BD_FORMAT_RGBA8_SRGB] = {GL_SRGB8_ALPHA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, 0, 0, 0, 0},
        [BD_FORMAT_RGBA16]     = {GL_RGBA16, GL_RGBA, GL_UNSIGNED_SHORT, 8, 0, 0, 1, 0},
        [BD_FORMAT_R32F]       = {GL_R32F, GL_RED, GL_FLOAT, 4, 0, 0, 1, 1},
        [BD_FORMAT_RG32F]      = {GL_RG32F, GL_RG, GL_FLOAT, 8, 0, 0, 1, 1},
        [BD_FORMAT_RGBA32F]    = {GL_RGBA32F, GL_RGBA, GL_FLOAT, 16, 0, 0, 1, 1},
        [BD_FORMAT_R32UI]      = {GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, 4, 1, 0, 1, 0},
        [BD_FORMAT_RG32UI]     = {GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT, 8, 1, 0, 1, 0},
        [BD_FORMAT_RGBA32UI]   = {GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT, 16, 1, 0, 1, 0},
        [BD_FORMAT_DEPTH32F]   = {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, 4, 0, 1, 0, 0},
    };
    // clang-format on
    BD_ASSERT_CMP((size_t)format, <, sizeof infos / sizeof *infos);
    return &infos[format];
}

GLenum bd_tex_gl_target(const struct bd_tex_desc *desc)
{
    return desc->layer_count ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D;
}

static uint32_t layers_of(const struct bd_tex_desc *desc)
{
    return desc->layer_count ? desc->layer_count : 1;
}

static uint64_t layer_bytes(const struct bd_tex_desc *desc)
{
    return (uint64_t)desc->width_px * desc->height_px * bd_format_info(desc->format)->texel_bytes;
}

static uint64_t all_bytes(const struct bd_tex_desc *desc)
{
    uint64_t bytes = 0;
    for (uint32_t level = 0; level < desc->level_count; level++) {
        struct bd_tex_desc at = *desc;
        at.width_px = desc->width_px >> level ? desc->width_px >> level : 1;
        at.height_px = desc->height_px >> level ? desc->height_px >> level : 1;
        bytes += layer_bytes(&at) * layers_of(desc);
    }
    return bytes;
}

static uint32_t level_count_max(const struct bd_tex_desc *desc)
{
    uint32_t side = desc->width_px > desc->height_px ? desc->width_px : desc->height_px;
    return 32 - (uint32_t)__builtin_clz(side);
}

GLuint bd_tex_make(const struct bd_tex_desc *desc)
{
    GLuint id = 0;
    GLsizei levels = (GLsizei)desc->level_count, layers = (GLsizei)desc->layer_count;
    GLsizei width = (GLsizei)desc->width_px, height = (GLsizei)desc->height_px;
    GLenum format = bd_format_info(desc->format)->internal_format;
    glCreateTextures(bd_tex_gl_target(desc), 1, &id);
    if (desc->layer_count)
        glTextureStorage3D(id, levels, format, width, height, layers);
    else
        glTextureStorage2D(id, levels, format, width, height);
    if (bd_gpu_take_error() != GL_NO_ERROR) {
        glDeleteTextures(1, &id);
        return 0;
    }
    return id;
}

static enum bd_err check_size(struct bd_gpu *gpu, const struct bd_tex_desc *desc,
                              struct bd_err_detail *detail)
{
    BD_ASSERT(desc->width_px > 0 && desc->height_px > 0);
    BD_ASSERT_CMP(desc->level_count, <=, level_count_max(desc));
    uint32_t side_max = gpu->caps.texture_side_max_px;
    if (desc->width_px > side_max || desc->height_px > side_max || desc->layer_count > 2048)
        return bd_err_set(detail, BD_ERR_LIMIT, desc->name,
                          "texture %s of %ux%u pixels, %u layers; the device allows %u and 2048",
                          desc->name, desc->width_px, desc->height_px, layers_of(desc), side_max);
    return BD_ERR_OK;
}

enum bd_err bd_tex_create(struct bd_gpu *gpu, const struct bd_tex_desc *desc, struct bd_tex **out,
                          struct bd_err_detail *detail)
{
    *out = NULL;
    struct bd_tex made = {.desc = *desc};
    if (made.desc.level_count == 0) made.desc.level_count = 1;
    enum bd_err err = check_size(gpu, &made.desc, detail);
    if (err) return err;
    made.size_bytes = all_bytes(&made.desc);
    err = bd_gpu_reserve(gpu, desc->name, made.size_bytes, detail);
    if (err) return err;

    struct bd_tex *tex = malloc(sizeof *tex);
    made.id = tex ? bd_tex_make(&made.desc) : 0;
    if (!made.id) {
        free(tex);
        bd_gpu_release(gpu, made.size_bytes);
        return bd_err_set(detail, bd_gpu_why_not_made(gpu), desc->name,
                          "the device has no %" PRIu64 " MiB for texture %s (%ux%u)",
                          made.size_bytes >> 20, desc->name, desc->width_px, desc->height_px);
    }
    glObjectLabel(GL_TEXTURE, made.id, -1, desc->name);
    *tex = made;
    *out = tex;
    return BD_ERR_OK;
}

void bd_tex_destroy(struct bd_gpu *gpu, struct bd_tex **tex)
{
    if (!*tex) return;
    BD_ASSERT(!gpu->in_target);
    glDeleteTextures(1, &(*tex)->id);
    bd_gpu_release(gpu, (*tex)->size_bytes);
    free(*tex);
    *tex = NULL;
}

const struct bd_tex_desc *bd_tex_desc(const struct bd_tex *tex)
{
    return &tex->desc;
}

uint64_t bd_tex_bytes(const struct bd_tex *tex)
{
    return tex->size_bytes;
}

void bd_tex_upload(struct bd_gpu *gpu, struct bd_tex *tex, uint32_t layer, const void *texels,
                   size_t size_bytes)
{
    bd_tex_upload_rows(gpu, tex, layer, 0, tex->desc.height_px, texels, size_bytes);
}

void bd_tex_upload_rows(struct bd_gpu *gpu, struct bd_tex *tex, uint32_t layer, uint32_t first_row,
                        uint32_t row_count, const void *texels, size_t size_bytes)
{
    const uint32_t height_px = tex->desc.height_px;
    BD_ASSERT(first_row < height_px && row_count <= height_px - first_row);
    BD_ASSERT_CMP(size_bytes, ==, layer_bytes(&tex->desc) / height_px * row_count);
    BD_ASSERT_CMP(layer, <, layers_of(&tex->desc));
    const struct bd_format_info *info = bd_format_info(tex->desc.format);
    GLsizei width = (GLsizei)tex->desc.width_px, height = (GLsizei)row_count;
    GLint y = (GLint)first_row;
    gpu->serial++;
    bd_barrier_write(gpu, &tex->access, BD_USE_TEX_UPDATE);
    bd_barrier_issue(gpu);
    if (tex->desc.layer_count)
        glTextureSubImage3D(tex->id, 0, 0, y, (GLint)layer, width, height, 1, info->format,
                            info->type, texels);
    else
        glTextureSubImage2D(tex->id, 0, 0, y, width, height, info->format, info->type, texels);
    bd_gpu_check(gpu, "bd_tex_upload");
}

void bd_tex_generate_levels(struct bd_gpu *gpu, struct bd_tex *tex)
{
    gpu->serial++;
    bd_barrier_write(gpu, &tex->access, BD_USE_TEX_UPDATE);
    bd_barrier_read(gpu, &tex->access, BD_USE_FETCH);
    bd_barrier_issue(gpu);
    glGenerateTextureMipmap(tex->id);
    bd_gpu_check(gpu, "bd_tex_generate_levels");
}

void bd_tex_clear(struct bd_gpu *gpu, struct bd_tex *tex, const float value[4])
{
    const struct bd_format_info *info = bd_format_info(tex->desc.format);
    gpu->serial++;
    bd_barrier_write(gpu, &tex->access, BD_USE_TEX_UPDATE);
    bd_barrier_issue(gpu);
    if (info->is_uint) {
        const GLuint whole[4] = {(GLuint)value[0], (GLuint)value[1], (GLuint)value[2],
                                 (GLuint)value[3]};
        glClearTexImage(tex->id, 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, whole);
    } else {
        GLenum format = info->is_depth ? GL_DEPTH_COMPONENT : GL_RGBA;
        glClearTexImage(tex->id, 0, format, GL_FLOAT, value);
    }
    bd_gpu_check(gpu, "bd_tex_clear");
}

GLuint bd_sampler(struct bd_gpu *gpu, enum bd_sampling sampling, enum bd_tex_wrap wrap_s,
                  enum bd_tex_wrap wrap_t)
{
    static const GLenum wraps[] = {
        [BD_TEX_REPEAT] = GL_REPEAT,
        [BD_TEX_CLAMP] = GL_CLAMP_TO_EDGE,
        [BD_TEX_MIRROR] = GL_MIRRORED_REPEAT,
    };
    static const GLenum filters[] = {
        [BD_SAMPLE_NEAREST] = GL_NEAREST,
        [BD_SAMPLE_LINEAR] = GL_LINEAR,
        [BD_SAMPLE_MIPMAP] = GL_LINEAR_MIPMAP_LINEAR,
    };
    BD_ASSERT(sampling <= BD_SAMPLE_MIPMAP && wrap_s <= BD_TEX_MIRROR && wrap_t <= BD_TEX_MIRROR);
    GLuint *sampler = &gpu->samplers[9 * (uint32_t)sampling + 3 * (uint32_t)wrap_s + wrap_t];
    if (*sampler) return *sampler;
    glCreateSamplers(1, sampler);
    glSamplerParameteri(*sampler, GL_TEXTURE_MIN_FILTER, (GLint)filters[sampling]);
    glSamplerParameteri(*sampler, GL_TEXTURE_MAG_FILTER,
                        sampling == BD_SAMPLE_NEAREST ? GL_NEAREST : GL_LINEAR);
    glSamplerParameteri(*sampler, GL_TEXTURE_WRAP_S, (GLint)wraps[wrap_s]);
    glSamplerParameteri(*sampler, GL_TEXTURE_WRAP_T, (GLint)wraps[wrap_t]);
    return *sampler;
}
