// Damaged copies of our own scenes, in this process so that the sanitizers and the leak checker see
// everything: cut at many bytes, and changed at random places with fixed seeds. Each is refused
// with an error, or becomes a scene that can be finished, written and read back.
//
// `damage FOLDER [SHARED]` runs all, and where the folder of shared scenes is there, some that
// skin, morph and are sparse; `damage FOLDER PATH SEED` repeats one change: a crash's last line is
// it.

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "scene/model/flat.h"

static const char *const names[] = {"cornell.glb", "checker.glb", "two_lights.glb", "bare.gltf"};
static const char *const shared_names[] = {
    "conformance/khronos-copies/CesiumMan.glb", "conformance/gltf-rs/box_sparse.glb",
    "conformance/tinygltf/SparseMorphTargets-issue280/singleBlendshapeCube_sparse.glb",
    "conformance/assimp/simple_skin/quad_skin.glb"};
enum { SEED_COUNT = 1500, SHARED_SEED_COUNT = 300, CUT_COUNT = 400 };

struct file {
    uint8_t *bytes;
    size_t size;
};

static struct file read_file(const char *folder, const char *name)
{
    char path[4096];
    struct stat info;
    snprintf(path, sizeof path, "%s%s%s", folder, folder[0] ? "/" : "", name);
    int fd = open(path, O_RDONLY);
    BD_ASSERT(fd >= 0 && fstat(fd, &info) == 0);
    struct file file = {malloc((size_t)info.st_size), (size_t)info.st_size};
    BD_ASSERT(read(fd, file.bytes, file.size) == (ssize_t)file.size);
    close(fd);
    return file;
}

static bool collect(void *user, const void *bytes, size_t size)
{
    struct file *out = user;
    out->bytes = realloc(out->bytes, out->size + size + 1);
    BD_ASSERT(out->bytes);
    memcpy(out->bytes + out->size, bytes, size);
    out->size += size;
    return true;
}

// What the child would answer, the parent must be able to read: else the two disagree about what
// a scene may hold.
static void check_round_trip(const struct bd_scene *scene)
{
    struct file flat = {NULL, 0};
    struct bd_scene *again;
    struct bd_err_detail detail = {0};
    BD_ASSERT(bd_flat_write(scene, collect, &flat));
    enum bd_err err = bd_flat_read(flat.bytes, flat.size, &again, &detail);
    if (err) fprintf(stderr, "%s: %s\n", detail.field, detail.message);
    BD_ASSERT(err == BD_ERR_OK);
    BD_ASSERT(bd_scene_finish(again, &detail) == BD_ERR_OK);
    BD_ASSERT(again->features.diagonal_m > 0);
    bd_scene_release(&again);
    free(flat.bytes);
}

static bool try_file(const char *name, struct file file, struct file beside)
{
    struct bd_import_file files[] = {{name, file.bytes, file.size},
                                     {"bare.bin", beside.bytes, beside.size}};
    struct bd_scene *scene;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_gltf_read(files, 2, &bd_import_default_limits, &scene, &detail);
    if (err != BD_ERR_OK) {
        BD_ASSERT(scene == NULL && detail.err == err && detail.message[0]);
        return false;
    }
    check_round_trip(scene);
    bd_scene_release(&scene);
    return true;
}

static uint32_t next(uint32_t *random)
{
    *random = *random * 1664525 + 1013904223;
    return *random >> 8;
}

// Mostly inside the JSON, where a byte matters most; digits often become digits, so that the
// document stays one and the numbers lie.
static void change(struct file file, uint32_t seed)
{
    static const char values[] = "0123456789-.eE\"{}[],: \0\xff";
    uint32_t random = seed * 2654435761u + 1;
    uint32_t changes = 1 + next(&random) % 4;
    for (uint32_t i = 0; i < changes; i++) {
        size_t range = next(&random) % 4 ? file.size / 2 : file.size;
        size_t place = next(&random) % range;
        bool is_digit = file.bytes[place] >= '0' && file.bytes[place] <= '9';
        bool stays_digit = next(&random) % 4 && is_digit;
        uint32_t pick = next(&random);
        file.bytes[place] =
            stays_digit ? (uint8_t)('0' + pick % 10) : (uint8_t)values[pick % (sizeof values - 1)];
    }
}

static bool try_change(const char *name, struct file file, struct file beside, uint32_t seed)
{
    struct file copy = {malloc(file.size), file.size};
    BD_ASSERT(copy.bytes);
    memcpy(copy.bytes, file.bytes, file.size);
    change(copy, seed);
    bool loaded = try_file(name, copy, beside);
    free(copy.bytes);
    return loaded;
}

static void try_cuts(const char *name, struct file file, struct file beside)
{
    size_t step = file.size / CUT_COUNT + 1;
    for (size_t size = 0; size < file.size; size += step) {
        struct file cut = {malloc(size ? size : 1), size};
        memcpy(cut.bytes, file.bytes, size);
        BD_ASSERT(!try_file(name, cut, beside));
        free(cut.bytes);
    }
}

static uint32_t try_changes(const char *folder, const char *name, struct file file,
                            struct file beside, uint32_t seed_count)
{
    uint32_t loaded = 0;
    for (uint32_t seed = 0; seed < seed_count; seed++) {
        fprintf(stderr, "\rdamage FOLDER %s/%s %u ", folder, name, seed);
        loaded += try_change(name, file, beside, seed);
    }
    return loaded;
}

static void run(const char *folder, const char *name, struct file beside, uint32_t seed_count)
{
    struct file file = read_file(folder, name);
    BD_ASSERT(try_file(name, file, beside));
    try_cuts(name, file, beside);
    uint32_t loaded = try_changes(folder, name, file, beside, seed_count);
    printf("%s: %u of %u changed copies load\n", name, loaded, seed_count);
    // Both ways must have been tried, or the changes are too wild or too tame.
    BD_ASSERT(loaded > seed_count / 50 && loaded < seed_count - seed_count / 50);
    free(file.bytes);
}

static void repeat(const char *path, struct file beside, uint32_t seed)
{
    struct file file = read_file("", path);
    printf("%s\n", try_change(path, file, beside, seed) ? "loaded" : "refused");
    free(file.bytes);
}

int main(int argc, char **argv)
{
    if (argc < 2 || argc > 4) return 2;
    struct file beside = read_file(argv[1], "bare.bin");
    if (argc == 4) {
        repeat(argv[2], beside, (uint32_t)strtoul(argv[3], NULL, 10));
    } else {
        for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
            run(argv[1], names[i], beside, SEED_COUNT);
        bool shared = argc == 3 && access(argv[2], R_OK) == 0;
        for (size_t i = 0; shared && i < sizeof shared_names / sizeof shared_names[0]; i++)
            run(argv[2], shared_names[i], beside, SHARED_SEED_COUNT);
    }
    free(beside.bytes);
    return 0;
}
