// Which files a scene's uris may mean: those in its folder, however they are spelt, and no others.

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/cli/files.h"
#include "tests/unit/cmocka_all.h"

// ROOT/outside.bin, ROOT/scene/{a.bin, my file.bin, KEY, sub/b.bin}, and links.
static char root[256], folder[300];

static void path_in(char *out, size_t size, const char *name)
{
    snprintf(out, size, "%s/%s", root, name);
}

static void put(const char *name, const char *text)
{
    char path[512];
    path_in(path, sizeof path, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void link_to(const char *target, const char *name)
{
    char path[512];
    path_in(path, sizeof path, name);
    assert_int_equal(symlink(target, path), 0);
}

static void make_folder(const char *name)
{
    char path[512];
    path_in(path, sizeof path, name);
    assert_int_equal(mkdir(path, 0700), 0);
}

static int build_tree(void **state)
{
    (void)state;
    char start[] = "/tmp/bounce-resolve-XXXXXX";
    char *resolved = mkdtemp(start) ? realpath(start, NULL) : NULL;
    if (!resolved) return -1;
    snprintf(root, sizeof root, "%s", resolved);
    free(resolved);
    make_folder("scene");
    make_folder("scene/sub");
    make_folder("scene-evil");
    snprintf(folder, sizeof folder, "%s/scene", root);
    put("outside.bin", "secret");
    put("scene-evil/x.bin", "secret");
    put("scene/a.bin", "a");
    put("scene/my file.bin", "spaces");
    put("scene/K\xc3\xbc"
        "che.bin",
        "unicode");
    put("scene/100%.bin", "percent");
    put("scene/sub/b.bin", "b");
    link_to("a.bin", "scene/inside-link.bin");
    link_to("../outside.bin", "scene/outside-link.bin");
    link_to("/etc", "scene/etc-link");
    link_to("loop.bin", "scene/loop.bin");
    char fifo[512];
    path_in(fifo, sizeof fifo, "scene/fifo.bin");
    return mkfifo(fifo, 0600);
}

static int remove_tree(void **state)
{
    (void)state;
    char command[400];
    snprintf(command, sizeof command, "rm -r '%s'", root);
    return system(command);
}

static enum bd_err resolve(const char *uri, char **path, struct bd_err_detail *detail)
{
    bool is_data;
    return bd_cli_resolve_uri(folder, uri, path, &is_data, detail);
}

static void files_inside_are_found_however_spelt(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"a.bin", "a.bin"},
        {"./a.bin", "a.bin"},
        {"sub/../a.bin", "a.bin"},
        {"sub//b.bin", "sub/b.bin"},
        {"sub%2Fb.bin", "sub/b.bin"},
        {"sub/%2e%2e/a.bin", "a.bin"},
        {"my file.bin", "my file.bin"},
        {"my%20file.bin", "my file.bin"},
        {"K%C3%BCche.bin", "K\xc3\xbc"
                           "che.bin"},
        {"K\xc3\xbc"
         "che.bin",
         "K\xc3\xbc"
         "che.bin"},
        {"100%.bin", "100%.bin"},
        {"100%25.bin", "100%.bin"},
        {"inside-link.bin", "a.bin"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char *path = NULL, want[600];
        struct bd_err_detail detail = {0};
        if (resolve(cases[i][0], &path, &detail)) fail_msg("%s: %s", cases[i][0], detail.message);
        snprintf(want, sizeof want, "%s/%s", folder, cases[i][1]);
        if (!path || strcmp(path, want) != 0) fail_msg("%s led to %s", cases[i][0], path);
        free(path);
    }
}

static void everything_else_is_refused(void **state)
{
    (void)state;
    static const char *const cases[] = {
        "../outside.bin",
        "sub/../../outside.bin",
        "%2e%2e/outside.bin",
        "%2E%2e%2foutside.bin",
        "..%2Foutside.bin",
        "../scene-evil/x.bin",  // shares the folder's name as a prefix
        "../nothing-there.bin", // must not tell what exists outside
        "outside-link.bin",
        "etc-link/passwd",
        "/etc/passwd",
        "%2Fetc/passwd",
        "//host/share",
        "file:///etc/passwd",
        "FILE:a.bin",
        "http://example.org/a.bin",
        "C:/a.bin",
        "loop.bin",
        "a.bin%00.png",
        "",
        ".",
        "sub/..",
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char *path = NULL;
        struct bd_err_detail detail = {0};
        if (resolve(cases[i], &path, &detail) != BD_ERR_BAD_INPUT || path)
            fail_msg("\"%s\" was taken", cases[i]);
        assert_true(detail.message[0]);
        assert_null(strstr(detail.message, root)); // nor where things lie
    }
}

static void missing_and_data_are_neither(void **state)
{
    (void)state;
    char *path = NULL;
    bool is_data = true;
    assert_int_equal(bd_cli_resolve_uri(folder, "none.bin", &path, &is_data, NULL), BD_ERR_OK);
    assert_true(!path && !is_data);
    assert_int_equal(bd_cli_resolve_uri(folder, "a.bin/x", &path, &is_data, NULL), BD_ERR_OK);
    assert_true(!path && !is_data);
    assert_int_equal(bd_cli_resolve_uri(folder, "data:,x", &path, &is_data, NULL), BD_ERR_OK);
    assert_true(!path && is_data);
}

static void only_regular_files_are_opened(void **state)
{
    (void)state;
    char path[600];
    uint64_t size_bytes = 0;
    snprintf(path, sizeof path, "%s/fifo.bin", folder);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_cli_open_regular(path, &size_bytes, &detail), -1);
    assert_non_null(strstr(detail.message, "regular"));
    assert_int_equal(bd_cli_open_regular("/dev/zero", &size_bytes, &detail), -1);
    assert_int_equal(bd_cli_open_regular(folder, &size_bytes, &detail), -1);
    snprintf(path, sizeof path, "%s/my file.bin", folder);
    int fd = bd_cli_open_regular(path, &size_bytes, &detail);
    assert_true(fd >= 0);
    assert_int_equal(size_bytes, 6);
    close(fd);
}

