#include "scene/import/import_pool.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/priority.h"

// As many as imports_at_once was when the daemon began, and no more than this: a reload changes how
// many imports run, not how many wait.
#define SPARES_MAX   8
#define IDLE_SECONDS 20

struct bd_import_pool {
    char *program; // NULL: this very one
    uint32_t spare_max;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    // Under the lock. A child dies with the thread that started it (PR_SET_PDEATHSIG), so spares,
    // which outlive the request that caused them, have a thread of their own: the keeper.
    bool has_keeper, is_ending;
    pthread_t keeper;
    uint32_t wanted, spare_count;
    struct bd_import_child spares[SPARES_MAX];
    uint64_t used_at_ns;
};

// --- start ----------------------------------------------------------------------------------

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

static int spawn(const char *program, int question, int answer, int go, pid_t *child)
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
    // Nothing but the three descriptors and stderr reaches the child, whatever else is open here.
    if ((code = posix_spawn_file_actions_adddup2(&actions, question, 0)) ||
        (code = posix_spawn_file_actions_adddup2(&actions, answer, 1)) ||
        (code = posix_spawn_file_actions_adddup2(&actions, go, BD_IMPORT_GO_FD)) ||
        (code = posix_spawn_file_actions_addclosefrom_np(&actions, BD_IMPORT_GO_FD + 1)) ||
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

// The child's ends of the pipe and of the socket come first in their pairs; 0 where all is well. A
// descriptor that is one of the child's own numbers would be written over before it is moved there.
static int above_the_childs(int *fd)
{
    if (*fd < 0) return errno;
    if (*fd > BD_IMPORT_GO_FD) return 0;
    int moved = fcntl(*fd, F_DUPFD_CLOEXEC, BD_IMPORT_GO_FD + 1);
    if (moved < 0) return errno;
    close(*fd);
    *fd = moved;
    return 0;
}

struct ends {
    int question, answer[2], go[2]; // [0] is ours
};

static void close_ends(const struct ends *ends)
{
    const int all[] = {ends->question, ends->answer[0], ends->answer[1], ends->go[0], ends->go[1]};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        if (all[i] >= 0) close(all[i]);
}

static int open_ends(struct ends *ends)
{
    *ends = (struct ends){-1, {-1, -1}, {-1, -1}};
    ends->question = memfd_create("import", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (ends->question < 0) return errno;
    if (pipe2(ends->answer, O_CLOEXEC) != 0) return errno;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends->go) != 0) return errno;
    fcntl(ends->answer[0], F_SETPIPE_SZ, 1 << 20); // fewer turns; the default works too
    int code = above_the_childs(&ends->question);
    if (!code) code = above_the_childs(&ends->answer[1]);
    return code ? code : above_the_childs(&ends->go[1]);
}

static int start(const struct bd_import_pool *pool, struct bd_import_child *out)
{
    struct ends ends;
    int code = open_ends(&ends);
    if (!code)
        code = spawn(pool->program ? pool->program : "/proc/self/exe", ends.question,
                     ends.answer[1], ends.go[1], &out->pid);
    if (code) {
        close_ends(&ends);
        return code;
    }
    close(ends.answer[1]);
    close(ends.go[1]);
    out->is_spare = out->was_told = false;
    out->question = ends.question;
    out->go = ends.go[0];
    out->answer = ends.answer[0];
    return 0;
}

// --- end ------------------------------------------------------------------------------------

