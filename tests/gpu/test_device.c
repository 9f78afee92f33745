#include <epoxy/gl.h>
#include <jansson.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "gpu_test.h"

static enum bd_err try_device(const char *device, struct bd_err_detail *detail)
{
    const struct bd_gpu_options options = {.device = device};
    struct bd_gpu *made;
    enum bd_err err = bd_gpu_create(&options, &made, detail);
    bd_gpu_destroy(&made);
    return err;
}

static void names_that_are_no_device_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *device;
        enum bd_err err;
        const char *told;
    } cases[] = {
        {"egl:9999", BD_ERR_DEVICE, "egl:9999"},
        {"egl:", BD_ERR_DEVICE, "from egl:0"},
        {"egl:0x", BD_ERR_DEVICE, "egl:0x"},
        {"gpu", BD_ERR_USAGE, "none of auto, software, egl:N, uuid:HEX, pci:ID"},
        {"uuid:ffffffffffffffffffffffffffffffff", BD_ERR_DEVICE, "--list-devices"},
        {"uuid:", BD_ERR_DEVICE, "no device uuid:"},
        {"pci:ffff:ff:1f.7", BD_ERR_DEVICE, "--list-devices"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct bd_err_detail detail = {0};
        assert_int_equal(try_device(cases[i].device, &detail), cases[i].err);
        assert_string_equal(detail.field, "device");
        assert_non_null(strstr(detail.message, cases[i].told));
    }
}

// Every device of the list can be had by the names that the list gives it.
static void listed_devices_open_by_their_names(void **state)
{
    (void)state;
    char *text = bd_gpu_list_devices(true);
    json_t *list = json_loads(text, 0, NULL);
    assert_true(json_is_array(list) && json_array_size(list) > 0);
    size_t index, working = 0;
    json_t *entry;
    json_array_foreach(list, index, entry)
    {
        if (json_object_get(entry, "error")) continue;
        working++;
        const char *uuid = json_string_value(json_object_get(entry, "uuid"));
        const char *pci = json_string_value(json_object_get(entry, "pci"));
        char by_uuid[64], by_pci[64];
        snprintf(by_uuid, sizeof by_uuid, "uuid:%s", uuid ? uuid : "");
        snprintf(by_pci, sizeof by_pci, "pci:%s", pci ? pci : "");
        struct bd_err_detail detail = {0};
        assert_int_equal(try_device(json_string_value(json_object_get(entry, "device")), &detail),
                         BD_ERR_OK);
        if (uuid) assert_int_equal(try_device(by_uuid, &detail), BD_ERR_OK);
        if (pci) assert_int_equal(try_device(by_pci, &detail), BD_ERR_OK);
    }
    assert_true(working > 0);
    json_decref(list);
    free(text);
}

static void *list_on_a_thread(void *unused)
{
    (void)unused;
    return bd_gpu_list_devices(false);
}

// A listing, here or on another thread, leaves the device at work alone.
static void listing_disturbs_nobody(void **state)
{
    (void)state;
    gpu_test_open();
    const float texel = 4.5f;
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, 1, 1, 0);
    pthread_t thread;
    void *text;
    assert_int_equal(pthread_create(&thread, NULL, list_on_a_thread, NULL), 0);
    bd_tex_upload(gpu, tex, 0, &texel, sizeof texel);
    assert_int_equal(pthread_join(thread, &text), 0);
    assert_non_null(strstr(text, bd_gpu_caps(gpu)->name));
    free(text);
    text = bd_gpu_list_devices(false);
    assert_non_null(strstr(text, "egl:0"));
    free(text);
    float found = 0;
    read_tex(tex, 0, &found, sizeof found);
    assert_true(found == texel);
    bd_tex_destroy(gpu, &tex);
    assert_int_equal(gpu_test_close(0), 0);
}

static void software_is_software(void **state)
{
    (void)state;
    const struct bd_gpu_options options = {.device = "software"};
    struct bd_gpu *made;
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, &made, &detail)) skip(); // a host with hardware drivers alone
    assert_true(bd_gpu_caps(made)->software);
    assert_non_null(strstr(bd_gpu_caps(made)->device_class, "mesa"));
    bd_gpu_destroy(&made);
}

// What is written to stderr by it.
static void log_of(void (*run)(void), char *log, size_t log_size)
{
    fflush(stderr);
    FILE *file = tmpfile();
    const int saved = dup(STDERR_FILENO);
    assert_true(file && saved >= 0 && dup2(fileno(file), STDERR_FILENO) >= 0);
    run();
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);
    rewind(file);
    log[fread(log, 1, log_size - 1, file)] = 0;
    fclose(file);
}

static bool is_software;

static void open_auto(void)
{
    const struct bd_gpu_options options = {.device = "auto"};
    struct bd_gpu *made;
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, &made, &detail)) return;
    is_software = bd_gpu_caps(made)->software;
    bd_gpu_destroy(&made);
}

static char first_log[2000]; // of this process's first device