static void collect(const char *json, struct bd_cli_files *files, enum bd_err want,
                    struct bd_err_detail *detail)
{
    put("scene/s.gltf", json);
    char path[600];
    snprintf(path, sizeof path, "%s/s.gltf", folder);
    enum bd_err err = bd_cli_files_collect(path, files, detail);
    if (err != want) fail_msg("%s: %s", bd_err_name(err), detail->message);
}

static void a_scene_brings_its_files(void **state)
{
    (void)state;
    struct bd_cli_files files;
    struct bd_err_detail detail = {0};
    collect("{\"buffers\":[{\"uri\":\"my%20file.bin\"},{\"uri\":\"my%20file.bin\"},{}],"
            "\"images\":[{\"uri\":\"data:,\"},{\"uri\":\"gone.png\"},{\"uri\":\"sub/b.bin\"}]}",
            &files, BD_ERR_OK, &detail);
    assert_int_equal(files.count, 3);
    assert_null(files.items[0].uri);
    assert_string_equal(files.items[1].uri, "my%20file.bin");
    assert_int_equal(files.items[1].size_bytes, 6);
    assert_string_equal(files.items[2].uri, "sub/b.bin");
    // printf b | sha256sum
    assert_string_equal(files.items[2].blob,
                        "sha256:3e23e8160039594a33894f6564e1b1348bbd7a0088d42c4acb73eeaed59c009d");
    assert_string_equal(files.missing, "gone.png\n");
    bd_cli_files_finish(&files);
}

static void a_bad_uri_is_named_by_its_path(void **state)
{
    (void)state;
    struct bd_cli_files files;
    struct bd_err_detail detail = {0};
    collect("{\"images\":[{\"uri\":\"a.bin\"},{\"uri\":\"../outside.bin\"}]}", &files,
            BD_ERR_BAD_INPUT, &detail);
    assert_string_equal(detail.field, "images[1].uri");
    assert_non_null(strstr(detail.message, "../outside.bin"));
    collect("{\"buffers\":[{\"uri\":\"fifo.bin\"}]}", &files, BD_ERR_BAD_INPUT, &detail);
    assert_string_equal(detail.field, "buffers[0].uri");
}

// The importer says what is wrong with it; here it is merely a file.
static void what_is_no_json_travels_alone(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "",        "{", "[]", "{\"buffers\":7,\"images\":[3,null]}", "{\"buffers\":[{\"uri\":5}]}",
        "glTF\x02"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct bd_cli_files files;
        struct bd_err_detail detail = {0};
        collect(texts[i], &files, BD_ERR_OK, &detail);
        assert_int_equal(files.count, 1);
        bd_cli_files_finish(&files);
    }
}

// A .glb may name files too: the JSON is its first chunk.
static void a_glb_is_searched_as_well(void **state)
{
    (void)state;
    const char json[] = "{\"images\":[{\"uri\":\"a.bin\"}]}  ";
    char glb[100] = "glTF\x02\0\0\0";
    const uint32_t total = 20 + sizeof json - 1, length = sizeof json - 1, type = 0x4e4f534a;
    memcpy(glb + 8, &total, 4);
    memcpy(glb + 12, &length, 4);
    memcpy(glb + 16, &type, 4);
    memcpy(glb + 20, json, length);
    char path[600];
    snprintf(path, sizeof path, "%s/s.glb", folder);
    FILE *file = fopen(path, "w");
    fwrite(glb, 1, total, file);
    fclose(file);
    struct bd_cli_files files;
    assert_int_equal(bd_cli_files_collect(path, &files, NULL), BD_ERR_OK);
    assert_int_equal(files.count, 2);
    assert_string_equal(files.items[1].uri, "a.bin");
    bd_cli_files_finish(&files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(files_inside_are_found_however_spelt),
        cmocka_unit_test(everything_else_is_refused),
        cmocka_unit_test(missing_and_data_are_neither),
        cmocka_unit_test(only_regular_files_are_opened),
        cmocka_unit_test(a_scene_brings_its_files),
        cmocka_unit_test(a_bad_uri_is_named_by_its_path),
        cmocka_unit_test(what_is_no_json_travels_alone),
        cmocka_unit_test(a_glb_is_searched_as_well),
    };
    return cmocka_run_group_tests(tests, build_tree, remove_tree);
}