static double seconds_of(struct timeval time)
{
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

void bd_import_child_reap(struct bd_import_child *child, bool kills, uint64_t start_ns,
                          uint32_t wall_seconds, struct bd_import_end *out)
{
    const struct timespec nap = {0, 500000};
    struct rusage usage = {0};
    *out = (struct bd_import_end){0};
    close(child->answer);
    close(child->question);
    if (kills) kill(child->pid, SIGKILL);
    for (;;) {
        pid_t reaped = wait4(child->pid, &out->status, WNOHANG, &usage);
        if (reaped == child->pid || (reaped < 0 && errno != EINTR)) break;
        if (bd_ms_since(start_ns) > 1e3 * wall_seconds && !out->was_late) {
            out->was_late = true;
            kill(child->pid, SIGKILL);
        }
        nanosleep(&nap, NULL);
    }
    // A socket whose other end was closed with bytes unread says so.
    char unread;
    const bool left_it = recv(child->go, &unread, 1, MSG_DONTWAIT) < 0 && errno == ECONNRESET;
    out->has_begun = child->was_told && !left_it;
    close(child->go);
    out->cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
}

static void dismiss(struct bd_import_child *child)
{
    struct bd_import_end end;
    bd_import_child_reap(child, true, bd_clock_ns(), UINT32_MAX, &end);
}

// --- spares ---------------------------------------------------------------------------------

static void add_spare(struct bd_import_pool *pool)
{
    struct bd_import_child child;
    pthread_mutex_unlock(&pool->lock);
    int code = start(pool, &child);
    pthread_mutex_lock(&pool->lock);
    if (code)
        pool->wanted = 0; // whoever needs one says why there is none
    else
        pool->spares[pool->spare_count++] = child;
}

static void dismiss_spares(struct bd_import_pool *pool)
{
    pool->wanted = 0;
    while (pool->spare_count > 0) {
        struct bd_import_child child = pool->spares[--pool->spare_count];
        pthread_mutex_unlock(&pool->lock);
        dismiss(&child);
        pthread_mutex_lock(&pool->lock);
    }
}

static void wait_idle(struct bd_import_pool *pool)
{
    const uint64_t until_ns = pool->used_at_ns + IDLE_SECONDS * 1000000000ull;
    const struct timespec until = {(time_t)(until_ns / 1000000000), (long)(until_ns % 1000000000)};
    if (pthread_cond_clockwait(&pool->changed, &pool->lock, CLOCK_MONOTONIC, &until) == ETIMEDOUT)
        dismiss_spares(pool);
}

static void *keeper_main(void *user)
{
    struct bd_import_pool *pool = user;
    bd_priority_lower(); // and with it its children
    pthread_mutex_lock(&pool->lock);
    while (!pool->is_ending) {
        if (pool->spare_count < pool->wanted)
            add_spare(pool);
        else if (pool->spare_count > 0)
            wait_idle(pool);
        else
            pthread_cond_wait(&pool->changed, &pool->lock);
    }
    dismiss_spares(pool);
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static void want_spares(struct bd_import_pool *pool)
{
    if (!pool->has_keeper)
        pool->has_keeper = pthread_create(&pool->keeper, NULL, keeper_main, pool) == 0;
    pool->wanted = pool->has_keeper ? pool->spare_max : 0;
    pool->used_at_ns = bd_clock_ns();
    pthread_cond_broadcast(&pool->changed);
}

static bool take_spare(struct bd_import_pool *pool, bool is_small, struct bd_import_child *out)
{
    pthread_mutex_lock(&pool->lock);
    const bool is_there = pool->spare_count > 0;
    // The one that has waited the longest is linked by now.
    if (is_there) {
        *out = pool->spares[0];
        out->is_spare = true;
        pool->spare_count--;
        memmove(pool->spares, pool->spares + 1, pool->spare_count * sizeof *pool->spares);
    }
    if (is_small && pool->spare_max > 0) want_spares(pool);
    pthread_mutex_unlock(&pool->lock);
    return is_there;
}

enum bd_err bd_import_child_take(struct bd_import_pool *pool, bool is_small,
                                 struct bd_import_child *out, struct bd_err_detail *detail)
{
    // A spare that somebody killed while it waited is no reason to fail.
    while (take_spare(pool, is_small, out)) {
        siginfo_t info = {0};
        if (waitid(P_PID, (id_t)out->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
            info.si_pid == 0)
            return BD_ERR_OK;
        dismiss(out);
    }
    int code = start(pool, out);
    if (!code) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "", "cannot start the import: %s", strerror(code));
}

// --- the pool -------------------------------------------------------------------------------

struct bd_import_pool *bd_import_pool_create(const char *program, uint32_t spare_count)
{
    struct bd_import_pool *pool = calloc(1, sizeof *pool);
    BD_ASSERT(pool);
    pool->program = program ? strdup(program) : NULL;
    pool->spare_max = spare_count < SPARES_MAX ? spare_count : SPARES_MAX;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->changed, NULL);
    return pool;
}

void bd_import_pool_destroy(struct bd_import_pool **address)
{
    struct bd_import_pool *pool = *address;
    *address = NULL;
    if (!pool) return;
    pthread_mutex_lock(&pool->lock);
    pool->is_ending = true;
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->lock);
    if (pool->has_keeper) pthread_join(pool->keeper, NULL);
    pthread_cond_destroy(&pool->changed);
    pthread_mutex_destroy(&pool->lock);
    free(pool->program);
    free(pool);
}

// --- the question ---------------------------------------------------------------------------

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

static bool write_question(int fd, const struct bd_import_question *question,
                           const struct bd_import_file *files)
{
    bool ok = write_padded(fd, question, sizeof *question);
    for (uint32_t i = 0; ok && i < question->file_count; i++) {
        size_t uri_bytes = strlen(files[i].uri) + 1;
        struct bd_import_question_file file = {uri_bytes, files[i].size_bytes};
        ok = write_padded(fd, &file, sizeof file) && write_padded(fd, files[i].uri, uri_bytes) &&
             write_padded(fd, files[i].bytes, files[i].size_bytes);
    }
    return ok && lseek(fd, 0, SEEK_SET) == 0;
}

bool bd_import_child_ask(struct bd_import_child *child, const struct bd_import_question *question,
                         const struct bd_import_file *files)
{
    const int seals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL;
    if (!write_question(child->question, question, files) ||
        fcntl(child->question, F_ADD_SEALS, seals) != 0)
        return false;
    // A child that is no more gives no answer either, and its status says why.
    child->was_told = send(child->go, "", 1, MSG_NOSIGNAL) == 1;
    return true;
}