// Once a process, however many devices it opens: a daemon does so after each loss.
static void falling_back_to_software_is_said_once(void **state)
{
    (void)state;
    const char says[] =
        "warning: gpu: no hardware device works, rendering in software; tried egl:0: ";
    assert_true(!is_software == !strstr(first_log, says));
    assert_true(!is_software == !strstr(first_log, "llvmpipe"));
    char log[2000];
    log_of(open_auto, log, sizeof log);
    assert_null(strstr(log, "rendering in software"));
}

// A call that GL refuses is our bug: it is told, not passed over.
static void a_refused_call_sticks(void **state)
{
    (void)state;
    const struct bd_gpu_options options = {.device = "auto"};
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gpu_create(&options, &gpu, &detail), BD_ERR_OK);
    glEnable(0xffff);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_INTERNAL);
    assert_int_equal(bd_gpu_status(gpu), BD_ERR_INTERNAL);
    bd_gpu_destroy(&gpu);
}

static void memory_is_counted_and_limited(void **state)
{
    (void)state;
    struct bd_gpu *other;
    const struct bd_gpu_options options = {.device = "auto", .memory_limit_bytes = 1 << 20};
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gpu_create(&options, &other, &detail), BD_ERR_OK);
    const struct bd_tex_desc levels = {.name = "levels",
                                       .format = BD_FORMAT_RGBA8,
                                       .width_px = 5,
                                       .height_px = 3,
                                       .level_count = 3,
                                       .layer_count = 2};
    struct bd_tex *tex;
    struct bd_buf *buf, *big = NULL;
    struct bd_gpu_memory memory;
    assert_int_equal(bd_tex_create(other, &levels, &tex, &detail), BD_ERR_OK);
    assert_int_equal(bd_tex_bytes(tex), (5 * 3 + 2 * 1 + 1) * 4 * 2);
    assert_int_equal(bd_buf_create(other, "half", 513 << 10, NULL, &buf, &detail), BD_ERR_OK);
    assert_int_equal(bd_buf_create(other, "big", 768 << 10, NULL, &big, &detail), BD_ERR_NO_MEMORY);
    assert_null(big);
    assert_string_equal(detail.field, "gpu_memory");
    assert_non_null(strstr(detail.message, "big needs 0.8 MiB"));
    assert_non_null(strstr(detail.message, "0.5 of the 1.0 MiB allowed"));
    bd_gpu_memory(other, &memory);
    assert_int_equal(memory.used_bytes, (513 << 10) + bd_tex_bytes(tex));
    bd_buf_destroy(other, &buf);
    bd_tex_destroy(other, &tex);
    bd_gpu_memory(other, &memory);
    assert_int_equal(memory.used_bytes, 0);
    assert_int_equal(memory.peak_bytes, (513 << 10) + 144);
    assert_int_equal(memory.limit_bytes, 1 << 20);
    bd_gpu_memory_reset_peak(other);
    bd_gpu_memory(other, &memory);
    assert_int_equal(memory.peak_bytes, 0);
    const struct bd_tex_desc wide = {.name = "wide",
                                     .format = BD_FORMAT_RGBA8,
                                     .height_px = 1,
                                     .width_px = bd_gpu_caps(other)->texture_side_max_px + 1};
    assert_int_equal(bd_tex_create(other, &wide, &tex, &detail), BD_ERR_LIMIT);
    bd_gpu_destroy(&other);
}

// The injected loss sticks, is told by everything that tells, and a new device works again.
static void an_injected_loss_sticks(void **state)
{
    (void)state;
    const struct bd_gpu_options options = {.device = "auto", .lose_after_waits = 2};
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gpu_create(&options, &gpu, &detail), BD_ERR_OK);
    struct bd_tex *tex = make_tex(BD_FORMAT_R32F, 1, 1, 0);
    struct bd_readback *readback;
    float texel;
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    assert_int_equal(bd_gpu_status(gpu), BD_ERR_OK);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_DEVICE_LOST);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_DEVICE_LOST);
    assert_int_equal(bd_gpu_status(gpu), BD_ERR_DEVICE_LOST);
    if (bd_gpu_readback_start(gpu, tex, 0, &readback, &detail) == BD_ERR_OK)
        assert_int_equal(bd_gpu_readback_finish(gpu, &readback, &texel, sizeof texel),
                         BD_ERR_DEVICE_LOST);
    bd_tex_destroy(gpu, &tex);
    bd_gpu_destroy(&gpu);

    assert_int_equal(try_device("auto", &detail), BD_ERR_OK);
    const struct bd_gpu_options again = {.device = "auto"};
    assert_int_equal(bd_gpu_create(&again, &gpu, &detail), BD_ERR_OK);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    bd_gpu_destroy(&gpu);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(listing_disturbs_nobody),
        cmocka_unit_test(names_that_are_no_device_are_refused),
        cmocka_unit_test(listed_devices_open_by_their_names),
        cmocka_unit_test(software_is_software),
        cmocka_unit_test(falling_back_to_software_is_said_once),
        cmocka_unit_test(a_refused_call_sticks),
        cmocka_unit_test(memory_is_counted_and_limited),
        cmocka_unit_test(an_injected_loss_sticks),
    };
    // One thread has one current context, so each test opens its own; this one asks for the skip.
    log_of(open_auto, first_log, sizeof first_log);
    fputs(first_log, stderr);
    gpu_test_open();
    bd_gpu_destroy(&gpu);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
