// The parent's side: whatever the child does, the parent gets an answer, names the file, and keeps
// neither a descriptor nor a process.
//
// argv: PROGRAM (bounced) and the folder of our own scenes.

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/sanitizer.h"
#include "scene/import/import.h"
#include "scene/import/import_confine.h"
#include "tests/unit/cmocka_all.h"

static const char *scenes;
static struct bd_import_pool *pool; // of the real program

static struct bd_import_file read_scene(const char *name)
{
    char path[4096];
    struct stat info;
    snprintf(path, sizeof path, "%s/%s", scenes, name);
    int fd = open(path, O_RDONLY);
    assert_true(fd >= 0 && fstat(fd, &info) == 0);
    void *bytes = malloc((size_t)info.st_size);
    assert_int_equal(read(fd, bytes, (size_t)info.st_size), info.st_size);
    close(fd);
    return (struct bd_import_file){name, bytes, (size_t)info.st_size};
}

static enum bd_err import_with(struct bd_import_pool *children,
                               const struct bd_import_limits *limits, struct bd_scene **scene,
                               struct bd_err_detail *detail)
{
    struct bd_import_file file = read_scene("cornell.glb");
    *detail = (struct bd_err_detail){0};
    enum bd_err err = bd_import(children, &file, 1, limits, scene, detail);
    free((void *)file.bytes);
    return err;
}

static unsigned open_descriptors(void)
{
    unsigned count = 0;
    DIR *folder = opendir("/proc/self/fd");
    assert_non_null(folder);
    while (readdir(folder)) count++;
    closedir(folder);
    return count;
}

// A program of the test's own in place of the importer.
static void write_script(char path[64], const char *body)
{
    snprintf(path, 64, "/tmp/bd_import_test_XXXXXX");
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_true(dprintf(fd, "#!/bin/sh\n%s\n", body) > 0);
    assert_int_equal(fchmod(fd, 0700), 0);
    close(fd);
}

static void assert_fails(const char *script, const struct bd_import_limits *limits,
                         enum bd_err expected, const char *words)
{
    char path[64];
    struct bd_scene *scene;
    struct bd_err_detail detail;
    write_script(path, script);
    struct bd_import_pool *scripted = bd_import_pool_create(path, 0);
    enum bd_err err = import_with(scripted, limits, &scene, &detail);
    bd_import_pool_destroy(&scripted);
    unlink(path);
    if (err != expected || !strstr(detail.message, words))
        fail_msg("%s: %s: %s", script, bd_err_name(err), detail.message);
    assert_null(scene);
}

static void a_scene_comes_through(void **state)
{
    (void)state;
    struct bd_scene *first, *second;
    struct bd_err_detail detail;
    unsigned before = open_descriptors();
    if (import_with(pool, &bd_import_default_limits, &first, &detail))
        fail_msg("%s: %s", detail.field, detail.message);
    assert_int_equal(import_with(pool, &bd_import_default_limits, &second, &detail), 0);
    assert_int_equal(first->features.triangle_count, 30);
    assert_memory_equal(first->content_sha256, second->content_sha256, 32);
    assert_true(second->aspects.counter[0] > first->aspects.counter[BD_ASPECT_COUNT - 1]);
    assert_int_equal(open_descriptors(), before);
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1); // no child is left, not even a dead one
    bd_scene_release(&first);
    bd_scene_release(&second);
}

// The head of a piece as printf of a shell writes it: kind, size, size >> 32.
#define PIECE(kind, low, high) "printf 'BdA2" kind "\\0\\0\\0" low "\\0\\0\\0" high "\\0\\0\\0'"

static void a_dead_child_is_bad_input(void **state)
{
    (void)state;
    const struct bd_import_limits *limits = &bd_import_default_limits;
    unsigned before = open_descriptors();
    assert_fails("kill -SEGV $$", limits, BD_ERR_BAD_INPUT,
                 "cornell.glb: import died of signal 11");
    assert_fails("exit 9", limits, BD_ERR_BAD_INPUT,
                 "cornell.glb: import gave no answer (status 9)");
    assert_fails("echo hello world", limits, BD_ERR_BAD_INPUT,
                 "cornell.glb: import gave no answer");
    assert_fails(PIECE("\\0", "\\22", "\\0") "; printf BDFLAT03xxxxxxxxxx", limits,
                 BD_ERR_BAD_INPUT, "flat scene is damaged");
    assert_fails(PIECE("\\2", "\\5", "\\0") "; printf short", limits, BD_ERR_BAD_INPUT,
                 "damaged answer");
    assert_fails(PIECE("\\1", "\\0", "\\0"), limits, BD_ERR_BAD_INPUT, "flat scene is damaged");
    assert_int_equal(open_descriptors(), before);
}

