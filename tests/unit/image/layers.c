// The names of layers and of their halves, through a file and back.

#include <stdlib.h>

#include "image/layers.h"
#include "tests/unit/cmocka_all.h"

static struct bd_image *grey(float value)
{
    struct bd_image *image = bd_image_create(2, 1, 3);
    assert_non_null(image);
    for (int i = 0; i < 6; i++) image->pixels[i] = value + (float)i;
    return image;
}

static struct bd_exr *through_a_file(const struct bd_named_layer *layers, size_t count)
{
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    struct bd_exr_picture picture = {.width_px = 2, .height_px = 1, .planes = planes};
    assert_int_equal(bd_layers_to_planes(layers, count, planes, &picture.plane_count, NULL), 0);
    struct bd_bytes bytes = {0};
    struct bd_exr *exr = NULL;
    assert_int_equal(bd_exr_write(&picture, &bytes, NULL), 0);
    assert_int_equal(bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, NULL),
                     0);
    bd_bytes_finish(&bytes);
    return exr;
}

static void halves_have_one_name(void **state)
{
    (void)state;
    char name[BD_EXR_CHANNEL_NAME_MAX];
    bd_layer_half_name(BD_HALF_A, "beauty", name);
    assert_string_equal(name, "half_a");
    bd_layer_half_name(BD_HALF_B, "indirect", name);
    assert_string_equal(name, "half_b.indirect");
}

static void layers_and_halves_come_back(void **state)
{
    (void)state;
    static const char *const of[] = {"beauty", "direct"};
    char names[4][BD_EXR_CHANNEL_NAME_MAX];
    struct bd_image *images[4];
    struct bd_named_layer layers[4];
    for (int i = 0; i < 4; i++) {
        bd_layer_half_name(i & 1 ? BD_HALF_B : BD_HALF_A, of[i / 2], names[i]);
        images[i] = grey(10.0f * (float)i);
        layers[i] = (struct bd_named_layer){names[i], images[i]};
    }
    struct bd_exr *exr = through_a_file(layers, 4);
    assert_non_null(bd_exr_channel(exr, "half_a.G"));
    assert_non_null(bd_exr_channel(exr, "half_b.direct.B"));
    for (int i = 0; i < 4; i++) {
        struct bd_image *back = NULL;
        assert_int_equal(bd_layer_from_exr(exr, names[i], &back, NULL), BD_ERR_OK);
        assert_memory_equal(back->pixels, images[i]->pixels, 6 * sizeof(float));
        bd_image_destroy(&back);
        bd_image_destroy(&images[i]);
    }
    struct bd_image *none = NULL;
    struct bd_err_detail detail;
    assert_int_equal(bd_layer_from_exr(exr, "beauty", &none, &detail), BD_ERR_NOT_FOUND);
    bd_exr_destroy(&exr);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halves_have_one_name),
        cmocka_unit_test(layers_and_halves_come_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
