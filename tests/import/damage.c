// Damaged copies of our own scenes, in this process so that the sanitizers and the leak checker see
// everything: cut at many bytes, and changed at random places with fixed seeds. Each is refused
// with a fault, or becomes a scene that can be finished, written and read back.
//
// `damage FOLDER` runs all; `damage FOLDER NAME SEED` repeats one change and is what a failure
// prints.

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"
#include "scene/flat.h"
#include "scene/gltf.h"

static const char *const names[] = {"cornell.glb", "checker.glb", "two_lights.glb", "bare.gltf"};
enum { NAME_COUNT = sizeof names / sizeof names[0], SEED_COUNT = 1500, CUT_COUNT = 400 };

struct file {
    uint8_t *bytes;
    size_t size;
};

static struct file read_file(const char *folder, const char *name)
{
    char path[4096];
    struct stat info;
    snprintf(path, sizeof path, "%s/%s", folder, name);
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
    struct bd_fault fault = {0};
    BD_ASSERT(bd_flat_write(scene, collect, &flat));
    enum bd_err err = bd_flat_read(flat.bytes, flat.size, &again, &fault);
    if (err) fprintf(stderr, "%s: %s\n", fault.field, fault.message);
    BD_ASSERT(err == BD_ERR_OK);
    BD_ASSERT(bd_scene_finish(again, &fault) == BD_ERR_OK);
    BD_ASSERT(again->features.diagonal_m > 0);
    bd_scene_release(&again);
    free(flat.bytes);
}

static bool try_file(const char *name, struct file file, struct file beside)
{
    struct bd_import_file files[] = {{name, file.bytes, file.size},
                                     {"bare.bin", beside.bytes, beside.size}};
    struct bd_scene *scene;
    struct bd_fault fault = {0};
    enum bd_err err = bd_gltf_read(files, 2, &bd_import_default_limits, &scene, &fault);
    if (err != BD_ERR_OK) {
        BD_ASSERT(scene == NULL && fault.err == err && fault.message[0]);
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
                            struct file beside)
{
    uint32_t loaded = 0;
    for (uint32_t seed = 0; seed < SEED_COUNT; seed++) {
        fprintf(stderr, "\rdamage %s %s %u ", folder, name, seed); // the last line of a crash
        loaded += try_change(name, file, beside, seed);
    }
    return loaded;
}

int main(int argc, char **argv)
{
    if (argc != 2 && argc != 4) return 2;
    struct file beside = read_file(argv[1], "bare.bin");
    if (argc == 4) {
        struct file file = read_file(argv[1], argv[2]);
        bool loaded = try_change(argv[2], file, beside, (uint32_t)strtoul(argv[3], NULL, 10));
        printf("%s\n", loaded ? "loaded" : "refused");
        free(file.bytes);
    }
    for (size_t i = 0; argc == 2 && i < NAME_COUNT; i++) {
        struct file file = read_file(argv[1], names[i]);
        BD_ASSERT(try_file(names[i], file, beside));
        try_cuts(names[i], file, beside);
        uint32_t loaded = try_changes(argv[1], names[i], file, beside);
        printf("%s: %u of %d changed copies load\n", names[i], loaded, SEED_COUNT);
        // Both ways must have been tried, or the changes are too wild or too tame.
        BD_ASSERT(loaded > SEED_COUNT / 50 && loaded < SEED_COUNT - SEED_COUNT / 50);
        free(file.bytes);
    }
    free(beside.bytes);
    return 0;
}