static void a_child_that_cannot_begin_is_not_the_files_fault(void **state)
{
    (void)state;
    static const char *const scripts[] = {"exit 2", "exit 3", "exec /nowhere/at/all 2>/dev/null"};
    for (size_t i = 0; i < sizeof scripts / sizeof *scripts; i++)
        assert_fails(scripts[i], &bd_import_default_limits, BD_ERR_INTERNAL,
                     "cornell.glb: the import could not begin");
}

static void a_slow_child_is_killed(void **state)
{
    (void)state;
    struct bd_import_limits limits = bd_import_default_limits;
    limits.wall_seconds = 1;
    uint64_t start_ns = bd_clock_ns();
    assert_fails("exec sleep 30", &limits, BD_ERR_LIMIT,
                 "cornell.glb: import took longer than 1 s");
    assert_fails("exec >&-; exec sleep 30", &limits, BD_ERR_LIMIT, "took longer than 1 s");
    assert_true(bd_ms_since(start_ns) < 10000);
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1);
}

static void a_talkative_child_is_cut_off(void **state)
{
    (void)state;
    struct bd_import_limits limits = bd_import_default_limits;
    limits.scene_bytes = 1 << 20;
    limits.picture_texels = 1;
    assert_fails(PIECE("\\0", "\\0", "\\1") "; exec cat /dev/zero", &limits, BD_ERR_LIMIT,
                 "scene larger than 1048576 bytes");
    assert_fails("exec cat /dev/zero", &limits, BD_ERR_BAD_INPUT, "damaged answer");
}

// Neither secrets in the environment nor open descriptors reach the child.
static void a_child_gets_nothing_else(void **state)
{
    (void)state;
    int null = open("/dev/null", O_RDONLY);
    int other = dup2(null, 50); // without O_CLOEXEC
    assert_int_equal(other, 50);
    setenv("BD_TEST_SECRET", "hidden", 1);
    assert_fails("[ -z \"$BD_TEST_SECRET\" ] && [ ! -e /proc/$$/fd/50 ] && exit 9; exit 8",
                 &bd_import_default_limits, BD_ERR_BAD_INPUT, "(status 9)");
    unsetenv("BD_TEST_SECRET");
    close(other);
    close(null);
}

static void limits_are_named(void **state)
{
    (void)state;
    struct bd_scene *scene;
    struct bd_err_detail detail;
    struct bd_import_limits limits = bd_import_default_limits;
    limits.triangle_count = 29;
    assert_int_equal(import_with(pool, &limits, &scene, &detail), BD_ERR_LIMIT);
    assert_non_null(strstr(detail.message, "30 triangles, limit 29"));
    limits = bd_import_default_limits;
    limits.scene_bytes = 500;
    assert_int_equal(import_with(pool, &limits, &scene, &detail), BD_ERR_LIMIT);
    assert_non_null(strstr(detail.message, "500 bytes"));
    struct bd_import_file checker = read_scene("checker.glb");
    limits = bd_import_default_limits;
    limits.picture_side_px = 7;
    assert_int_equal(bd_import(pool, &checker, 1, &limits, &scene, &detail), BD_ERR_LIMIT);
    assert_non_null(strstr(detail.message, "8 x 8 pixels, limit 7"));
    assert_string_equal(detail.field, "images[0].bufferView");
    limits = bd_import_default_limits;
    limits.picture_texels = 100; // two pictures of 64
    assert_int_equal(bd_import(pool, &checker, 1, &limits, &scene, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "images[1].bufferView");
    free((void *)checker.bytes);
}

// Two pictures of 8 x 8 into 100 texels: the first is halved, and it is said.
static void pictures_are_shrunk_to_their_limit(void **state)
{
    (void)state;
    struct bd_scene *first, *second;
    struct bd_err_detail detail;
    struct bd_import_file checker = read_scene("checker.glb");
    struct bd_import_limits limits = bd_import_default_limits;
    limits.picture_texels_kept = 100;
    assert_int_equal(bd_import(pool, &checker, 1, &limits, &first, &detail), BD_ERR_OK);
    assert_int_equal(bd_import(pool, &checker, 1, &limits, &second, &detail), BD_ERR_OK);
    assert_memory_equal(first->content_sha256, second->content_sha256, 32);
    assert_int_equal(first->pictures[0]->width_px, 4);
    assert_int_equal(first->pictures[1]->width_px, 8);
    assert_string_equal(first->flags.text[0],
                        "shrunk_pictures: 1 of 2, to 80 of 128 texels (picture_texels)");
    bd_scene_release(&first);
    bd_scene_release(&second);
    free((void *)checker.bytes);
}

// A small scene in a large file. A sanitizer's child has no such limit.
static void memory_is_limited(void **state)
{
    (void)state;
    if (BD_UNDER_SANITIZER) skip();
    const size_t size = 8 << 20;
    static const char json[] = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{}]}";
    char *bytes = malloc(size);
    assert_non_null(bytes);
    memset(bytes, ' ', size);
    memcpy(bytes, json, sizeof json - 1);
    struct bd_import_file file = {"large.gltf", bytes, size};
    struct bd_import_limits limits = bd_import_default_limits;
    struct bd_scene *scene;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_import(pool, &file, 1, &limits, &scene, &detail), BD_ERR_OK);
    bd_scene_release(&scene);
    limits.memory_bytes = 4 << 20;
    assert_int_equal(bd_import(pool, &file, 1, &limits, &scene, &detail), BD_ERR_LIMIT);
    assert_non_null(strstr(detail.message, "import limited to 4 MiB"));
    free(bytes);
}

