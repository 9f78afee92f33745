#include "gpu/source.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

void bd_define(struct bd_defines *defines, const char *name, int32_t value)
{
    BD_ASSERT_CMP(defines->count, <, BD_DEFINE_MAX);
    BD_ASSERT_CMP(strlen(name), <, sizeof defines->pairs[0].name);
    strcpy(defines->pairs[defines->count].name, name);
    defines->pairs[defines->count++].value = value;
}

static const struct bd_shader_file *find_file(const char *name, size_t name_length)
{
    for (uint32_t i = 0; i < bd_shader_file_count; i++) {
        const char *candidate = bd_shader_files[i].name;
        if (strncmp(candidate, name, name_length) == 0 && candidate[name_length] == 0)
            return &bd_shader_files[i];
    }
    return NULL;
}

static bool is_included(const struct bd_source *source, const char *name)
{
    for (uint32_t i = 0; i < source->file_count; i++)
        if (strcmp(source->files[i], name) == 0) return true;
    return false;
}

// The quoted name if the line is an #include, else NULL.
static const char *include_name(const char *line, size_t *name_length)
{
    line += strspn(line, " \t");
    if (*line++ != '#') return NULL;
    line += strspn(line, " \t");
    if (strncmp(line, "include", 7) != 0) return NULL;
    line += 7;
    line += strspn(line, " \t");
    if (*line++ != '"') return NULL;
    *name_length = strcspn(line, "\"\n");
    return line[*name_length] == '"' ? line : NULL;
}

static enum bd_err append_file(const struct bd_shader_file *file, struct bd_source *source,
                               FILE *out, struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(source->file_count, <, BD_SOURCE_FILE_MAX);
    uint32_t file_index = source->file_count;
    source->files[source->file_count++] = file->name;
    fprintf(out, "#line 1 %u\n", file_index);
    uint32_t line_number = 1;
    for (const char *line = file->text; *line; line_number++) {
        size_t length = strcspn(line, "\n"), name_length;
        const char *name = include_name(line, &name_length);
        if (name) {
            const struct bd_shader_file *included = find_file(name, name_length);
            if (!included)
                return bd_err_set(detail, BD_ERR_INTERNAL, file->name,
                                  "%s:%u: no shader file \"%.*s\"", file->name, line_number,
                                  (int)name_length, name);
            if (!is_included(source, included->name)) {
                enum bd_err err = append_file(included, source, out, detail);
                if (err) return err;
            }
            fprintf(out, "#line %u %u\n", line_number + 1, file_index);
        } else {
            fprintf(out, "%.*s\n", (int)length, line);
        }
        line += length + (line[length] == '\n');
    }
    return BD_ERR_OK;
}

enum bd_err bd_source_assemble(const char *name, const struct bd_defines *defines, bool software,
                               struct bd_source *out, struct bd_err_detail *detail)
{
    *out = (struct bd_source){0};
    const struct bd_shader_file *file = find_file(name, strlen(name));
    if (!file) return bd_err_set(detail, BD_ERR_INTERNAL, name, "no shader file \"%s\"", name);

    size_t size;
    FILE *stream = open_memstream(&out->text, &size);
    if (!stream) return bd_err_set(detail, BD_ERR_NO_MEMORY, name, "no memory for a shader");
    fputs("#version 450 core\n#define BD_GLSL 1\n", stream);
    if (software) fputs("#define BD_SOFTWARE 1\n", stream);
    for (uint32_t i = 0; i < defines->count; i++)
        fprintf(stream, "#define %s %d\n", defines->pairs[i].name, defines->pairs[i].value);
    enum bd_err err = append_file(file, out, stream, detail);
    if (fclose(stream) != 0 && !err)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, name, "no memory for a shader");
    if (err) bd_source_finish(out);
    return err;
}

void bd_source_finish(struct bd_source *source)
{
    free(source->text);
    *source = (struct bd_source){0};
}

// "3:17", "3(17)" and "ERROR: 3:17" are what Mesa, NVIDIA and glslang write.
static const char *skip_severity(const char *line)
{
    static const char *const words[] = {"ERROR: ", "WARNING: "};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strncmp(line, words[i], strlen(words[i])) == 0) return line + strlen(words[i]);
    return line;
}

void bd_source_name_files(const struct bd_source *source, const char *log, char *out,
                          size_t out_size)
{
    size_t used = 0;
    out[0] = 0;
    while (*log && used + 1 < out_size) {
        const char *number = skip_severity(log);
        char *after = NULL;
        unsigned long index = isdigit((unsigned char)*number) ? strtoul(number, &after, 10) : 0;
        size_t length = strcspn(log, "\n");
        int written;
        if (after && (*after == ':' || *after == '(') && index < source->file_count)
            written = snprintf(out + used, out_size - used, "%.*s%s%.*s\n", (int)(number - log),
                               log, source->files[index], (int)(log + length - after), after);
        else
            written = snprintf(out + used, out_size - used, "%.*s\n", (int)length, log);
        used += (size_t)written;
        log += length + (log[length] == '\n');
    }
}
