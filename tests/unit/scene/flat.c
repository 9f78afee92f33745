// The flat form: what is written is what is read, and nothing else is believed.

#include <stdio.h>
#include <sys/mman.h>

#include "base/hash.h"
#include "scene/model/content.h"
#include "scene/model/flat.h"
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
    struct bd_err_detail detail = {0};
    struct bytes first = flatten(scene);
    assert_int_equal(bd_flat_read(first.data, first.size, &again, &detail), BD_ERR_OK);
    struct bytes second = flatten(again);
    assert_int_equal(first.size, second.size);
    assert_memory_equal(first.data, second.data, first.size);
    assert_int_equal(bd_scene_finish(again, &detail), BD_ERR_OK);
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

// --- while it comes ---------------------------------------------------------------------------

static bool give(void *user, void *bytes, size_t size)
{
    struct bytes *left = user;
    if (size > left->size) return false;
    memcpy(bytes, left->data, size);
    left->data += size;
    left->size -= size;
    return true;
}

// More lights and primitives than there is room for at first.
static struct bd_scene *large_scene(uint32_t count)
{
    struct bd_scene *scene = rich_scene();
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    scene->lights = realloc(scene->lights, (count + 1) * sizeof *scene->lights);
    for (uint32_t i = 0; i < count; i++) scene->lights[1 + i] = scene->lights[0];
    scene->light_count = count + 1;
    mesh->reference_count = 1;
    mesh->primitive_count = count;
    mesh->primitives = calloc(count, sizeof *mesh->primitives);
    for (uint32_t i = 0; i < count; i++) {
        mesh->primitives[i].position = calloc(1, 4);
        mesh->primitives[i].normal = calloc(1, 4);
        mesh->primitives[i].index = calloc(1, 4);
    }
    bd_mesh_seal(mesh);
    bd_mesh_release(&scene->meshes[0]);
    scene->meshes[0] = mesh;
    return scene;
}

static void what_comes_is_what_was_written(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 1023, 1024, 1025, 5000};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        struct bd_scene *scene = large_scene(counts[i]), *again;
        struct bd_err_detail detail = {0};
        struct bytes first = flatten(scene), left = first;
        if (bd_flat_receive(give, &left, first.size, &again, &detail))
            fail_msg("%s", detail.message);
        struct bytes second = flatten(again);
        assert_int_equal(left.size, 0);
        assert_int_equal(first.size, second.size);
        assert_memory_equal(first.data, second.data, first.size);
        free(first.data);
        free(second.data);
        bd_scene_release(&scene);
        bd_scene_release(&again);
    }
}

// Every end that a dead child may make, and a promise of 2^31 pictures that costs nothing.
static void what_ends_early_is_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bytes whole = flatten(scene);
    struct bd_err_detail detail = {0};
    for (size_t cut = 0; cut < whole.size; cut++) {
        struct bytes left = {whole.data, cut, 0};
        assert_int_equal(bd_flat_receive(give, &left, 1ull << 40, &again, &detail),
                         BD_ERR_BAD_INPUT);
        assert_null(again);
    }
    memcpy(whole.data + 8, "\xff\xff\xff\x7f", 4);
    struct bytes left = whole;
    assert_int_equal(bd_flat_receive(give, &left, 1ull << 40, &again, &detail), BD_ERR_BAD_INPUT);
    free(whole.data);
    bd_scene_release(&scene);
}

// --- writing ---------------------------------------------------------------------------------

// The same bytes where nobody may store anything.
static void *frozen(const void *bytes, size_t size)
{
    void *copy = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_true(copy != MAP_FAILED);
    memcpy(copy, bytes, size);
    assert_int_equal(mprotect(copy, size, PROT_READ), 0);
    return copy;
}

#define FREEZE(items, count) ((items) = frozen(items, (count) * sizeof *(items)))

static struct bd_scene *freeze(const struct bd_scene *scene)
{
    struct bd_scene cold = *scene;
    assert_true(cold.mesh_count == 1 && cold.picture_count == 1);
    struct bd_mesh mesh = *cold.meshes[0];
    FREEZE(mesh.primitives, mesh.primitive_count);
    struct bd_mesh *meshes[] = {frozen(&mesh, sizeof mesh)};
    struct bd_picture *pictures[] = {frozen(cold.pictures[0], sizeof **cold.pictures)};
    cold.meshes = frozen(meshes, sizeof meshes);
    cold.pictures = frozen(pictures, sizeof pictures);
    FREEZE(cold.textures, cold.texture_count);
    FREEZE(cold.materials, cold.material_count);
    FREEZE(cold.lights, cold.light_count);
    FREEZE(cold.cameras, cold.camera_count);
    FREEZE(cold.nodes, cold.node_count);
    return frozen(&cold, sizeof cold);
}

