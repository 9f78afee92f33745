// Render targets, and draws into them.

#include "base/assert.h"
#include "gpu/gpu_internal.h"

static void attach(struct bd_gpu *gpu, GLenum attachment, const struct bd_tex *tex, uint32_t layer)
{
    bd_barrier_write(gpu, &tex->access, BD_USE_TARGET);
    if (tex->desc.layer_count)
        glNamedFramebufferTextureLayer(gpu->framebuffer, attachment, tex->id, 0, (GLint)layer);
    else
        glNamedFramebufferTexture(gpu->framebuffer, attachment, tex->id, 0);
}

static uint32_t attach_colors(struct bd_gpu *gpu, const struct bd_target *target)
{
    GLenum buffers[BD_TARGET_COLOR_MAX];
    uint32_t count = 0;
    for (; count < BD_TARGET_COLOR_MAX && target->color[count].tex; count++) {
        BD_ASSERT(!bd_format_info(target->color[count].tex->desc.format)->is_depth);
        buffers[count] = GL_COLOR_ATTACHMENT0 + count;
        attach(gpu, buffers[count], target->color[count].tex, target->color[count].layer);
    }
    glNamedFramebufferDrawBuffers(gpu->framebuffer, (GLsizei)count, buffers);
    return count;
}

static void clear_target(struct bd_gpu *gpu, const struct bd_target *target, uint32_t color_count)
{
    static const GLfloat zero[4];
    static const GLuint zero_uint[4];
    for (uint32_t i = 0; i < color_count; i++) {
        if (bd_format_info(target->color[i].tex->desc.format)->is_uint)
            glClearNamedFramebufferuiv(gpu->framebuffer, GL_COLOR, (GLint)i, zero_uint);
        else
            glClearNamedFramebufferfv(gpu->framebuffer, GL_COLOR, (GLint)i, zero);
    }
    if (target->depth.tex) glClearNamedFramebufferfv(gpu->framebuffer, GL_DEPTH, 0, zero);
}

static const struct bd_tex_desc *check_one_size(const struct bd_target *target)
{
    const struct bd_tex *first = target->color[0].tex ? target->color[0].tex : target->depth.tex;
    BD_ASSERT(first);
    for (uint32_t i = 0; i < BD_TARGET_COLOR_MAX && target->color[i].tex; i++) {
        BD_ASSERT_CMP(target->color[i].tex->desc.width_px, ==, first->desc.width_px);
        BD_ASSERT_CMP(target->color[i].tex->desc.height_px, ==, first->desc.height_px);
    }
    if (target->depth.tex) {
        BD_ASSERT_CMP(target->depth.tex->desc.width_px, ==, first->desc.width_px);
        BD_ASSERT_CMP(target->depth.tex->desc.height_px, ==, first->desc.height_px);
    }
    return &first->desc;
}

// Returns the number of colours.
static uint32_t set_target(struct bd_gpu *gpu, const struct bd_target *target)
{
    BD_ASSERT(!gpu->in_target);
    const struct bd_tex_desc *size = check_one_size(target);
    gpu->in_target = true;
    gpu->target = *target;
    gpu->serial++;
    uint32_t color_count = attach_colors(gpu, target);
    if (target->depth.tex) attach(gpu, GL_DEPTH_ATTACHMENT, target->depth.tex, target->depth.layer);
    bd_barrier_issue(gpu);
    glBindFramebuffer(GL_FRAMEBUFFER, gpu->framebuffer);
    glViewport(0, 0, (GLsizei)size->width_px, (GLsizei)size->height_px);
    glEnable(GL_SCISSOR_TEST);
    bd_gpu_target_rows(gpu, 0, size->height_px);
    return color_count;
}

void bd_gpu_target_begin(struct bd_gpu *gpu, const struct bd_target *target)
{
    uint32_t color_count = set_target(gpu, target);
    glDepthMask(GL_TRUE); // clearing obeys it
    clear_target(gpu, target, color_count);
    bd_gpu_check(gpu, "bd_gpu_target_begin");
}

void bd_draw_resume_target(struct bd_gpu *gpu, const struct bd_gpu_suspended *suspended)
{
    set_target(gpu, &suspended->target);
    bd_gpu_target_rows(gpu, suspended->first_row, suspended->row_count);
    bd_gpu_check(gpu, "bd_gpu_resume");
}

void bd_gpu_target_rows(struct bd_gpu *gpu, uint32_t first_row, uint32_t row_count)
{
    BD_ASSERT(gpu->in_target);
    const struct bd_tex *tex =
        gpu->target.color[0].tex ? gpu->target.color[0].tex : gpu->target.depth.tex;
    gpu->first_row = first_row;
    gpu->row_count = row_count;
    glScissor(0, (GLint)first_row, (GLsizei)bd_tex_desc(tex)->width_px, (GLsizei)row_count);
}

