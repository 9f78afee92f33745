#include "scene/import/import.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "base/assert.h"
#include "base/clock.h"
#include "scene/import/import_answer.h"
#include "scene/import/import_pool.h"
#include "scene/import/sky_map.h"
#include "scene/model/content.h"
#include "scene/model/flat.h"

const struct bd_import_limits bd_import_default_limits = {
    .memory_bytes = 4ull << 30,
    .cpu_seconds = 60,
    .wall_seconds = 120,
    .scene_bytes = 1ull << 30,
    .triangle_count = 50000000,
    .picture_side_px = 16384,
    .picture_texels_kept = 256ull << 20,
    .picture_texels = 256ull << 20,
};

// What a body has beside the bytes that a limit speaks of: heads, small objects.
#define BODY_EXTRA_BYTES (64u << 20)

// One question and what came of it.
struct asking {
    const char *file;  // for messages
    const char *field; // for errors that are the whole file's
    const struct bd_import_limits *limits;
    struct bd_import_answer *answer;
    struct bd_import_end end;
    struct bd_err_detail *detail;
};

// --- why there is no answer -----------------------------------------------------------------

static enum bd_err err_from_child(const struct asking *asking)
{
    const struct bd_err_detail *told = &asking->answer->detail;
    // The child runs out of what it was given long before the machine does.
    if (told->err == BD_ERR_NO_MEMORY)
        return bd_err_set(asking->detail, BD_ERR_LIMIT, told->field,
                          "import limited to %llu MiB: %s",
                          (unsigned long long)(asking->limits->memory_bytes >> 20), told->message);
    return bd_err_set(asking->detail, told->err, told->field, "%s", told->message);
}

// Signals by which a program ends itself: the bytes led it there.
static bool is_crash(int number)
{
    return number == SIGSEGV || number == SIGBUS || number == SIGABRT || number == SIGILL ||
           number == SIGFPE || number == SIGSYS || number == SIGTRAP;
}

// The kernel ends whoever passes the hard limit of processor time by the same signal as one who has
// taken the last memory; the time that was used tells them apart.
static enum bd_err err_from_signal(const struct asking *asking, int number)
{
    const uint32_t cpu_seconds = asking->limits->cpu_seconds;
    const bool had_its_time = number == SIGKILL && asking->end.cpu_seconds >= cpu_seconds;
    if (number == SIGXCPU || had_its_time)
        return bd_err_set(asking->detail, BD_ERR_LIMIT, asking->field,
                          "%.200s: import used more than %u s of processor time", asking->file,
                          cpu_seconds);
    if (is_crash(number))
        return bd_err_set(asking->detail, BD_ERR_BAD_INPUT, asking->field,
                          "%.200s: import died of signal %d (%s)", asking->file, number,
                          strsignal(number));
    return bd_err_set(asking->detail, BD_ERR_NO_MEMORY, asking->field,
                      "%.200s: the import was killed by signal %d%s; nothing says that the file "
                      "is at fault",
                      asking->file, number, number == SIGKILL ? " (out of memory?)" : "");
}

// It ended before it had looked at a file.
static bool never_began(int status)
{
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    return code == BD_IMPORT_EXIT_QUESTION || code == BD_IMPORT_EXIT_CONFINE ||
           code == BD_IMPORT_EXIT_UNSTARTED;
}

// Without an answer to its end, or without an end that fits it.
static enum bd_err err_from_death(const struct asking *asking)
{
    const enum bd_import_verdict verdict = asking->answer->verdict;
    const int status = asking->end.status;
    if (verdict == BD_IMPORT_LATE || asking->end.was_late)
        return bd_err_set(asking->detail, BD_ERR_LIMIT, asking->field,
                          "%.200s: import took longer than %u s", asking->file,
                          asking->limits->wall_seconds);
    if (verdict == BD_IMPORT_LONG)
        return bd_err_set(asking->detail, BD_ERR_LIMIT, asking->field,
                          "%.200s: scene larger than %llu bytes", asking->file,
                          (unsigned long long)asking->limits->scene_bytes);
    if (verdict != BD_IMPORT_DAMAGED && WIFSIGNALED(status))
        return err_from_signal(asking, WTERMSIG(status));
    if (never_began(status))
        return bd_err_set(asking->detail, BD_ERR_INTERNAL, asking->field,
                          "%.200s: the import could not begin (status %d); nothing says that "
                          "the file is at fault",
                          asking->file, WEXITSTATUS(status));
    if (asking->answer->has_body || verdict == BD_IMPORT_DAMAGED)
        return bd_err_set(asking->detail, BD_ERR_BAD_INPUT, asking->field,
                          "%.200s: import gave no answer (a damaged answer, status %d)",
                          asking->file, WEXITSTATUS(status));
    return bd_err_set(asking->detail, BD_ERR_BAD_INPUT, asking->field,
                      "%.200s: import gave no answer (status %d)", asking->file,
                      WEXITSTATUS(status));
}