// Other threads read the snapshot meanwhile: not even what stands there already is stored again.
static void writing_stores_nothing_in_the_scene(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene();
    const struct bd_scene *cold = freeze(scene);
    struct bytes first = flatten(scene), second = flatten(cold), index = {NULL, 0, SIZE_MAX};
    assert_int_equal(first.size, second.size);
    assert_memory_equal(first.data, second.data, first.size);
    assert_true(bd_flat_write_index(cold, collect, &index));
    free(first.data);
    free(second.data);
    free(index.data);
    bd_scene_release(&scene);
}

// --- reading ---------------------------------------------------------------------------------

static void every_cut_is_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bytes flat = flatten(scene);
    for (size_t size = 0; size < flat.size; size++) {
        uint8_t *cut = malloc(size ? size : 1); // its own block, so that ASan sees any overrun
        assert_non_null(cut);
        memcpy(cut, flat.data, size);
        struct bd_err_detail detail = {0};
        assert_int_equal(bd_flat_read(cut, size, &again, &detail), BD_ERR_BAD_INPUT);
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
        struct bd_err_detail detail = {0};
        if (bd_flat_read(copy.data, copy.size, &again, &detail) == BD_ERR_OK) {
            assert_int_equal(bd_scene_finish(again, &detail), BD_ERR_OK);
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
        uint8_t flat[128] = "BDFLAT03"; // then the number of pictures
        struct bd_scene *scene;
        struct bd_err_detail detail = {0};
        memcpy(flat + 8, &counts[i], sizeof counts[i]);
        assert_int_equal(bd_flat_read(flat, sizeof flat, &scene, &detail), BD_ERR_BAD_INPUT);
        assert_string_equal(detail.field, "pictures");
    }
}

static void loops_of_nodes_are_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bd_err_detail detail = {0};
    scene->nodes[0].parent = 1;
    uint32_t looping;
    assert_false(bd_scene_parents_are_a_forest(scene, &looping));
    struct bytes flat = flatten(scene);
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &detail), BD_ERR_BAD_INPUT);
    assert_string_equal(detail.field, "nodes");
    free(flat.data);
    bd_scene_release(&scene);
}

// --- index and content ----------------------------------------------------------------------

static struct bytes index_of(const struct bd_scene *scene)
{
    struct bytes out = {NULL, 0, SIZE_MAX};
    assert_true(bd_flat_write_index(scene, collect, &out));
    return out;
}

struct search {
    const uint8_t *wanted;
    struct bd_content *found;
};

static void compare(void *user, const struct bd_content *content)
{
    struct search *search = user;
    if (content->kind != search->found->kind || bd_content_sha256(search->found)) return;
    if (memcmp(bd_content_sha256(content), search->wanted, 32) == 0)
        *search->found = bd_content_retain(content);
}

// Looks in the scene that is `user`.
static bool find_in_scene(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    bd_content_of_scene(user, compare, &(struct search){sha256, out});
    return bd_content_sha256(out) != NULL;
}

static bool find_nothing(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    (void)user, (void)sha256, (void)out;
    return false;
}

static void an_index_names_what_is_heavy(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bd_err_detail detail = {0};
    bd_scene_set_hash(scene);
    struct bytes index = index_of(scene), whole = flatten(scene);
    assert_int_equal(
        bd_flat_read_index(index.data, index.size, find_in_scene, scene, &again, &detail),
        BD_ERR_OK);
    struct bytes whole_again = flatten(again);
    assert_int_equal(whole.size, whole_again.size);
    assert_memory_equal(whole.data, whole_again.data, whole.size);
    assert_memory_equal(scene->content_sha256, again->content_sha256, 32);
    uint8_t digest[32];
    bd_sha256_of(index.data, index.size, digest);
    assert_memory_equal(digest, scene->content_sha256, 32);
    assert_ptr_equal(again->pictures[0], scene->pictures[0]);
    assert_ptr_equal(again->meshes[0]->primitives[0].position,
                     scene->meshes[0]->primitives[0].position);
    bd_scene_release(&scene); // the streams live on with their alias
    assert_int_equal(bd_scene_finish(again, &detail), BD_ERR_OK);
    assert_int_equal(
        bd_flat_read_index(index.data, index.size, find_nothing, NULL, &scene, &detail),
        BD_ERR_NOT_FOUND);
    assert_string_equal(detail.field, "pictures");
    free(index.data), free(whole.data), free(whole_again.data);
    bd_scene_release(&again);
}

