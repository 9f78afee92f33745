// Mesa's index, which it maps, is on the disk before Mesa sees it; and where the disk is nearly
// full there is no cache.

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gpu/shader_cache.h"
#include "tests/unit/cmocka_all.h"

#define INDEX_BYTES (8 + 65536 * 20) // Mesa 22.3

static char directory[64], folder[96], path[128];

static int set_up(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "%s/shaders.XXXXXX", "/tmp");
    assert_non_null(mkdtemp(directory));
    snprintf(folder, sizeof folder, "%s/mesa_shader_cache", directory);
    snprintf(path, sizeof path, "%s/index", folder);
    unsetenv("MESA_SHADER_CACHE_DISABLE");
    setenv("MESA_SHADER_CACHE_DIR", directory, 1);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(path);
    rmdir(folder);
    rmdir(directory);
    return 0;
}

static void expect_allocated(void)
{
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_size, INDEX_BYTES);
    assert_true(info.st_blocks * 512 >= INDEX_BYTES);
    assert_null(getenv("MESA_SHADER_CACHE_DISABLE"));
}

static void a_new_index_has_its_blocks(void **state)
{
    (void)state;
    bd_shader_cache_prepare(directory, 0);
    expect_allocated();
}

// As Mesa leaves it: its size set, and little of it written.
static void an_index_with_holes_is_filled_and_kept(void **state)
{
    (void)state;
    char word[9] = "";
    assert_int_equal(mkdir(folder, 0700), 0);
    int file = open(path, O_RDWR | O_CREAT, 0600);
    assert_int_equal(ftruncate(file, INDEX_BYTES), 0);
    assert_int_equal(pwrite(file, "its keys", 8, 700000), 8);
    bd_shader_cache_prepare(directory, 0);
    expect_allocated();
    assert_int_equal(pread(file, word, 8, 700000), 8);
    assert_string_equal(word, "its keys");
    close(file);
}

static void without_room_there_is_no_cache(void **state)
{
    (void)state;
    bd_shader_cache_prepare(directory, UINT64_MAX / 2);
    assert_string_equal(getenv("MESA_SHADER_CACHE_DISABLE"), "true");
    assert_string_equal(getenv("__GL_SHADER_DISK_CACHE"), "0");
    assert_int_not_equal(access(path, F_OK), 0);
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(a_new_index_has_its_blocks),
        TEST(an_index_with_holes_is_filled_and_kept),
        TEST(without_room_there_is_no_cache),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