// `read` is what the reader of the body made of it, with its error in place.
static enum bd_err judge(const struct asking *asking, enum bd_err read)
{
    const bool is_clean = WIFEXITED(asking->end.status) && WEXITSTATUS(asking->end.status) == 0 &&
                          !asking->end.was_late;
    switch (asking->answer->verdict) {
    case BD_IMPORT_WHOLE:
        if (is_clean) return read;
        break;
    case BD_IMPORT_REFUSED:
        if (is_clean) return err_from_child(asking);
        break;
    case BD_IMPORT_OPEN:
        return read;
    case BD_IMPORT_CUT:
        if (is_clean && asking->answer->has_body && read) return read;
        break;
    case BD_IMPORT_DAMAGED:
    case BD_IMPORT_LATE:
    case BD_IMPORT_LONG:
        break;
    }
    return err_from_death(asking);
}

// --- asking ---------------------------------------------------------------------------------

// Reads a body; on failure it leaves nothing behind.
typedef enum bd_err (*read_body)(void *user, struct bd_import_answer *answer, uint64_t most_bytes,
                                 struct bd_err_detail *detail);

// `is_void`: the child had ended before it knew of a question.
static enum bd_err ask_child(struct bd_import_child *child,
                             const struct bd_import_question *question,
                             const struct bd_import_file *files, uint64_t most_bytes,
                             read_body read, void *user, bool *is_void,
                             struct bd_err_detail *detail)
{
    struct asking asking = {.file = files[0].uri,
                            .field = question->kind == BD_IMPORT_SCENE ? "" : files[0].uri,
                            .limits = &question->limits,
                            .detail = detail};
    const uint64_t start_ns = bd_clock_ns();
    if (!bd_import_child_ask(child, question, files)) {
        const int code = errno;
        bd_import_child_reap(child, true, start_ns, question->limits.wall_seconds, &asking.end);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory to hand over the files: %s",
                          strerror(code));
    }
    asking.answer = malloc(sizeof *asking.answer);
    BD_ASSERT(asking.answer);
    bd_import_answer_begin(asking.answer, child->answer, start_ns, question->limits.wall_seconds,
                           most_bytes);
    enum bd_err err = read(user, asking.answer, most_bytes, detail);
    if (!err) bd_import_answer_end(asking.answer);
    // How a child ended whose pipe is at its end tells why; others may still have much to say.
    const enum bd_import_verdict verdict = asking.answer->verdict;
    const bool kills =
        verdict != BD_IMPORT_WHOLE && verdict != BD_IMPORT_REFUSED && verdict != BD_IMPORT_CUT;
    bd_import_child_reap(child, kills, start_ns, question->limits.wall_seconds, &asking.end);
    err = judge(&asking, err);
    *is_void = verdict == BD_IMPORT_CUT && !asking.answer->has_body && !asking.end.has_begun;
    free(asking.answer);
    return err;
}

static enum bd_err ask(struct bd_import_pool *pool, enum bd_import_kind kind,
                       const struct bd_import_file *files, uint32_t file_count,
                       const struct bd_import_limits *limits, uint64_t most_bytes, read_body read,
                       void *user, struct bd_err_detail *detail)
{
    const struct bd_import_question question = {.magic = BD_IMPORT_QUESTION_MAGIC,
                                                .kind = kind,
                                                .file_count = file_count,
                                                .limits = *limits};
    // Whoever killed one that was waiting costs nobody an answer: the next is asked.
    for (;;) {
        struct bd_import_child child;
        bool is_void = false;
        enum bd_err err = bd_import_child_take(pool, kind != BD_IMPORT_SCENE, &child, detail);
        if (err) return err;
        err = ask_child(&child, &question, files, most_bytes, read, user, &is_void, detail);
        if (!is_void || !child.is_spare) return err;
    }
}

// --- scenes ---------------------------------------------------------------------------------

static enum bd_err read_scene(void *user, struct bd_import_answer *answer, uint64_t most_bytes,
                              struct bd_err_detail *detail)
{
    return bd_flat_receive(bd_import_answer_body, answer, most_bytes, (struct bd_scene **)user,
                           detail);
}

