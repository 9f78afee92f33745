#include "scene/import.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "scene/flat.h"
#include "scene/import_pipe.h"

const struct bd_import_limits bd_import_default_limits = {
    .memory_bytes = 4ull << 30,
    .cpu_seconds = 60,
    .wall_seconds = 120,
    .scene_bytes = 1ull << 30,
    .triangle_count = 50000000,
    .picture_side_px = 16384,
    .picture_texels = 256ull << 20,
};

// Writes all, or false.
static bool write_all(int fd, const void *bytes, size_t size)
{
    const char *at = bytes;
    while (size > 0) {
        ssize_t wrote = write(fd, at, size);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote <= 0) return false;
        at += wrote;
        size -= (size_t)wrote;
    }
    return true;
}

static bool write_padded(int fd, const void *bytes, size_t size)
{
    static const char zeros[8];
    return write_all(fd, bytes, size) && write_all(fd, zeros, bd_import_padded(size) - size);
}

static bool write_question(int fd, const struct bd_import_file *files, uint32_t file_count,
                           const struct bd_import_limits *limits)
{
    struct bd_import_question head = {BD_IMPORT_QUESTION_MAGIC, file_count, *limits};
    bool ok = write_padded(fd, &head, sizeof head);
    for (uint32_t i = 0; ok && i < file_count; i++) {
        size_t uri_bytes = strlen(files[i].uri) + 1;
        struct bd_import_question_file file = {uri_bytes, files[i].size_bytes};
        ok = write_padded(fd, &file, sizeof file) && write_padded(fd, files[i].uri, uri_bytes) &&
             write_padded(fd, files[i].bytes, files[i].size_bytes);
    }
    return ok && lseek(fd, 0, SEEK_SET) == 0;
}

static enum bd_err make_question(const struct bd_import_file *files, uint32_t file_count,
                                 const struct bd_import_limits *limits, int *fd,
                                 struct bd_fault *fault)
{
    *fd = memfd_create("import", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (*fd < 0) return bd_fault_set(fault, BD_ERR_IO, "", "memfd_create: %s", strerror(errno));
    if (write_question(*fd, files, file_count, limits) &&
        fcntl(*fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) == 0)
        return BD_ERR_OK;
    close(*fd);
    return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory to hand over the files: %s",
                        strerror(errno));
}

// The child gets no secrets by its environment: only what the sanitizers and a bundle's loader
// need.
static char **child_environment(char *kept[8])
{
    static const char *const names[] = {"ASAN_OPTIONS=", "UBSAN_OPTIONS=",   "LSAN_OPTIONS=",
                                        "TSAN_OPTIONS=", "LD_LIBRARY_PATH=", "LC_ALL="};
    size_t count = 0;
    for (char **entry = environ; *entry; entry++)
        for (size_t i = 0; i < sizeof names / sizeof names[0] && count < 7; i++)
            if (strncmp(*entry, names[i], strlen(names[i])) == 0) kept[count++] = *entry;
    kept[count] = NULL;
    return kept;
}

static int spawn(const char *program, int question, int answer, pid_t *child)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    char name[] = "bounced", option[] = "--import", *argv[] = {name, option, NULL};
    char *kept[8];
    sigemptyset(&none);
    sigfillset(&all);
    int code = posix_spawn_file_actions_init(&actions);
    if (code) return code;
    code = posix_spawnattr_init(&attributes);
    if (code) goto actions;
    // Nothing but the two descriptors and stderr reaches the child, whatever else is open here.
    if ((code = posix_spawn_file_actions_adddup2(&actions, question, 0)) ||
        (code = posix_spawn_file_actions_adddup2(&actions, answer, 1)) ||
        (code = posix_spawn_file_actions_addclosefrom_np(&actions, 3)) ||
        (code = posix_spawnattr_setsigmask(&attributes, &none)) ||
        (code = posix_spawnattr_setsigdefault(&attributes, &all)) ||
        (code =
             posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF)))
        goto attributes;
    code = posix_spawn(child, program, &actions, &attributes, argv, child_environment(kept));
attributes:
    posix_spawnattr_destroy(&attributes);
actions:
    posix_spawn_file_actions_destroy(&actions);
    return code;
}

struct answer {
    uint8_t *bytes;
    size_t size, room;
    bool too_long, timed_out, no_memory;
};

