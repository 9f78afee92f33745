// The flat form: what is written is what is read, and nothing else is believed.

#include <stdio.h>

#include "scene/flat.h"
#include "tests/unit/scene/read_text.h"

struct bytes {
    uint8_t *data;
    size_t size, stop_at; // the sink fails from there on
};

static bool collect(void *user, const void *bytes, size_t size)
{
    struct bytes *out = user;
    if (out->size + size > out->stop_at) return false;
    out->data = realloc(out->data, out->size + size + 1);
    assert_non_null(out->data);
    memcpy(out->data + out->size, bytes, size);
    out->size += size;
    return true;
}

// One of everything: two nodes, a light, a camera, a texture, colours and both texture sets.
static struct bd_scene *rich_scene(void)
{
    static const float bin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1};
    return read_text(
        "{'asset':{'version':'2.0'},'nodes':[{'name':'K\xc3\xbc"
        "che','mesh':0,'children':[1]},"
        "{'camera':0,'extensions':{'KHR_lights_punctual':{'light':0}}}],"
        "'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.1}}],"
        "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point'}]}},"
        "'buffers':[{'uri':'b.bin','byteLength':60}],'bufferViews':[{'buffer':0,'byteLength':60}],"
        "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':36,'componentType':5126,'count':3,'type':'VEC2'}],"
        "'images':[{'uri':'data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1Pe"
        "AAAADElEQVQYV2P4z/AfAAQAAf+I0P3MAAAAAElFTkSuQmCC'}],'textures':[{'source':0}],"
        "'materials':[{'normalTexture':{'index':0,'texCoord':1}}],'meshes':[{'primitives':["
        "{'material':0,'attributes':{'POSITION':0,'COLOR_0':0,'TEXCOORD_0':1,'TEXCOORD_1':1}}]}]}",
        bin, sizeof bin);
}

static struct bytes flatten(const struct bd_scene *scene)
{
    struct bytes out = {NULL, 0, SIZE_MAX};
    assert_true(bd_flat_write(scene, collect, &out));
    return out;
}

static void a_scene_survives(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bd_fault fault = {0};
    struct bytes first = flatten(scene);
    assert_int_equal(bd_flat_read(first.data, first.size, &again, &fault), BD_ERR_OK);
    struct bytes second = flatten(again);
    assert_int_equal(first.size, second.size);
    assert_memory_equal(first.data, second.data, first.size);
    assert_int_equal(bd_scene_finish(again, &fault), BD_ERR_OK);
    assert_string_equal(again->nodes[0].name, "K\xc3\xbc"
                                              "che");
    assert_int_equal(again->meshes[0]->content_hash, scene->meshes[0]->content_hash);
    assert_int_equal(again->pictures[0]->content_hash, scene->pictures[0]->content_hash);
    assert_non_null(again->meshes[0]->primitives[0].tangent);
    free(first.data);
    free(second.data);
    bd_scene_release(&scene);
    bd_scene_release(&again);
}

static void every_cut_is_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bytes flat = flatten(scene);
    for (size_t size = 0; size < flat.size; size++) {
        uint8_t *cut = malloc(size ? size : 1); // its own block, so that ASan sees any overrun
        assert_non_null(cut);
        memcpy(cut, flat.data, size);
        struct bd_fault fault = {0};
        assert_int_equal(bd_flat_read(cut, size, &again, &fault), BD_ERR_BAD_INPUT);
        free(cut);
    }
    struct bytes partial = {NULL, 0, flat.size - 1};
    assert_false(bd_flat_write(scene, collect, &partial));
    free(partial.data);
    free(flat.data);
    bd_scene_release(&scene);
}

// An answer that was tampered with is refused or is a scene that can be finished; the numbers in
// it are in range either way.
static void changed_bytes_do_no_harm(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene();
    struct bytes flat = flatten(scene);
    uint32_t random = 1;
    unsigned read = 0;
    for (int round = 0; round < 20000; round++) {
        struct bytes copy = {malloc(flat.size), flat.size, 0};
        assert_non_null(copy.data);
        memcpy(copy.data, flat.data, flat.size);
        for (int change = 0; change < 1 + round % 3; change++) {
            static const uint8_t values[] = {0, 1, 0x7f, 0x80, 0xff};
            random = random * 1664525 + 1013904223;
            copy.data[random % copy.size] = values[(random >> 16) % sizeof values];
        }
        struct bd_scene *again;
        struct bd_fault fault = {0};
        if (bd_flat_read(copy.data, copy.size, &again, &fault) == BD_ERR_OK) {
            assert_int_equal(bd_scene_finish(again, &fault), BD_ERR_OK);
            bd_scene_release(&again);
            read++;
        }
        free(copy.data);
    }
    assert_in_range(read, 1000, 19000); // both ways were tried
    free(flat.data);
    bd_scene_release(&scene);
}

// A count costs memory only as far as bytes stand behind it.
static void counts_are_not_believed(void **state)
{
    (void)state;
    static const uint32_t counts[] = {0xffffffff, 0x7fffffff, 0x10000000, 1000};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        uint8_t flat[128] = "BDFLAT02"; // then the number of pictures
        struct bd_scene *scene;
        struct bd_fault fault = {0};
        memcpy(flat + 8, &counts[i], sizeof counts[i]);
        assert_int_equal(bd_flat_read(flat, sizeof flat, &scene, &fault), BD_ERR_BAD_INPUT);
        assert_string_equal(fault.field, "pictures");
    }
}

static void loops_of_nodes_are_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bd_fault fault = {0};
    scene->nodes[0].parent = 1;
    uint32_t looping;
    assert_false(bd_scene_parents_are_a_forest(scene, &looping));
    struct bytes flat = flatten(scene);
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &fault), BD_ERR_BAD_INPUT);
    assert_string_equal(fault.field, "nodes");
    free(flat.data);
    bd_scene_release(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_survives),           cmocka_unit_test(every_cut_is_refused),
        cmocka_unit_test(changed_bytes_do_no_harm),   cmocka_unit_test(counts_are_not_believed),
        cmocka_unit_test(loops_of_nodes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