static void empty_slots_at_the_end_are_no_content(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bd_err_detail detail = {0};
    bd_scene_set_hash(scene);
    uint8_t before[32];
    memcpy(before, scene->content_sha256, sizeof before);
    scene->lights = realloc(scene->lights, 4 * sizeof *scene->lights);
    assert_non_null(scene->lights);
    scene->lights[1] = scene->lights[2] = (struct bd_light){.is_removed = true};
    scene->authored_light_count = 3;
    bd_scene_set_hash(scene);
    assert_memory_equal(before, scene->content_sha256, 32);
    // In the middle they count: the ids behind them have to stay.
    scene->lights[2] = scene->lights[0];
    bd_scene_set_hash(scene);
    assert_memory_not_equal(before, scene->content_sha256, 32);
    assert_int_equal(bd_scene_count(scene).lights, 2);
    struct bytes flat = flatten(scene);
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &detail), BD_ERR_OK);
    assert_int_equal(again->light_count, 3);
    assert_true(again->lights[1].is_removed && !again->lights[2].is_removed);
    free(flat.data);
    bd_scene_release(&again);
    scene->lights[0] = (struct bd_light){.is_removed = true}; // which node 1 holds
    flat = flatten(scene);
    assert_int_equal(bd_flat_read(flat.data, flat.size, &again, &detail), BD_ERR_BAD_INPUT);
    assert_string_equal(detail.field, "nodes[1].light");
    free(flat.data);
    bd_scene_release(&scene);
}

static void damaged_indices_are_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene(), *again;
    struct bytes index = index_of(scene);
    struct bd_err_detail detail = {0};
    for (size_t size = 0; size < index.size; size++) {
        uint8_t *cut = malloc(size ? size : 1);
        assert_non_null(cut);
        memcpy(cut, index.data, size);
        assert_int_not_equal(bd_flat_read_index(cut, size, find_in_scene, scene, &again, &detail),
                             BD_ERR_OK);
        free(cut);
    }
    unsigned read = 0;
    for (size_t bit = 0; bit < 8 * index.size; bit++) {
        index.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
        if (bd_flat_read_index(index.data, index.size, find_in_scene, scene, &again, &detail) ==
            BD_ERR_OK) {
            assert_memory_not_equal(again->content_sha256, scene->content_sha256, 32);
            assert_int_equal(bd_scene_finish(again, &detail), BD_ERR_OK);
            bd_scene_release(&again);
            read++;
        }
        index.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    assert_in_range(read, 1, 8 * index.size - 1);
    free(index.data);
    bd_scene_release(&scene);
}

static void content_survives(void *user, const struct bd_content *content)
{
    struct bytes bytes = {NULL, 0, SIZE_MAX};
    struct bd_content again;
    struct bd_err_detail detail = {0};
    uint8_t digest[32];
    assert_true(bd_content_write(content, collect, &bytes));
    bd_sha256_of(bytes.data, bytes.size, digest);
    assert_memory_equal(digest, bd_content_sha256(content), 32);
    assert_int_equal(bd_content_read(bytes.data, bytes.size, &again, &detail), BD_ERR_OK);
    assert_int_equal(again.kind, content->kind);
    assert_memory_equal(bd_content_sha256(&again), digest, 32);
    bd_content_release(&again);
    for (size_t size = 0; size < bytes.size; size++) {
        uint8_t *cut = malloc(size ? size : 1);
        assert_non_null(cut);
        memcpy(cut, bytes.data, size);
        assert_int_equal(bd_content_read(cut, size, &again, &detail), BD_ERR_BAD_INPUT);
        free(cut);
    }
    for (size_t bit = 0; bit < 8 * bytes.size; bit++) {
        bytes.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
        if (bd_content_read(bytes.data, bytes.size, &again, &detail) == BD_ERR_OK) {
            assert_memory_not_equal(bd_content_sha256(&again), digest, 32);
            bd_content_release(&again);
        }
        bytes.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    free(bytes.data);
    ++*(unsigned *)user;
}

static void content_is_named_by_its_bytes(void **state)
{
    (void)state;
    struct bd_scene *scene = rich_scene();
    struct bd_sky_map *map = calloc(1, sizeof *map);
    assert_non_null(map);
    *map = (struct bd_sky_map){.reference_count = 1, .width_px = 2, .height_px = 1};
    map->rgb = calloc(6, sizeof *map->rgb);
    assert_non_null(map->rgb);
    map->rgb[4] = 2;
    bd_sky_map_seal(map);
    scene->environment.map = map;
    unsigned count = 0;
    bd_content_of_scene(scene, content_survives, &count);
    assert_int_equal(count, 3);
    bd_scene_release(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_survives),
        cmocka_unit_test(what_comes_is_what_was_written),
        cmocka_unit_test(what_ends_early_is_refused),
        cmocka_unit_test(writing_stores_nothing_in_the_scene),
        cmocka_unit_test(every_cut_is_refused),
        cmocka_unit_test(changed_bytes_do_no_harm),
        cmocka_unit_test(counts_are_not_believed),
        cmocka_unit_test(loops_of_nodes_are_refused),
        cmocka_unit_test(an_index_names_what_is_heavy),
        cmocka_unit_test(empty_slots_at_the_end_are_no_content),
        cmocka_unit_test(damaged_indices_are_refused),
        cmocka_unit_test(content_is_named_by_its_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