static void set_environment(struct bd_scene *scene, const struct bd_environment *environment)
{
    bd_sky_map_release(&scene->environment.map);
    scene->environment = *environment;
    if (environment->map) bd_sky_map_retain(environment->map);
}

static enum bd_err finish(struct bd_scene *scene, const struct bd_import_limits *limits,
                          const struct bd_environment *environment, struct bd_err_detail *detail)
{
    if (environment) set_environment(scene, environment);
    bd_scene_set_hash(scene);
    enum bd_err err = bd_scene_finish(scene, detail);
    if (err == BD_ERR_OK && scene->features.triangle_count > limits->triangle_count)
        err = bd_err_set(detail, BD_ERR_LIMIT, "scene", "%llu triangles, limit %llu",
                         (unsigned long long)scene->features.triangle_count,
                         (unsigned long long)limits->triangle_count);
    return err;
}

static uint64_t least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

enum bd_err bd_import(struct bd_import_pool *pool, const struct bd_import_file *files,
                      uint32_t file_count, const struct bd_import_limits *limits,
                      struct bd_scene **out, struct bd_err_detail *detail)
{
    return bd_import_under(pool, files, file_count, limits, NULL, out, detail);
}

enum bd_err bd_import_under(struct bd_import_pool *pool, const struct bd_import_file *files,
                            uint32_t file_count, const struct bd_import_limits *limits,
                            const struct bd_environment *environment, struct bd_scene **out,
                            struct bd_err_detail *detail)
{
    const uint64_t texels = least(limits->picture_texels, limits->picture_texels_kept);
    const uint64_t most_bytes = limits->scene_bytes + 4 * texels + BODY_EXTRA_BYTES;
    struct bd_scene *scene = NULL;
    *out = NULL;
    enum bd_err err = ask(pool, BD_IMPORT_SCENE, files, file_count, limits, most_bytes, read_scene,
                          &scene, detail);
    if (!err) err = finish(scene, limits, environment, detail);
    if (err)
        bd_scene_release(&scene);
    else
        *out = scene;
    return err;
}

// --- pictures and skies ---------------------------------------------------------------------

static enum bd_err read_picture(void *user, struct bd_import_answer *answer, uint64_t most_bytes,
                                struct bd_err_detail *detail)
{
    return bd_content_receive(BD_CONTENT_PICTURE, bd_import_answer_body, answer, most_bytes, user,
                              detail);
}

enum bd_err bd_import_picture(struct bd_import_pool *pool, const struct bd_import_file *file,
                              const struct bd_import_limits *limits, struct bd_picture **out,
                              struct bd_err_detail *detail)
{
    const uint64_t most_bytes = 4 * limits->picture_texels + BODY_EXTRA_BYTES;
    struct bd_content content = {.kind = BD_CONTENT_PICTURE};
    *out = NULL;
    enum bd_err err =
        ask(pool, BD_IMPORT_PICTURE, file, 1, limits, most_bytes, read_picture, &content, detail);
    if (err)
        bd_content_release(&content);
    else
        *out = content.picture;
    return err;
}

struct sky {
    uint64_t negative_count;
    struct bd_content content;
};

static enum bd_err read_sky_map(void *user, struct bd_import_answer *answer, uint64_t most_bytes,
                                struct bd_err_detail *detail)
{
    struct sky *sky = user;
    if (!bd_import_answer_body(answer, &sky->negative_count, sizeof sky->negative_count))
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "", "content is damaged");
    return bd_content_receive(BD_CONTENT_SKY_MAP, bd_import_answer_body, answer, most_bytes,
                              &sky->content, detail);
}

enum bd_err bd_import_sky_map(struct bd_import_pool *pool, const struct bd_import_file *file,
                              const struct bd_import_limits *limits, struct bd_sky_map **out,
                              uint64_t *negative_count, struct bd_err_detail *detail)
{
    const uint64_t texel_bytes = 3 * sizeof(float);
    const uint64_t most_bytes =
        texel_bytes * BD_SKY_MAP_SIDE_MAX_PX * BD_SKY_MAP_SIDE_MAX_PX + BODY_EXTRA_BYTES;
    struct sky sky = {.content.kind = BD_CONTENT_SKY_MAP};
    *out = NULL;
    enum bd_err err =
        ask(pool, BD_IMPORT_SKY_MAP, file, 1, limits, most_bytes, read_sky_map, &sky, detail);
    if (err) {
        bd_content_release(&sky.content);
        return err;
    }
    *out = sky.content.sky_map;
    *negative_count = sky.negative_count;
    return BD_ERR_OK;
}
