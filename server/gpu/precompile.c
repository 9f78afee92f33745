// Code generation ahead of time, by a dispatch or draw that leaves nothing behind.
//
// Why with the real bindings: software drivers generate code at the first dispatch, for the
// formats, sizes and sampling of what is bound then. A run on nothing would compile a variant
// that no frame uses, and the first frame would still pay.

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"
#include "gpu/gpu_internal.h"

#define COUNT(array)  ((uint32_t)(sizeof(array) / sizeof *(array)))
#define SCRATCH_BYTES (64u * 1024u)

static bool is_power_of_two(uint32_t value)
{
    return (value & (value - 1)) == 0;
}

// What Mesa's code generation looks at in a texture.
static uint32_t texture_signature(const struct bd_tex *tex)
{
    if (!tex) return 0;
    const struct bd_tex_desc *desc = &tex->desc;
    return 1u | (uint32_t)desc->format << 1 | (uint32_t)is_power_of_two(desc->width_px) << 8 |
           (uint32_t)is_power_of_two(desc->height_px) << 9 |
           (uint32_t)(desc->layer_count > 0) << 10 |
           (uint32_t)is_power_of_two(desc->layer_count) << 11 |
           (uint32_t)(desc->level_count > 1) << 12;
}

// What it looks at in a draw beside its bindings: the states of what happens to a fragment.
static uint32_t state_signature(const struct bd_draw *draw, const struct bd_target *target)
{
    return 1u | (uint32_t)(target->depth.tex != NULL) << 1 | (uint32_t)draw->topology << 2 |
           (uint32_t)draw->depth << 4 | (uint32_t)draw->blend << 8;
}

// `draw` is NULL for a dispatch.
static uint64_t signature(struct bd_gpu *gpu, const struct bd_bindings *bindings,
                          const struct bd_draw *draw)
{
    if (!gpu->caps.software) return 1; // hardware compiles once
    uint32_t parts[BD_BINDING_MAX + COUNT(bindings->images) + BD_TARGET_COLOR_MAX + 1] = {0};
    uint32_t count = 0;
    for (uint32_t i = 0; i < BD_BINDING_MAX; i++, count++) {
        parts[count] = texture_signature(bindings->textures[i].tex);
        if (!parts[count]) continue;
        parts[count] |= (uint32_t)bindings->textures[i].sampling << 16 |
                        (uint32_t)bindings->textures[i].wrap_s << 20 |
                        (uint32_t)bindings->textures[i].wrap_t << 24;
    }
    for (uint32_t i = 0; i < COUNT(bindings->images); i++, count++)
        parts[count] = texture_signature(bindings->images[i].tex) |
                       (uint32_t)(bindings->images[i].layer < 0) << 16;
    for (uint32_t i = 0; i < BD_TARGET_COLOR_MAX && draw; i++)
        if (gpu->target.color[i].tex)
            parts[count + i] = 1u | (uint32_t)gpu->target.color[i].tex->desc.format << 1;
    if (draw) parts[count + BD_TARGET_COLOR_MAX] = state_signature(draw, &gpu->target);
    return bd_hash64(parts, sizeof parts, 1);
}

// True the first time. A program in more than BD_PRECOMPILED_MAX shapes is warmed no more: correct, its
// code generation is then counted to the pass.
static bool is_new(const struct bd_program *program, uint64_t shape)
{
    // Const for the caller, who cannot see this.
    struct bd_program *noted = (struct bd_program *)(uintptr_t)program;
    for (uint32_t i = 0; i < program->warm_count; i++)
        if (program->warm[i] == shape) return false;
    if (program->warm_count == BD_PRECOMPILED_MAX) return false;
    noted->warm[noted->warm_count++] = shape;
    return true;
}

static uint32_t stand_in_size(uint32_t size)
{
    return is_power_of_two(size) ? 1 : 3;
}

// A texture that looks like `tex` to code generation, and may be written.
static GLuint bind_stand_in(uint32_t unit, const struct bd_tex *tex, bool all_layers)
{
    struct bd_tex_desc desc = tex->desc;
    desc.width_px = stand_in_size(desc.width_px);
    desc.height_px = stand_in_size(desc.height_px);
    desc.layer_count = desc.layer_count ? stand_in_size(desc.layer_count) : 0;
    desc.level_count = 1;
    GLuint id = bd_tex_make(&desc);
    glBindImageTexture(unit, id, 0, all_layers, 0, GL_READ_WRITE,
                       bd_format_info(desc.format)->internal_format);
    return id;
}

static void bind_zeroes(struct bd_gpu *gpu, const struct bd_bindings *bindings)
{
    static const GLuint zero;
    glClearNamedBufferData(gpu->scratch_buffer, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    for (uint32_t i = 0; i < COUNT(bindings->storage); i++)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, gpu->scratch_buffer);
    for (uint32_t i = 0; i < COUNT(bindings->uniforms); i++)
        glBindBufferRange(GL_UNIFORM_BUFFER, i, gpu->zero_buffer, 0, BD_UNIFORM_BLOCK_MAX_BYTES);
}

// One group, with zero uniforms (a kernel's loops end at once), zero storage and images of its
// own: it writes nothing that anyone reads.
static void run_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                         const struct bd_bindings *bindings)
{
    GLuint stand_ins[COUNT(bindings->images)] = {0};
    bd_bind_textures(gpu, bindings);
    bind_zeroes(gpu, bindings);
    bd_unbind_images(gpu, bindings);
    for (uint32_t i = 0; i < COUNT(stand_ins); i++)
        if (bindings->images[i].tex)
            stand_ins[i] = bind_stand_in(i, bindings->images[i].tex, bindings->images[i].layer < 0);
    glUseProgram(program->id);
    glDispatchCompute(1, 1, 1);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    glDeleteTextures((GLsizei)COUNT(stand_ins), stand_ins);
}

void bd_precompile_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                      const struct bd_bindings *bindings)
{
    if (!is_new(program, signature(gpu, bindings, NULL))) return;
    glFinish();
    uint64_t start_ns = bd_clock_ns();
    run_dispatch(gpu, program, bindings);
    glFinish();
    bd_timers_add_compile(gpu, bd_ms_since(start_ns));
    bd_gpu_check(gpu, "bd_precompile_dispatch");
}

// The draw itself, one triangle or three points of it, behind an empty scissor: code is generated
// for the target and the states at hand, and no pixel is touched.
void bd_precompile_draw(struct bd_gpu *gpu, const struct bd_draw *draw)
{
    if (!is_new(draw->program, signature(gpu, &draw->bindings, draw))) return;
    glFinish();
    uint64_t start_ns = bd_clock_ns();
    glScissor(0, 0, 0, 0);
    bd_draw_submit(gpu, draw, draw->index_count < 3 ? draw->index_count : 3, 1);
    bd_gpu_target_rows(gpu, gpu->first_row, gpu->row_count);
    glFinish();
    bd_timers_add_compile(gpu, bd_ms_since(start_ns));
    bd_gpu_check(gpu, "bd_precompile_draw");
}