static void *import_one(void *user)
{
    struct bd_err_detail detail;
    return (void *)(intptr_t)import_with(pool, &bd_import_default_limits, user, &detail);
}

static void several_at_once(void **state)
{
    (void)state;
    struct bd_scene *loaded[6];
    pthread_t threads[6];
    for (int i = 0; i < 6; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, import_one, &loaded[i]), 0);
    for (int i = 0; i < 6; i++) {
        void *err;
        pthread_join(threads[i], &err);
        assert_int_equal((intptr_t)err, BD_ERR_OK);
        bd_scene_release(&loaded[i]);
    }
}

// Refused by the filter, that is, and not for some other reason.
static bool is_refused(bool failed)
{
    return failed && errno == EPERM;
}

// In a process of its own: which of these are not refused? Their bits are the exit status.
static int try_forbidden_things(void)
{
    int works = 0;
    bd_import_set_limits(&bd_import_default_limits);
    if (!bd_import_confine()) return 255;
    works |= !is_refused(open("/etc/hostname", O_WRONLY | O_CREAT, 0600) < 0) << 0;
    works |= !is_refused(socket(AF_UNIX, SOCK_STREAM, 0) < 0) << 1;
    works |= !is_refused(kill(1, 0) < 0) << 2;
    works |= !is_refused(execl("/bin/true", "true", (char *)NULL) < 0) << 3;
    works |= !is_refused(mmap(NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1,
                              0) == MAP_FAILED)
             << 4;
    works |= !is_refused(unlink("/tmp/bd_no_such_file") < 0) << 5;
    void *memory = malloc(1 << 22);
    works |= (memory == NULL) << 6; // this one has to work
    free(memory);
    return works;
}

static void a_confined_process_can_only_compute(void **state)
{
    (void)state;
    int status;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) _exit(try_forbidden_things());
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_comes_through),
        cmocka_unit_test(a_dead_child_is_bad_input),
        cmocka_unit_test(a_child_that_cannot_begin_is_not_the_files_fault),
        cmocka_unit_test(a_slow_child_is_killed),
        cmocka_unit_test(a_talkative_child_is_cut_off),
        cmocka_unit_test(a_child_gets_nothing_else),
        cmocka_unit_test(limits_are_named),
        cmocka_unit_test(pictures_are_shrunk_to_their_limit),
        cmocka_unit_test(memory_is_limited),
        cmocka_unit_test(several_at_once),
        cmocka_unit_test(a_confined_process_can_only_compute),
    };
    if (argc != 3) return 2;
    scenes = argv[2];
    pool = bd_import_pool_create(argv[1], 2);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    bd_import_pool_destroy(&pool);
    return failed;
}
