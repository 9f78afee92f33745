// What the daemon keeps: blobs, scenes by id, recent imports, the data directory.

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "net/command/import_cache.h"
#include "scene/blobs/blobs.h"
#include "scene/journal/data_dir.h"

#include "../protocol/cmocka_all.h"

static int count_files(const char *directory, const char *below)
{
    char path[4200];
    int count = 0;
    snprintf(path, sizeof path, "%s/%s", directory, below);
    DIR *list = opendir(path);
    assert_non_null(list);
    while (readdir(list)) count++;
    closedir(list);
    return count - 2; // without "." and ".."
}

static void hex_of(const char *text, char hex[BD_SHA256_HEX])
{
    uint8_t digest[BD_SHA256_BYTES];
    bd_sha256_of(text, strlen(text), digest);
    bd_sha256_hex(digest, hex);
}

static struct bd_blob_upload *begin(struct bd_blobs *blobs, const char *text)
{
    struct bd_blob_upload *upload;
    assert_int_equal(bd_blob_upload_begin(blobs, UINT64_MAX, &upload, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_write(upload, text, strlen(text), NULL), BD_ERR_OK);
    return upload;
}

static void blobs_are_whole_or_not_there(void **state)
{
    (void)state;
    struct bd_data_dir dir;
    struct bd_blobs *blobs;
    char hello[BD_SHA256_HEX], other[BD_SHA256_HEX];
    hex_of("hello", hello);
    hex_of("other", other);
    assert_int_equal(bd_data_dir_open_temporary(&dir, NULL), BD_ERR_OK);
    assert_int_equal(bd_blobs_open(dir.path, &blobs, NULL), BD_ERR_OK);

    struct bd_blob_upload *upload = begin(blobs, "hel");
    assert_int_equal(count_files(dir.path, "blobs"), 0); // nothing to see before it is whole
    assert_int_equal(bd_blob_upload_write(upload, "lo", 2, NULL), BD_ERR_OK);
    struct bd_blob_map map;
    assert_int_equal(bd_blob_upload_map(upload, &map, NULL), BD_ERR_OK);
    assert_int_equal(map.size_bytes, 5);
    assert_memory_equal(map.bytes, "hello", 5);
    bd_blob_unmap(&map);
    assert_false(bd_blobs_have(blobs, hello));
    assert_int_equal(bd_blob_upload_commit(&upload, hello, NULL), BD_ERR_OK);
    assert_null(upload);
    assert_true(bd_blobs_have(blobs, hello));

    upload = begin(blobs, "hello"); // the same again is fine
    assert_int_equal(bd_blob_upload_commit(&upload, hello, NULL), BD_ERR_OK);
    upload = begin(blobs, "hello");
    assert_int_equal(bd_blob_upload_commit(&upload, other, NULL), BD_ERR_BAD_INPUT);
    upload = begin(blobs, "other");
    bd_blob_upload_abort(&upload);
    assert_false(bd_blobs_have(blobs, other));
    assert_int_equal(count_files(dir.path, "blobs"), 1);

    assert_int_equal(bd_blobs_map(blobs, hello, &map, NULL), BD_ERR_OK);
    assert_memory_equal(map.bytes, "hello", 5);
    bd_blob_unmap(&map);
    assert_int_equal(bd_blobs_map(blobs, other, &map, NULL), BD_ERR_NOT_FOUND);
    bd_blobs_close(&blobs);
    bd_data_dir_close(&dir);
    assert_int_equal(access(dir.path, F_OK), -1);
}

// Each alone would be below the owner's quota, also when the other was whole only just now.
static void uploads_side_by_side_share_a_quota(void **state)
{
    (void)state;
    struct bd_data_dir dir;
    struct bd_blobs *blobs;
    char first_hex[BD_SHA256_HEX];
    assert_int_equal(bd_data_dir_open_temporary(&dir, NULL), BD_ERR_OK);
    assert_int_equal(bd_blobs_open(dir.path, &blobs, NULL), BD_ERR_OK);
    struct bd_blobs *own = bd_blobs_of(blobs, "token:anna", false);
    struct bd_blobs *others = bd_blobs_of(blobs, "token:bert", false);
    struct bd_blob_upload *first, *second, *third;
    assert_int_equal(bd_blob_upload_begin(own, 10, &first, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_begin(own, 10, &second, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_begin(others, 10, &third, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_write(first, "sixsix", 6, NULL), BD_ERR_OK);
    hex_of("sixsix", first_hex);
    assert_int_equal(bd_blob_upload_commit(&first, first_hex, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_write(second, "six", 3, NULL), BD_ERR_OK);
    assert_int_equal(bd_blob_upload_write(second, "six", 3, NULL), BD_ERR_LIMIT);
    assert_int_equal(bd_blob_upload_write(third, "sixsix", 6, NULL), BD_ERR_OK);
    bd_blob_upload_abort(&second);
    bd_blob_upload_abort(&third);
    bd_blobs_close(&blobs);
    bd_data_dir_close(&dir);
}

// Names come from outside: none may lead anywhere but to a blob.
static void blob_names_are_64_hexadecimal_digits(void **state)
{
    (void)state;
    char good[BD_SHA256_HEX], bad[BD_SHA256_HEX + 1];
    hex_of("x", good);
    assert_true(bd_blob_name_is_valid(good));
    for (size_t i = 0; i < 64; i++) {
        memcpy(bad, good, sizeof good);
        bad[i] = "/.G\0"[i % 4];
        assert_false(bd_blob_name_is_valid(bad));
    }
    snprintf(bad, sizeof bad, "%s0", good);
    assert_false(bd_blob_name_is_valid(bad));
    assert_false(bd_blob_name_is_valid(""));
}

static void leftovers_are_swept_at_open(void **state)
{
    (void)state;
    struct bd_data_dir dir;
    struct bd_blobs *blobs;
    char path[4200];
    assert_int_equal(bd_data_dir_open_temporary(&dir, NULL), BD_ERR_OK);
    snprintf(path, sizeof path, "%s/blobs", dir.path);
    assert_int_equal(mkdir(path, 0700), 0);
    snprintf(path, sizeof path, "%s/blobs/upload.1.2", dir.path);
    fclose(fopen(path, "w"));
    assert_int_equal(bd_blobs_open(dir.path, &blobs, NULL), BD_ERR_OK);
    assert_int_equal(count_files(dir.path, "blobs"), 0);
    bd_blobs_close(&blobs);
    bd_data_dir_close(&dir);
}

static void data_directory_is_held_once(void **state)
{
    (void)state;
    struct bd_data_dir first, second;
    assert_int_equal(bd_data_dir_open_temporary(&first, NULL), BD_ERR_OK);
    assert_int_equal(bd_data_dir_open(first.path, &second, NULL), BD_ERR_CONFLICT);
    chmod(first.path, 0750);
    assert_int_equal(bd_data_dir_open(first.path, &second, NULL), BD_ERR_FORBIDDEN);
    bd_data_dir_close(&first);
}

static void keep_import(struct bd_import_cache *cache, const char *bytes, uint64_t file_bytes,
                        struct bd_scene *scene)
{
    struct bd_import_file file = {.uri = "f", .bytes = bytes, .size_bytes = strlen(bytes)};
    uint8_t key[BD_SHA256_BYTES];
    bd_import_cache_key(&file, 1, NULL, key);
    bd_import_cache_put(cache, key, file_bytes, scene);
}

static bool holds_import(struct bd_import_cache *cache, const char *bytes)
{
    struct bd_import_file file = {.uri = "g", .bytes = bytes, .size_bytes = strlen(bytes)};
    uint8_t key[BD_SHA256_BYTES];
    bd_import_cache_key(&file, 1, NULL, key);
    struct bd_scene *scene = bd_import_cache_get(cache, key);
    bool held = scene != NULL;
    bd_scene_release(&scene);
    return held;
}

static void recent_imports_stay_and_old_ones_go(void **state)
{
    (void)state;
    struct bd_import_cache *cache = bd_import_cache_create();
    struct bd_scene *scene = bd_scene_create();
    keep_import(cache, "a", 1, scene);
    keep_import(cache, "b", 1, scene);
    keep_import(cache, "c", 1, scene);
    keep_import(cache, "d", 1, scene);
    assert_true(holds_import(cache, "a")); // and now b is the oldest
    keep_import(cache, "e", 1, scene);
    assert_true(holds_import(cache, "a") && !holds_import(cache, "b") && holds_import(cache, "e"));
    keep_import(cache, "huge", 513ull << 20, scene);
    assert_false(holds_import(cache, "huge"));
    keep_import(cache, "large", 511ull << 20, scene); // leaves room for one small one
    assert_true(holds_import(cache, "large") && holds_import(cache, "e"));
    assert_false(holds_import(cache, "c") && holds_import(cache, "d"));
    bd_import_cache_destroy(&cache);
    assert_int_equal(scene->reference_count, 1);
    bd_scene_release(&scene);
}

static void tables_of_files_do_not_read_alike(void **state)
{
    (void)state;
    static const struct bd_import_file tables[][2] = {
        {{"m", "xy", 2}, {"a", "z", 1}},
        {{"m", "x", 1}, {"a", "yz", 2}},
        {{"m", "xy", 2}, {"az", "", 0}},
        {{"m", "xy", 2}, {"b", "z", 1}},
    };
    uint8_t keys[5][BD_SHA256_BYTES];
    for (int i = 0; i < 4; i++) bd_import_cache_key(tables[i], 2, NULL, keys[i]);
    bd_import_cache_key(tables[0], 1, NULL, keys[4]);
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < i; j++) assert_memory_not_equal(keys[i], keys[j], BD_SHA256_BYTES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blobs_are_whole_or_not_there),
        cmocka_unit_test(uploads_side_by_side_share_a_quota),
        cmocka_unit_test(blob_names_are_64_hexadecimal_digits),
        cmocka_unit_test(leftovers_are_swept_at_open),
        cmocka_unit_test(data_directory_is_held_once),
        cmocka_unit_test(recent_imports_stay_and_old_ones_go),
        cmocka_unit_test(tables_of_files_do_not_read_alike),
    };
    return cmocka_run_group_tests_name("keeping", tests, NULL, NULL);
}
