// Programs: compiled and linked once for each set of defines, and kept.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "gpu/gpu_internal.h"

static bool same_name(const char *a, const char *b)
{
    return a && b ? strcmp(a, b) == 0 : a == b;
}

static bool same_defines(const struct bd_defines *a, const struct bd_defines *b)
{
    if (a->count != b->count) return false;
    for (uint32_t i = 0; i < a->count; i++)
        if (strcmp(a->pairs[i].name, b->pairs[i].name) != 0 ||
            a->pairs[i].value != b->pairs[i].value)
            return false;
    return true;
}

static struct bd_program *find_program(struct bd_gpu *gpu, const struct bd_program_source *source)
{
    for (uint32_t i = 0; i < gpu->program_count; i++) {
        const struct bd_program_source *known = &gpu->programs[i]->source;
        if (same_name(known->compute, source->compute) &&
            same_name(known->vertex, source->vertex) &&
            same_name(known->fragment, source->fragment) &&
            same_defines(&known->defines, &source->defines))
            return gpu->programs[i];
    }
    return NULL;
}

static enum bd_err refuse(const char *name, const struct bd_source *source, const char *log,
                          struct bd_err_detail *detail)
{
    char named[4096];
    bd_source_name_files(source, log, named, sizeof named);
    bd_log(BD_LOG_ERROR, "gpu/program", "%s: %s", name, named);
    return bd_err_set(detail, BD_ERR_DEVICE, name, "the driver refuses shader %s: %s", name, named);
}

static enum bd_err compile_text(GLuint shader, const char *name, const struct bd_source *source,
                                struct bd_err_detail *detail)
{
    const GLchar *text = source->text;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok) return BD_ERR_OK;
    char log[4096] = "";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    return refuse(name, source, log, detail);
}

// Compiles one file and attaches it; the shader object dies with the program.
static enum bd_err attach_shader(struct bd_gpu *gpu, GLuint program, GLenum stage, const char *name,
                                 const struct bd_defines *defines, struct bd_err_detail *detail)
{
    struct bd_source source;
    enum bd_err err = bd_source_assemble(name, defines, gpu->arrays_are_textures, &source, detail);
    if (err) return err;
    GLuint shader = glCreateShader(stage);
    err = compile_text(shader, name, &source, detail);
    if (!err) glAttachShader(program, shader);
    glDeleteShader(shader);
    bd_source_finish(&source);
    return err;
}

static enum bd_err attach_shaders(struct bd_gpu *gpu, const struct bd_program *program,
                                  struct bd_err_detail *detail)
{
    const struct bd_program_source *source = &program->source;
    if (source->compute)
        return attach_shader(gpu, program->id, GL_COMPUTE_SHADER, source->compute, &source->defines,
                             detail);
    enum bd_err err =
        attach_shader(gpu, program->id, GL_VERTEX_SHADER, source->vertex, &source->defines, detail);
    if (err) return err;
    return attach_shader(gpu, program->id, GL_FRAGMENT_SHADER, source->fragment, &source->defines,
                         detail);
}

static enum bd_err link_program(struct bd_program *program, const char *name,
                                struct bd_err_detail *detail)
{
    glLinkProgram(program->id);
    GLint ok = 0;
    glGetProgramiv(program->id, GL_LINK_STATUS, &ok);
    if (!ok) {
        char log[4096] = "";
        glGetProgramInfoLog(program->id, sizeof log, NULL, log);
        return refuse(name, &(struct bd_source){0}, log, detail);
    }
    glObjectLabel(GL_PROGRAM, program->id, -1, name);
    if (program->source.compute) {
        GLint size[3];
        glGetProgramiv(program->id, GL_COMPUTE_WORK_GROUP_SIZE, size);
        for (int i = 0; i < 3; i++) program->group_size[i] = (uint32_t)size[i];
    }
    return BD_ERR_OK;
}

static void copy_names(struct bd_program_source *source)
{
    const char **names[] = {&source->compute, &source->vertex, &source->fragment};
    for (int i = 0; i < 3; i++)
        if (*names[i]) BD_ASSERT((*names[i] = strdup(*names[i])));
}

static void destroy_program(struct bd_program *program)
{
    glDeleteProgram(program->id);
    free((char *)(uintptr_t)program->source.compute);
    free((char *)(uintptr_t)program->source.vertex);
    free((char *)(uintptr_t)program->source.fragment);
    free(program);
}

static enum bd_err make_program(struct bd_gpu *gpu, const struct bd_program_source *source,
                                struct bd_program **out, struct bd_err_detail *detail)
{
    struct bd_program *program = calloc(1, sizeof *program);
    BD_ASSERT(program);
    program->source = *source;
    copy_names(&program->source);
    program->id = glCreateProgram();
    enum bd_err err = attach_shaders(gpu, program, detail);
    if (!err)
        err = link_program(program, source->compute ? source->compute : source->fragment, detail);
    if (err) {
        destroy_program(program);
        return err;
    }
    *out = program;
    return BD_ERR_OK;
}

static void keep_program(struct bd_gpu *gpu, struct bd_program *program)
{
    if (gpu->program_count == gpu->program_capacity) {
        gpu->program_capacity = gpu->program_capacity ? 2 * gpu->program_capacity : 32;
        gpu->programs = realloc(gpu->programs, gpu->program_capacity * sizeof(struct bd_program *));
        BD_ASSERT(gpu->programs);
    }
    gpu->programs[gpu->program_count++] = program;
}

enum bd_err bd_program_get(struct bd_gpu *gpu, const struct bd_program_source *source,
                           struct bd_program **out, struct bd_err_detail *detail)
{
    BD_ASSERT(source->compute ? !source->vertex && !source->fragment
                              : source->vertex && source->fragment);
    *out = find_program(gpu, source);
    if (*out) return BD_ERR_OK;
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = make_program(gpu, source, out, detail);
    bd_timers_add_compile(gpu, bd_ms_since(start_ns));
    bd_gpu_check(gpu, "bd_program_get");
    if (!err) keep_program(gpu, *out);
    // A lost context refuses everything.
    if (err && bd_gpu_why_not_made(gpu) == BD_ERR_DEVICE_LOST)
        return bd_err_set(detail, BD_ERR_DEVICE_LOST, "device", "lost while compiling");
    return err;
}

void bd_programs_finish(struct bd_gpu *gpu)
{
    for (uint32_t i = 0; i < gpu->program_count; i++) destroy_program(gpu->programs[i]);
    free(gpu->programs);
    gpu->programs = NULL;
    gpu->program_count = gpu->program_capacity = 0;
}

void bd_program_group_size(const struct bd_program *program, uint32_t out[3])
{
    BD_ASSERT(program->source.compute);
    memcpy(out, program->group_size, sizeof program->group_size);
}

uint32_t bd_gpu_program_count(const struct bd_gpu *gpu)
{
    return gpu->program_count;
}

double bd_gpu_compile_ms(const struct bd_gpu *gpu)
{
    return gpu->compile_ms;
}
