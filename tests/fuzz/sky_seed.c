// Writes the first inputs of `sky`: OUT_FOLDER.
//
// A small picture of each compression, in scan lines and tiles, by OpenEXR's C++ library; some once
// more with a byte behind them, since sums count in those of an even length (sky.c).

#include <stdio.h>
#include <stdlib.h>

#include "tests/unit/image/exr_cxx.h"

#define WIDTH  19
#define HEIGHT 11
#define PIXELS (WIDTH * HEIGHT)

static int put(const char *folder, const char *name, const unsigned char *bytes, size_t size)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, size, file) != size || fclose(file)) {
        perror(path);
        return 1;
    }
    return 0;
}

static int put_exr(const char *folder, int compression, int tile_px)
{
    static const char *const names[] = {"none",  "rle", "zips", "zip",  "piz",
                                        "pxr24", "b44", "b44a", "dwaa", "dwab"};
    static float light[PIXELS], cover[PIXELS];
    for (int p = 0; p < PIXELS; p++) light[p] = p == 40 ? 900 : .1f + .01f * (float)(p % WIDTH);
    for (int p = 0; p < PIXELS; p++) cover[p] = p % WIDTH < 9;
    const struct exr_cxx_channel channels[] = {
        {"R", 1, light}, {"G", 1, light}, {"B", 1, light}, {"A", 1, cover}, {"Z", 2, light}};
    const struct exr_cxx_picture picture = {.width_px = WIDTH,
                                            .height_px = HEIGHT,
                                            .compression = compression,
                                            .tile_px = tile_px,
                                            .channels = channels,
                                            .channel_count = 5};
    size_t size;
    unsigned char *bytes = exr_cxx_write(&picture, &size);
    char name[64];
    snprintf(name, sizeof name, "%s%s", names[compression], tile_px ? "-tiles" : "");
    int failed = put(folder, name, bytes, size);
    if (compression >= 8) { // DWA's are read by us, all others by OpenEXR's core
        snprintf(name, sizeof name, "%s%s-longer", names[compression], tile_px ? "-tiles" : "");
        bytes = realloc(bytes, size + 1);
        bytes[size] = 0;
        failed |= put(folder, name, bytes, size + 1);
    }
    free(bytes);
    return failed;
}

int main(int argc, char **argv)
{
    if (argc != 2) return 2;
    int failed = 0;
    for (int compression = 0; compression < 10; compression++)
        failed |= put_exr(argv[1], compression, 0) | put_exr(argv[1], compression, 16);
    static const unsigned char radiance[] =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 2 +X 8\n"
        "\2\2\0\10\210\1\10\1\2\3\4\5\6\7\10\210\3\210\201"
        "\11\10\7\200\1\1\1\7";
    failed |= put(argv[1], "radiance", radiance, sizeof radiance - 1);
    return failed;
}
