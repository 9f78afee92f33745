#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/priority.h"
#include "scene/flat.h"
#include "scene/gltf.h"
#include "scene/import.h"
#include "scene/import_confine.h"
#include "scene/import_pipe.h"

// Bounds-checked like any input, though it comes from our own parent.
struct question {
    const uint8_t *bytes;
    uint64_t size, offset;
};

static const void *take(struct question *question, uint64_t bytes)
{
    if (bytes > question->size - question->offset) return NULL;
    const void *at = question->bytes + question->offset;
    uint64_t padded = bd_import_padded(bytes);
    uint64_t left = question->size - question->offset;
    question->offset += padded < left ? padded : left;
    return at;
}

static bool take_file(struct question *question, struct bd_import_file *out)
{
    const struct bd_import_question_file *head = take(question, sizeof *head);
    if (!head) return false;
    out->uri = take(question, head->uri_bytes);
    out->bytes = take(question, head->size_bytes);
    out->size_bytes = head->size_bytes;
    return out->uri && out->bytes && head->uri_bytes > 0 && out->uri[head->uri_bytes - 1] == 0;
}

static struct bd_import_file *take_files(struct question *question, uint32_t count)
{
    if (count == 0 || count > question->size / sizeof(struct bd_import_question_file)) return NULL;
    struct bd_import_file *files = calloc(count, sizeof *files);
    for (uint32_t i = 0; files && i < count; i++)
        if (!take_file(question, &files[i])) {
            free(files);
            return NULL;
        }
    return files;
}

static bool map_question(struct question *out)
{
    struct stat info;
    if (fstat(0, &info) != 0 || info.st_size <= 0) return false;
    void *bytes = mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_PRIVATE, 0, 0);
    if (bytes == MAP_FAILED) return false;
    *out = (struct question){bytes, (uint64_t)info.st_size, 0};
    return true;
}

static bool put(void *user, const void *bytes, size_t size)
{
    (void)user;
    const char *at = bytes;
    while (size > 0) {
        ssize_t wrote = write(1, at, size);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote <= 0) return false;
        at += wrote;
        size -= (size_t)wrote;
    }
    return true;
}

static bool answer_fault(enum bd_err err, const struct bd_fault *fault)
{
    struct bd_import_answer head = {BD_IMPORT_ANSWER_MAGIC, err};
    return put(NULL, &head, sizeof head) && put(NULL, fault, sizeof *fault);
}

static bool answer_scene(const struct bd_scene *scene)
{
    struct bd_import_answer head = {BD_IMPORT_ANSWER_MAGIC, BD_ERR_OK};
    return put(NULL, &head, sizeof head) && bd_flat_write(scene, put, NULL);
}

int bd_import_child_main(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    struct question question;
    if (!map_question(&question)) return 2;
    const struct bd_import_question *head = take(&question, sizeof *head);
    if (!head || head->magic != BD_IMPORT_QUESTION_MAGIC) return 2;
    struct bd_import_file *files = take_files(&question, head->file_count);
    if (!files) return 2;
    bd_priority_lower();
    bd_import_set_limits(&head->limits);
    if (!bd_import_confine()) return 3;

    struct bd_fault fault = {0};
    struct bd_scene *scene;
    enum bd_err err = bd_gltf_read_unsealed(files, head->file_count, &head->limits, &scene, &fault);
    bool sent = err == BD_ERR_OK ? answer_scene(scene) : answer_fault(err, &fault);
    // Nothing is freed and no exit handler runs: the process is the arena.
    _exit(sent ? 0 : 4);
}