// Detached at once: a texture that is deleted while it hangs on a framebuffer keeps its memory.
void bd_gpu_target_end(struct bd_gpu *gpu)
{
    BD_ASSERT(gpu->in_target);
    glDisable(GL_SCISSOR_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    for (uint32_t i = 0; i < BD_TARGET_COLOR_MAX && gpu->target.color[i].tex; i++)
        glNamedFramebufferTexture(gpu->framebuffer, GL_COLOR_ATTACHMENT0 + i, 0, 0);
    if (gpu->target.depth.tex)
        glNamedFramebufferTexture(gpu->framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    gpu->in_target = false;
    gpu->target = (struct bd_target){0};
    bd_gpu_check(gpu, "bd_gpu_target_end");
}

static void set_constant(GLuint index, bool is_uint)
{
    if (is_uint)
        glVertexAttribI4ui(index, 0, 0, 0, 1);
    else
        glVertexAttrib4f(index, 0, 0, 0, 1);
}

static void set_attribute(struct bd_gpu *gpu, GLuint index, const struct bd_attribute *attribute)
{
    GLuint vertex_array = gpu->vertex_array;
    if (!attribute->buf) {
        glDisableVertexArrayAttrib(vertex_array, index);
        set_constant(index, attribute->is_uint);
        return;
    }
    GLint components = (GLint)attribute->component_count;
    BD_ASSERT(components >= 1 && components <= 4);
    glEnableVertexArrayAttrib(vertex_array, index);
    glVertexArrayVertexBuffer(vertex_array, index, attribute->buf->id,
                              (GLintptr)attribute->offset_bytes, (GLsizei)attribute->stride_bytes);
    glVertexArrayAttribBinding(vertex_array, index, index);
    glVertexArrayBindingDivisor(vertex_array, index, attribute->per_instance);
    if (attribute->is_uint)
        glVertexArrayAttribIFormat(vertex_array, index, components, GL_UNSIGNED_INT, 0);
    else
        glVertexArrayAttribFormat(vertex_array, index, components, GL_FLOAT, GL_FALSE, 0);
}

// GL negates a triangle's area where the origin is the upper left, so counter-clockwise stays
// counter-clockwise as the viewer sees it.
static void set_faces(const struct bd_draw *draw)
{
    glFrontFace(draw->mirrored ? GL_CW : GL_CCW);
    switch (draw->cull) {
    case BD_CULL_NONE:
        glDisable(GL_CULL_FACE);
        break;
    case BD_CULL_BACK:
        glEnable(GL_CULL_FACE);
        break;
    }
}

static void set_depth(const struct bd_gpu *gpu, const struct bd_draw *draw)
{
    if (gpu->target.depth.tex && draw->depth != BD_DRAW_DEPTH_IGNORE)
        glEnable(GL_DEPTH_TEST);
    else
        glDisable(GL_DEPTH_TEST);
    glDepthMask(draw->depth == BD_DRAW_DEPTH_WRITE);
}

static void set_blend(const struct bd_draw *draw)
{
    switch (draw->blend) {
    case BD_BLEND_REPLACE:
        glDisable(GL_BLEND);
        break;
    case BD_BLEND_ADD:
        glEnable(GL_BLEND);
        glBlendFunc(GL_ONE, GL_ONE);
        break;
    }
}

static GLenum topology_of(const struct bd_draw *draw)
{
    return draw->topology == BD_TOPOLOGY_POINTS ? GL_POINTS : GL_TRIANGLES;
}

void bd_draw_submit(struct bd_gpu *gpu, const struct bd_draw *draw, uint32_t index_count,
                    uint32_t instance_count)
{
    GLenum topology = topology_of(draw);
    bd_bind_all(gpu, &draw->bindings);
    for (GLuint i = 0; i < BD_ATTRIBUTE_MAX; i++) set_attribute(gpu, i, &draw->attributes[i]);
    set_faces(draw);
    set_depth(gpu, draw);
    set_blend(draw);
    glBindVertexArray(gpu->vertex_array);
    glUseProgram(draw->program->id);
    if (draw->indices) {
        glVertexArrayElementBuffer(gpu->vertex_array, draw->indices->id);
        glDrawElementsInstancedBaseVertexBaseInstance(
            topology, (GLsizei)index_count, GL_UNSIGNED_INT,
            (const void *)(uintptr_t)draw->index_offset_bytes, (GLsizei)instance_count,
            draw->base_vertex, draw->base_instance);
    } else {
        glDrawArraysInstancedBaseInstance(topology, draw->base_vertex, (GLsizei)index_count,
                                          (GLsizei)instance_count, draw->base_instance);
    }
}

static void note_attributes(struct bd_gpu *gpu, const struct bd_draw *draw)
{
    for (uint32_t i = 0; i < BD_ATTRIBUTE_MAX; i++)
        if (draw->attributes[i].buf)
            bd_barrier_read(gpu, &draw->attributes[i].buf->access, BD_USE_VERTEX);
    if (draw->indices) bd_barrier_read(gpu, &draw->indices->access, BD_USE_INDEX);
}

static void check_blend(const struct bd_gpu *gpu, const struct bd_draw *draw)
{
    for (uint32_t i = 0; i < BD_TARGET_COLOR_MAX && gpu->target.color[i].tex; i++)
        BD_ASSERT(draw->blend == BD_BLEND_REPLACE ||
                  bd_format_info(gpu->target.color[i].tex->desc.format)->is_float);
}

void bd_gpu_draw(struct bd_gpu *gpu, const struct bd_draw *draw)
{
    BD_ASSERT(gpu->in_target && draw->program->source.vertex);
    check_blend(gpu, draw);
    if (draw->index_count == 0 || draw->instance_count == 0) return;
    gpu->serial++;
    bd_bind_note(gpu, &draw->bindings);
    note_attributes(gpu, draw);
    bd_barrier_issue(gpu);
    bd_precompile_draw(gpu, draw);
    bd_draw_submit(gpu, draw, draw->index_count, draw->instance_count);
    bd_gpu_check(gpu, "bd_gpu_draw");
}