// Grows as bytes arrive: what the child says about lengths is not believed.
static bool make_room(struct answer *answer, size_t most)
{
    if (answer->size < answer->room) return true;
    if (answer->room >= most) {
        answer->too_long = true;
        return false;
    }
    size_t room = answer->room ? answer->room * 2 : 1 << 20;
    if (room > most) room = most;
    uint8_t *bytes = realloc(answer->bytes, room);
    if (!bytes) {
        answer->no_memory = true;
        return false;
    }
    answer->bytes = bytes;
    answer->room = room;
    return true;
}

static bool wait_readable(int fd, uint64_t start_ns, uint32_t wall_seconds)
{
    for (;;) {
        double left_ms = 1e3 * wall_seconds - bd_ms_since(start_ns);
        if (left_ms <= 0) return false;
        struct pollfd poll_fd = {.fd = fd, .events = POLLIN};
        int ready = poll(&poll_fd, 1, left_ms > 1e6 ? 1000000 : (int)left_ms + 1);
        if (ready > 0) return true;
        if (ready < 0 && errno != EINTR) return false;
    }
}

// Reads to the end of the pipe, which the child's death closes.
static void read_answer(int fd, uint64_t start_ns, const struct bd_import_limits *limits,
                        struct answer *answer)
{
    const size_t most = limits->scene_bytes + limits->picture_texels * 4 + (64u << 20);
    while (make_room(answer, most)) {
        if (!wait_readable(fd, start_ns, limits->wall_seconds)) {
            answer->timed_out = true;
            return;
        }
        ssize_t got = read(fd, answer->bytes + answer->size, answer->room - answer->size);
        if (got == 0) return;
        if (got > 0) answer->size += (size_t)got;
        if (got < 0 && errno != EINTR) return;
    }
}

static enum bd_err fault_from_child(const struct answer *answer, enum bd_err err,
                                    const struct bd_import_limits *limits, struct bd_fault *fault)
{
    struct bd_fault told;
    if (answer->size != sizeof(struct bd_import_answer) + sizeof told || err >= BD_ERR_COUNT)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "", "the import gave a damaged answer");
    memcpy(&told, answer->bytes + sizeof(struct bd_import_answer), sizeof told);
    told.field[sizeof told.field - 1] = 0;
    told.message[sizeof told.message - 1] = 0;
    // The child runs out of what it was given long before the machine does.
    if (err == BD_ERR_NO_MEMORY)
        return bd_fault_set(fault, BD_ERR_LIMIT, told.field, "import limited to %llu MiB: %s",
                            (unsigned long long)(limits->memory_bytes >> 20), told.message);
    return bd_fault_set(fault, err, told.field, "%s", told.message);
}

static void set_environment(struct bd_scene *scene, const struct bd_environment *environment)
{
    bd_sky_map_release(&scene->environment.map);
    scene->environment = *environment;
    if (environment->map) bd_sky_map_retain(environment->map);
}

static enum bd_err scene_from_answer(const struct answer *answer,
                                     const struct bd_import_limits *limits,
                                     const struct bd_environment *environment,
                                     struct bd_scene **out, struct bd_fault *fault)
{
    const uint8_t *flat = answer->bytes + sizeof(struct bd_import_answer);
    size_t flat_bytes = answer->size - sizeof(struct bd_import_answer);
    struct bd_scene *scene = NULL;
    enum bd_err err = bd_flat_read(flat, flat_bytes, &scene, fault);
    if (err != BD_ERR_OK) return err;
    if (environment) set_environment(scene, environment);
    bd_scene_set_hash(scene);
    err = bd_scene_finish(scene, fault);
    if (err == BD_ERR_OK && scene->features.triangle_count > limits->triangle_count)
        err = bd_fault_set(fault, BD_ERR_LIMIT, "scene", "%llu triangles, limit %llu",
                           (unsigned long long)scene->features.triangle_count,
                           (unsigned long long)limits->triangle_count);
    if (err != BD_ERR_OK) {
        bd_scene_release(&scene);
        return err;
    }
    *out = scene;
    return BD_ERR_OK;
}

