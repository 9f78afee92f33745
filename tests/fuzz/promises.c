#include "tests/fuzz/promises.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/model/content_table.h"
#include "scene/model/flat.h"
#include "tests/fuzz/derived.h"

bool promises_is_same(const struct bd_scene *a, const struct bd_scene *b)
{
    return memcmp(a->content_sha256, b->content_sha256, sizeof a->content_sha256) == 0;
}

// --- bytes ----------------------------------------------------------------------------------

struct text {
    uint8_t *bytes;
    size_t size, room;
};

static bool append(void *user, const void *bytes, size_t size)
{
    struct text *text = user;
    if (text->size + size > text->room) {
        text->room = 2 * (text->size + size);
        text->bytes = realloc(text->bytes, text->room);
        BD_ASSERT(text->bytes);
    }
    memcpy(text->bytes + text->size, bytes, size);
    text->size += size;
    return true;
}

static void keep_content(void *user, const struct bd_content *content)
{
    bd_content_table_put(user, content);
}

static bool find_content(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    const struct bd_content *known = bd_content_table_get(user, sha256);
    if (!known || known->kind != out->kind) return false;
    *out = bd_content_retain(known);
    return true;
}

// --- what holds for every change ------------------------------------------------------------

static void expect_applied(const struct bd_scene *base, const struct bd_delta *delta,
                           const struct bd_scene *expected)
{
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_delta_apply(base, delta, &scene, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    BD_ASSERT(promises_is_same(scene, expected));
    bd_scene_release(&scene);
}

// A delta comes back from its bytes.
static void check_bytes(const struct bd_scene *base, const struct bd_delta *delta,
                        const struct bd_scene *after)
{
    struct text text = {0};
    struct bd_content_table table = {0};
    struct bd_delta again;
    struct bd_err_detail detail = {0};
    bd_content_of_delta(delta, keep_content, &table);
    bool written = bd_delta_write(delta, append, &text);
    BD_ASSERT(written);
    enum bd_err err = bd_delta_read(text.bytes, text.size, find_content, &table, &again, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    expect_applied(base, &again, after);
    bd_delta_finish(&again);
    bd_content_table_finish(&table);
    free(text.bytes);
}

// So does a scene, from its flat form and from its index.
static void check_flat(const struct bd_scene *scene)
{
    struct text whole = {0}, index = {0};
    struct bd_content_table table = {0};
    struct bd_scene *again[2] = {NULL, NULL};
    struct bd_err_detail detail = {0};
    bd_content_of_scene(scene, keep_content, &table);
    bool written =
        bd_flat_write(scene, append, &whole) && bd_flat_write_index(scene, append, &index);
    BD_ASSERT(written);
    enum bd_err err = bd_flat_read(whole.bytes, whole.size, &again[0], &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    err = bd_flat_read_index(index.bytes, index.size, find_content, &table, &again[1], &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    for (int i = 0; i < 2; i++) {
        err = bd_scene_finish(again[i], &detail);
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
        bd_scene_set_hash(again[i]);
        BD_ASSERT(promises_is_same(again[i], scene));
        bd_scene_release(&again[i]);
    }
    bd_content_table_finish(&table);
    free(whole.bytes);
    free(index.bytes);
}

void promises_check(const struct bd_scene *base, const struct bd_delta *delta,
                    const struct bd_scene *after)
{
    struct bd_delta inverse, between;
    bool made = bd_delta_invert(base, delta, &inverse) && bd_delta_between(base, after, &between);
    BD_ASSERT(made);
    expect_applied(base, delta, after);
    expect_applied(after, &inverse, base);
    expect_applied(base, &between, after);
    bd_delta_finish(&inverse);
    bd_delta_finish(&between);
    check_bytes(base, delta, after);
    check_flat(after);
    derived_check_aspects(base, after);
    derived_check_from_scratch(after);
}
