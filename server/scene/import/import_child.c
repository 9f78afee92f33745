// The process that imports: questions read from its parent, answers written back.

#include <errno.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/priority.h"
#include "image/decode.h"
#include "scene/gltf/gltf.h"
#include "scene/gltf/picture_queue.h"
#include "scene/import/import.h"
#include "scene/import/import_confine.h"
#include "scene/import/import_pipe.h"
#include "scene/import/sky_map.h"
#include "scene/model/content.h"
#include "scene/model/flat.h"

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

static bool write_all(const void *bytes, size_t size)
{
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

static bool put_piece(enum bd_import_piece_kind kind, const void *bytes, size_t size)
{
    const struct bd_import_piece piece = {BD_IMPORT_PIECE_MAGIC, kind, size};
    return write_all(&piece, sizeof piece) && write_all(bytes, size);
}

static bool put(void *user, const void *bytes, size_t size)
{
    (void)user;
    return put_piece(BD_IMPORT_BODY, bytes, size);
}

// --- the kinds of questions -----------------------------------------------------------------

// Each writes its body. What has an error may have written some of it; without an error BD_ERR_IO
// means that nobody listens any more.
struct task {
    const struct bd_import_file *files;
    uint32_t file_count;
    const struct bd_import_limits *limits;
    struct bd_picture_queue *pictures; // a scene's
    struct bd_err_detail detail;
};

static uint8_t *next_texels(void *user)
{
    struct task *task = user;
    uint8_t *rgba = NULL;
    return bd_picture_queue_take(task->pictures, &rgba, &task->detail) ? NULL : rgba;
}

static enum bd_err answer_scene(struct task *task)
{
    struct bd_gltf_document *document;
    struct bd_scene *scene;
    enum bd_err err = bd_gltf_read_waiting(task->files, task->file_count, task->limits,
                                           task->pictures, &document, &scene, &task->detail);
    if (err || bd_flat_write_fetching(scene, next_texels, task, put, NULL)) return err;
    return task->detail.err ? task->detail.err : BD_ERR_IO;
}

static enum bd_err answer_picture(struct task *task)
{
    const struct bd_import_file *file = &task->files[0];
    const struct bd_decode_limits limits = {task->limits->picture_side_px,
                                            task->limits->picture_texels};
    struct bd_picture picture = {.reference_count = 1};
    enum bd_err err =
        bd_picture_decode(file->bytes, file->size_bytes, &limits, file->uri, &picture.width_px,
                          &picture.height_px, &picture.rgba, &task->detail);
    const struct bd_content content = {.kind = BD_CONTENT_PICTURE, .picture = &picture};
    if (err) return err;
    return bd_content_write(&content, put, NULL) ? BD_ERR_OK : BD_ERR_IO;
}

static enum bd_err answer_sky_map(struct task *task)
{
    const struct bd_import_file *file = &task->files[0];
    uint64_t negative_count;
    struct bd_content content = {.kind = BD_CONTENT_SKY_MAP};
    enum bd_err err = bd_sky_map_read(file->bytes, file->size_bytes, file->uri, &content.sky_map,
                                      &negative_count, &task->detail);
    if (err) return err;
    const bool sent =
        put(NULL, &negative_count, sizeof negative_count) && bd_content_write(&content, put, NULL);
    return sent ? BD_ERR_OK : BD_ERR_IO;
}

static enum bd_err answer(enum bd_import_kind kind, struct task *task)
{
    switch (kind) {
    case BD_IMPORT_SCENE:
        return answer_scene(task);
    case BD_IMPORT_PICTURE:
        return answer_picture(task);
    case BD_IMPORT_SKY_MAP:
        return answer_sky_map(task);
    }
    return bd_err_set(&task->detail, BD_ERR_INTERNAL, "", "no such question: %u", (unsigned)kind);
}

// --- its life -------------------------------------------------------------------------------

// Where nothing comes, nobody has a question any more.
static bool wait_for_go(void)
{
    char go;
    ssize_t got;
    do {
        got = read(BD_IMPORT_GO_FD, &go, sizeof go);
    } while (got < 0 && errno == EINTR);
    close(BD_IMPORT_GO_FD);
    return got == sizeof go;
}

// As many as the machine has processors for us, this thread included. Not for what is small: most
// files are.
static uint32_t helper_count(const struct bd_import_question *head, uint64_t question_bytes)
{
    const uint64_t worthwhile_bytes = 64 << 10;
    cpu_set_t set;
    if (head->kind != BD_IMPORT_SCENE || question_bytes < worthwhile_bytes) return 0;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return 0;
    return (uint32_t)CPU_COUNT(&set) - 1;
}

int bd_import_child_main(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    struct question question;
    bd_priority_lower();
    if (!wait_for_go()) return 0;
    if (!map_question(&question)) return BD_IMPORT_EXIT_QUESTION;
    const struct bd_import_question *head = take(&question, sizeof *head);
    if (!head || head->magic != BD_IMPORT_QUESTION_MAGIC) return BD_IMPORT_EXIT_QUESTION;
    struct bd_import_file *files = take_files(&question, head->file_count);
    if (!files) return BD_IMPORT_EXIT_QUESTION;
    bd_import_set_limits(&head->limits);
    struct task task = {.files = files, .file_count = head->file_count, .limits = &head->limits};
    task.pictures = bd_picture_queue_create(helper_count(head, question.size));
    if (!task.pictures || !bd_import_confine()) return BD_IMPORT_EXIT_CONFINE;

    enum bd_err err = answer((enum bd_import_kind)head->kind, &task);
    bool sent = false;
    if (err == BD_ERR_OK)
        sent = put_piece(BD_IMPORT_END, "", 0);
    else if (task.detail.err)
        sent = put_piece(BD_IMPORT_FAULT, &task.detail, sizeof task.detail);
    // Nothing is freed and no exit handler runs: the process is the arena.
    _exit(sent ? 0 : BD_IMPORT_EXIT_UNSENT);
}
