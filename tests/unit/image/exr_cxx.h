// OpenEXR's C++ library beside our own: it writes what we read, and reads it too.

#ifndef BD_TESTS_UNIT_IMAGE_EXR_CXX_H
#define BD_TESTS_UNIT_IMAGE_EXR_CXX_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct exr_cxx_channel {
    const char *name;
    int type;             // 0 uint, 1 half, 2 float
    const float *samples; // rows from the top
};

struct exr_cxx_picture {
    int width_px, height_px, left_px, top_px;
    int compression; // OpenEXR's number, 0 NONE to 9 DWAB
    int tile_px;     // 0 for scan lines
    bool second_part;
    const struct exr_cxx_channel *channels;
    int channel_count;
};

// malloc'd; asserts that it worked.
unsigned char *exr_cxx_write(const struct exr_cxx_picture *picture, size_t *size_bytes);
// That channel of the first part, as floats; false if the library refuses the file.
bool exr_cxx_read(const unsigned char *bytes, size_t size_bytes, const char *channel, float *out);

#ifdef __cplusplus
}
#endif

#endif