// How a child that gave no answer died, in words for the owner of the file.
static enum bd_err fault_from_death(int status, const char *file, const struct answer *answer,
                                    const struct bd_import_limits *limits, struct bd_fault *fault)
{
    if (answer->timed_out)
        return bd_fault_set(fault, BD_ERR_LIMIT, "", "%.200s: import took longer than %u s", file,
                            limits->wall_seconds);
    if (answer->too_long)
        return bd_fault_set(fault, BD_ERR_LIMIT, "", "%.200s: scene larger than %llu bytes", file,
                            (unsigned long long)limits->scene_bytes);
    if (answer->no_memory)
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "%.200s: no memory for the scene", file);
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
        return bd_fault_set(fault, BD_ERR_LIMIT, "", "%.200s: import used more than %u s", file,
                            limits->cpu_seconds);
    if (WIFSIGNALED(status))
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "", "%.200s: import died of signal %d", file,
                            WTERMSIG(status));
    return bd_fault_set(fault, BD_ERR_BAD_INPUT, "", "%.200s: import gave no answer (status %d)",
                        file, WEXITSTATUS(status));
}

static enum bd_err judge(int status, const char *file, const struct answer *answer,
                         const struct bd_import_limits *limits,
                         const struct bd_environment *environment, struct bd_scene **out,
                         struct bd_fault *fault)
{
    struct bd_import_answer head;
    bool clean = WIFEXITED(status) && WEXITSTATUS(status) == 0 && !answer->timed_out &&
                 !answer->too_long && !answer->no_memory && answer->size >= sizeof head;
    if (!clean) return fault_from_death(status, file, answer, limits, fault);
    memcpy(&head, answer->bytes, sizeof head);
    if (head.magic != BD_IMPORT_ANSWER_MAGIC)
        return fault_from_death(status, file, answer, limits, fault);
    if (head.err != BD_ERR_OK)
        return fault_from_child(answer, (enum bd_err)head.err, limits, fault);
    return scene_from_answer(answer, limits, environment, out, fault);
}

// The child's status. Its answer has ended, but that need not mean that it has: one that closed
// its pipe and waits has until the wall clock runs out, like any other.
static int reap(pid_t child, uint64_t start_ns, uint32_t wall_seconds, struct answer *answer)
{
    const struct timespec nap = {0, 500000};
    int status = 0;
    if (answer->timed_out || answer->too_long || answer->no_memory) kill(child, SIGKILL);
    for (;;) {
        pid_t reaped = waitpid(child, &status, WNOHANG);
        if (reaped == child || (reaped < 0 && errno != EINTR)) return status;
        if (bd_ms_since(start_ns) > 1e3 * wall_seconds && !answer->timed_out) {
            answer->timed_out = true;
            kill(child, SIGKILL);
        }
        nanosleep(&nap, NULL);
    }
}

enum bd_err bd_import(const char *program, const struct bd_import_file *files, uint32_t file_count,
                      const struct bd_import_limits *limits, struct bd_scene **out,
                      struct bd_fault *fault)
{
    return bd_import_under(program, files, file_count, limits, NULL, out, fault);
}

enum bd_err bd_import_under(const char *program, const struct bd_import_file *files,
                            uint32_t file_count, const struct bd_import_limits *limits,
                            const struct bd_environment *environment, struct bd_scene **out,
                            struct bd_fault *fault)
{
    *out = NULL;
    int question, ends[2];
    pid_t child;
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = make_question(files, file_count, limits, &question, fault);
    if (err != BD_ERR_OK) return err;
    if (pipe2(ends, O_CLOEXEC) != 0) {
        err = bd_fault_set(fault, BD_ERR_IO, "", "pipe: %s", strerror(errno));
        goto question;
    }
    fcntl(ends[0], F_SETPIPE_SZ, 1 << 20); // fewer turns; the default works too
    int code = spawn(program ? program : "/proc/self/exe", question, ends[1], &child);
    close(ends[1]);
    if (code) {
        err = bd_fault_set(fault, BD_ERR_IO, "", "cannot start the import: %s", strerror(code));
        goto pipe;
    }
    struct answer answer = {0};
    read_answer(ends[0], start_ns, limits, &answer);
    int status = reap(child, start_ns, limits->wall_seconds, &answer);
    err = judge(status, files[0].uri, &answer, limits, environment, out, fault);
    free(answer.bytes);
pipe:
    close(ends[0]);
question:
    close(question);
    return err;
}
