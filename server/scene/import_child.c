#include <errno.h>
#include <seccomp.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "scene/flat.h"
#include "scene/gltf.h"
#include "scene/import.h"
#include "scene/import_pipe.h"

#if defined(__SANITIZE_ADDRESS__)
#define BD_UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define BD_UNDER_SANITIZER 1
#endif
#endif
#ifndef BD_UNDER_SANITIZER
#define BD_UNDER_SANITIZER 0
#endif

static void limit(int resource, uint64_t soft, uint64_t hard)
{
    setrlimit((__rlimit_resource_t)resource, &(struct rlimit){soft, hard});
}

// The sanitizer's shadow memory is larger than any limit of ours, so under it there is none. The
// wall clock is the parent's to watch.
static void set_limits(const struct bd_import_limits *limits)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(RLIMIT_CORE, 0, 0);
    limit(RLIMIT_CPU, limits->cpu_seconds, limits->cpu_seconds + 1);
    if (!BD_UNDER_SANITIZER) {
        limit(RLIMIT_DATA, limits->memory_bytes, limits->memory_bytes);
        limit(RLIMIT_NOFILE, 0, 0);
        limit(RLIMIT_STACK, 8 << 20, 8 << 20);
    }
}

// What is left: memory, the two descriptors, ending. The rest is refused and not fatal, since which
// harmless calls a libc makes (qsort asks for the size of the memory) changes with its version.
// New memory is never executable, and no memory becomes so.
static bool confine(void)
{
    static const int allowed[] = {
        SCMP_SYS(read),       SCMP_SYS(write),          SCMP_SYS(close),
        SCMP_SYS(munmap),     SCMP_SYS(mremap),         SCMP_SYS(madvise),
        SCMP_SYS(brk),        SCMP_SYS(futex),          SCMP_SYS(exit),
        SCMP_SYS(exit_group), SCMP_SYS(getrandom),      SCMP_SYS(rt_sigreturn),
        SCMP_SYS(sysinfo),    SCMP_SYS(rt_sigprocmask), SCMP_SYS(clock_gettime),
        SCMP_SYS(getpid),     SCMP_SYS(gettid),         SCMP_SYS(sched_yield)};
    // Without these a sanitizer's report has no names of functions.
    static const int for_reports[] = {
        SCMP_SYS(openat),     SCMP_SYS(open),  SCMP_SYS(readlink),
        SCMP_SYS(newfstatat), SCMP_SYS(fstat), SCMP_SYS(sigaltstack),
        SCMP_SYS(tgkill),     SCMP_SYS(lseek), SCMP_SYS(rt_sigaction)};
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (!filter) return false;
    int bad = 0;
    for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; i++)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
    bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1,
                            SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1,
                            SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    for (size_t i = 0; BD_UNDER_SANITIZER && i < sizeof for_reports / sizeof for_reports[0]; i++)
        bad |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, for_reports[i], 0);
    if (!bad) bad = seccomp_load(filter);
    seccomp_release(filter);
    return bad == 0;
}

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
    set_limits(&head->limits);
    if (!confine()) return 3;

    struct bd_fault fault = {0};
    struct bd_scene *scene;
    enum bd_err err = bd_gltf_read(files, head->file_count, &head->limits, &scene, &fault);
    bool sent = err == BD_ERR_OK ? answer_scene(scene) : answer_fault(err, &fault);
    // Nothing is freed and no exit handler runs: the process is the arena.
    _exit(sent ? 0 : 4);
}
