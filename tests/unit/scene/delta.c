// Deltas: taken, applied, inverted, merged, written and read.

#include <stddef.h>

#include "tests/unit/scene/snapshots.h"

static const char *own_scenes;

static struct bd_scene *two_lights(void)
{
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    assert_non_null(scene);
    return scene;
}

static struct bd_scene *applied(const struct bd_scene *base, const struct bd_delta *delta)
{
    struct bd_scene *out;
    struct bd_err_detail detail = {0};
    if (bd_delta_apply(base, delta, &out, &detail) != BD_ERR_OK)
        fail_msg("%s: %s", detail.field, detail.message);
    assert_as_from_scratch(out);
    return out;
}

static struct bd_delta of(const struct bd_scene *scene, enum bd_object_kind kind, uint32_t id)
{
    struct bd_delta delta = {0};
    assert_true(bd_delta_take(&delta, scene, kind, id));
    return delta;
}

static void an_inverse_gives_back_the_hash(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta delta = of(scene, BD_OBJECT_LIGHT, 0), inverse;
    delta.changes[0].light.intensity *= 2;
    // A new light far behind the last: the slots between are empty.
    assert_true(bd_delta_take(&delta, scene, BD_OBJECT_LIGHT, 5));
    delta.changes[1].light = scene->lights[0];
    assert_true(bd_delta_invert(scene, &delta, &inverse));
    struct bd_scene *changed = applied(scene, &delta), *back = applied(changed, &inverse);
    assert_memory_not_equal(scene->content_sha256, changed->content_sha256, 32);
    assert_memory_equal(scene->content_sha256, back->content_sha256, 32);
    assert_int_equal(bd_scene_count(changed).lights, bd_scene_count(scene).lights + 1);
    assert_int_equal(changed->lights[0].intensity, 2 * scene->lights[0].intensity);
    assert_int_equal(back->authored_light_count, 6); // no id comes twice
    assert_ptr_equal(back->meshes[0], scene->meshes[0]);
    bd_delta_finish(&delta), bd_delta_finish(&inverse);
    bd_scene_release(&scene), bd_scene_release(&changed), bd_scene_release(&back);
}

static void a_merge_does_both(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta first = of(scene, BD_OBJECT_LIGHT, 0), second = of(scene, BD_OBJECT_LIGHT, 0);
    struct bd_delta both;
    first.changes[0].light.intensity = 3;
    assert_true(bd_delta_take(&first, scene, BD_OBJECT_MATERIAL, 0));
    assert_int_equal(first.changes[0].kind, BD_OBJECT_MATERIAL); // smaller ones first
    first.changes[0].material.roughness = 0.25f;
    second.changes[0].light.intensity = 7;
    assert_true(bd_delta_take(&second, scene, BD_OBJECT_NODE, 1));
    second.changes[1].node.is_hidden = true;
    assert_true(bd_delta_merge(&first, &second, &both));
    assert_int_equal(both.count, 3);
    struct bd_scene *one = applied(scene, &first), *two = applied(one, &second);
    struct bd_scene *at_once = applied(scene, &both);
    assert_memory_equal(two->content_sha256, at_once->content_sha256, 32);
    assert_true(at_once->lights[0].intensity == 7 && at_once->materials[0].roughness == 0.25f);
    bd_delta_finish(&first), bd_delta_finish(&second), bd_delta_finish(&both);
    bd_scene_release(&one), bd_scene_release(&two), bd_scene_release(&at_once);
    bd_scene_release(&scene);
}

// --- carried over ---------------------------------------------------------------------------

static size_t state_bytes(enum bd_object_kind kind)
{
    switch (kind) {
    case BD_OBJECT_TEXTURE:
        return sizeof(struct bd_texture);
    case BD_OBJECT_MATERIAL:
        return sizeof(struct bd_material);
    case BD_OBJECT_LIGHT:
        return sizeof(struct bd_light);
    case BD_OBJECT_CAMERA:
        return sizeof(struct bd_camera);
    case BD_OBJECT_NODE:
        return sizeof(struct bd_node);
    default: // what is behind pointers is no byte of ours
        return kind == BD_OBJECT_ENVIRONMENT ? sizeof(float[3]) : 0;
    }
}

// What cannot be written, an enum beyond its values or a name beyond its end, is no state.
static bool is_written_alike(const struct bd_delta *a, const struct bd_delta *b)
{
    struct bytes one = {0}, other = {0};
    const bool written = bd_delta_write(a, collect, &one) && bd_delta_write(b, collect, &other);
    bool same = !written || (one.size == other.size && memcmp(one.data, other.data, one.size) == 0);
    free(one.data), free(other.data);
    return same;
}

// Every byte that a file or a journal sees belongs to some property. A field that is new and no
// property would be lost by an undo.
static void every_field_is_a_property(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    const size_t at = offsetof(struct bd_change, light);
    size_t seen = 0;
    for (int k = 0; k < BD_OBJECT_KIND_COUNT; k++) {
        const enum bd_object_kind kind = (enum bd_object_kind)k;
        for (size_t i = 0; i < state_bytes(kind); i++) {
            struct bd_delta before = of(scene, kind, 0), after = of(scene, kind, 0), out = {0};
            struct bd_clash clash = {0};
            ((unsigned char *)after.changes)[at + i] ^= 1;
            bool removes =
                bd_change_is_removal(&after.changes[0]) != bd_change_is_removal(&before.changes[0]);
            if (!removes && !is_written_alike(&before, &after)) {
                seen++;
                assert_true(bd_delta_carry(scene, &before, &after, &out, &clash));
                assert_false(clash.is_there);
                if (!is_written_alike(&out, &after))
                    fail_msg("byte %zu of %s is no property", i, bd_object_kind_name(kind));
            }
            bd_delta_finish(&before), bd_delta_finish(&after), bd_delta_finish(&out);
        }
    }
    assert_true(seen > 200);
    bd_scene_release(&scene);
}

static void what_others_changed_stays(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta mine = of(scene, BD_OBJECT_LIGHT, 0), theirs = of(scene, BD_OBJECT_LIGHT, 0);
    struct bd_delta inverse, undo = {0};
    struct bd_clash clash = {0};
    mine.changes[0].light.intensity *= 2;
    assert_true(bd_delta_invert(scene, &mine, &inverse));
    struct bd_scene *first = applied(scene, &mine);
    theirs.changes[0].light = first->lights[0];
    theirs.changes[0].light.color[1] = 0.125f;
    struct bd_scene *second = applied(first, &theirs);
    assert_true(bd_delta_carry(second, &mine, &inverse, &undo, &clash));
    assert_false(clash.is_there);
    struct bd_scene *third = applied(second, &undo);
    assert_true(third->lights[0].intensity == scene->lights[0].intensity);
    assert_true(third->lights[0].color[1] == 0.125f);
    bd_delta_finish(&undo);
    // The same property: said, and taken all the same, for who wants it so.
    theirs.changes[0].light.intensity = 77;
    struct bd_scene *fourth = applied(second, &theirs);
    assert_true(bd_delta_carry(fourth, &mine, &inverse, &undo, &clash));
    assert_true(clash.is_there && clash.kind == BD_OBJECT_LIGHT && clash.id == 0);
    assert_string_equal(clash.property, "intensity");
    assert_true(undo.changes[0].light.intensity == scene->lights[0].intensity);
    assert_true(bd_delta_touches(&mine, &theirs, &clash));
    clash.property = "cone";
    assert_false(bd_delta_touches(&mine, &theirs, &clash));
    bd_delta_finish(&mine), bd_delta_finish(&theirs), bd_delta_finish(&inverse);
    bd_delta_finish(&undo);
    bd_scene_release(&scene), bd_scene_release(&first), bd_scene_release(&second);
    bd_scene_release(&third), bd_scene_release(&fourth);
}

static void what_is_gone_stays_gone(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta add = {0}, inverse, out = {0};
    struct bd_clash clash = {0};
    assert_true(bd_delta_take(&add, scene, BD_OBJECT_LIGHT, 9));
    add.changes[0].light = scene->lights[0];
    assert_true(bd_delta_invert(scene, &add, &inverse));
    struct bd_scene *added = applied(scene, &add);
    struct bd_delta dim = of(added, BD_OBJECT_LIGHT, 9);
    dim.changes[0].light.intensity = 1;
    struct bd_scene *dimmed = applied(added, &dim);
    // To take back the addition of what somebody dimmed since.
    assert_true(bd_delta_carry(dimmed, &add, &inverse, &out, &clash));
    assert_true(clash.is_there && clash.property == bd_clash_whole);
    bd_delta_finish(&out);
    // To take back the dimming of what somebody removed since.
    clash = (struct bd_clash){0};
    assert_true(bd_delta_carry(scene, &dim, &add, &out, &clash));
    assert_true(clash.is_there && bd_change_is_removal(&out.changes[0]));
    bd_delta_finish(&out);
    // Nobody touched it: gone.
    clash = (struct bd_clash){0};
    assert_true(bd_delta_carry(added, &add, &inverse, &out, &clash));
    assert_true(!clash.is_there && bd_change_is_removal(&out.changes[0]));
    bd_delta_finish(&out), bd_delta_finish(&add), bd_delta_finish(&inverse), bd_delta_finish(&dim);
    bd_scene_release(&scene), bd_scene_release(&added), bd_scene_release(&dimmed);
}

static void what_is_not_there_is_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights(), *out;
    struct bd_err_detail detail = {0};
    struct bd_delta delta = of(scene, BD_OBJECT_NODE, 0);
    delta.changes[0].node.light = 99;
    assert_int_equal(bd_delta_apply(scene, &delta, &out, &detail), BD_ERR_BAD_INPUT);
    assert_null(out);
    assert_string_equal(detail.field, "nodes[0].light");
    delta.changes[0].node = scene->nodes[0];
    delta.changes[0].node.parent = 0;
    assert_int_equal(bd_delta_apply(scene, &delta, &out, &detail), BD_ERR_BAD_INPUT);
    assert_string_equal(detail.field, "nodes");
    delta.changes[0].id = BD_OBJECT_ID_END;
    assert_int_equal(bd_delta_apply(scene, &delta, &out, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "node");
    bd_delta_finish(&delta);
    bd_scene_release(&scene);
}

// --- bytes ----------------------------------------------------------------------------------

// One change of every kind.
static struct bd_delta of_everything(struct bd_scene *scene)
{
    struct bd_delta delta = {0};
    for (int kind = 0; kind < BD_OBJECT_KIND_COUNT; kind++)
        for (uint32_t id = 0; id < (kind == BD_OBJECT_ENVIRONMENT ? 1 : 3); id++)
            assert_true(bd_delta_take(&delta, scene, (enum bd_object_kind)kind, id));
    return delta;
}

static struct bytes bytes_of(const struct bd_delta *delta)
{
    struct bytes out = {0};
    assert_true(bd_delta_write(delta, collect, &out));
    return out;
}

static void what_is_written_is_read(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "checker.glb");
    struct shelf shelf = {0};
    struct bd_err_detail detail = {0};
    struct bd_delta delta = of_everything(scene), again;
    bd_content_of_delta(&delta, keep_content, &shelf);
    assert_true(shelf.count >= 2); // a mesh and a picture
    struct bytes bytes = bytes_of(&delta);
    assert_int_equal(bd_delta_read(bytes.data, bytes.size, find_on_shelf, &shelf, &again, &detail),
                     BD_ERR_OK);
    struct bytes twice = bytes_of(&again);
    assert_int_equal(bytes.size, twice.size);
    assert_memory_equal(bytes.data, twice.data, bytes.size);
    bd_delta_finish(&again);
    clear_shelf(&shelf);
    assert_int_equal(bd_delta_read(bytes.data, bytes.size, find_on_shelf, &shelf, &again, &detail),
                     BD_ERR_NOT_FOUND);
    assert_string_equal(detail.field, "picture");
    free(bytes.data), free(twice.data);
    bd_delta_finish(&delta);
    bd_scene_release(&scene);
}

static void try_damaged(const struct bd_scene *scene, struct shelf *shelf, const uint8_t *data,
                        size_t size, unsigned *read)
{
    struct bd_err_detail detail = {0};
    struct bd_delta delta;
    uint8_t *own = malloc(size ? size : 1); // its own block, so that ASan sees any overrun
    assert_non_null(own);
    memcpy(own, data, size);
    if (bd_delta_read(own, size, find_on_shelf, shelf, &delta, &detail) == BD_ERR_OK) {
        struct bd_scene *out;
        ++*read;
        // Ids of four millions are legal; tests have better things to do.
        bool small = true;
        for (uint32_t i = 0; i < delta.count; i++) small &= delta.changes[i].id < 1000;
        if (small && bd_delta_apply(scene, &delta, &out, &detail) == BD_ERR_OK)
            bd_scene_release(&out);
        bd_delta_finish(&delta);
    } else {
        assert_int_equal(delta.count, 0);
        assert_true(detail.field[0] && detail.message[0]);
    }
    free(own);
}

static void damaged_bytes_are_refused(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "checker.glb");
    struct shelf shelf = {0};
    struct bd_delta delta = of_everything(scene);
    bd_content_of_delta(&delta, keep_content, &shelf);
    struct bytes bytes = bytes_of(&delta);
    unsigned read = 0;
    for (size_t size = 0; size < bytes.size; size++)
        try_damaged(scene, &shelf, bytes.data, size, &read);
    assert_int_equal(read, 0);
    for (size_t bit = 0; bit < 8 * bytes.size; bit++) {
        bytes.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
        try_damaged(scene, &shelf, bytes.data, bytes.size, &read);
        bytes.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    assert_in_range(read, 100, 8 * bytes.size);
    free(bytes.data);
    bd_delta_finish(&delta);
    clear_shelf(&shelf);
    bd_scene_release(&scene);
}

static void counts_are_not_believed(void **state)
{
    (void)state;
    static const uint32_t counts[] = {0xffffffff, 0x7fffffff, 1000, 1};
    struct shelf empty = {0};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        uint8_t bytes[64] = "BDDELT01";
        struct bd_delta delta;
        struct bd_err_detail detail = {0};
        memcpy(bytes + 8, &counts[i], sizeof counts[i]);
        assert_int_equal(bd_delta_read(bytes, sizeof bytes, find_on_shelf, &empty, &delta, &detail),
                         BD_ERR_NOT_FOUND);
        assert_int_equal(bd_delta_read(bytes, 12, find_on_shelf, &empty, &delta, &detail),
                         BD_ERR_BAD_INPUT);
    }
}

// --- aspects --------------------------------------------------------------------------------

static unsigned changed_aspects(const struct bd_scene *a, const struct bd_scene *b)
{
    unsigned changed = 0;
    for (int i = 0; i < BD_ASPECT_COUNT; i++)
        changed |= (unsigned)(a->aspects.counter[i] != b->aspects.counter[i]) << i;
    return changed;
}

static int32_t node_of(const struct bd_scene *scene, enum bd_object_kind kind)
{
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct bd_node *node = &scene->nodes[i];
        if ((kind == BD_OBJECT_MESH    ? node->mesh
             : kind == BD_OBJECT_LIGHT ? node->light
                                       : node->camera) != BD_NONE)
            return (int32_t)i;
    }
    fail_msg("no node has a %s", bd_object_kind_name(kind));
    return BD_NONE;
}

static void assert_changes(const struct bd_scene *scene, struct bd_delta *delta, unsigned aspects)
{
    struct bd_scene *out = applied(scene, delta);
    assert_int_equal(changed_aspects(scene, out), aspects);
    bd_delta_finish(delta);
    bd_scene_release(&out);
}

static void moved(const struct bd_scene *scene, enum bd_object_kind what, double by_m,
                  unsigned aspects)
{
    struct bd_delta delta = of(scene, BD_OBJECT_NODE, (uint32_t)node_of(scene, what));
    delta.changes[0].node.parent_from_node.m[13] += by_m;
    assert_changes(scene, &delta, aspects);
}

static void aspects_follow_what_is_derived(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta delta = {0};
    assert_changes(scene, &delta, 0);
    moved(scene, BD_OBJECT_LIGHT, 0.01, BD_ASPECT_BIT(LIGHTS));
    moved(scene, BD_OBJECT_CAMERA, 0.01, BD_ASPECT_BIT(CAMERAS));
    moved(scene, BD_OBJECT_MESH, 0.01, BD_ASPECT_BIT(TRANSFORMS));

    delta = of(scene, BD_OBJECT_LIGHT, 0);
    delta.changes[0].light.intensity *= 2;
    assert_changes(scene, &delta, BD_ASPECT_BIT(LIGHTS));
    delta = of(scene, BD_OBJECT_LIGHT, 0);
    strcpy(delta.changes[0].light.name, "other");
    assert_changes(scene, &delta, 0);
    delta = of(scene, BD_OBJECT_CAMERA, 0);
    delta.changes[0].camera.yfov *= 0.5f;
    assert_changes(scene, &delta, BD_ASPECT_BIT(CAMERAS));
    delta = of(scene, BD_OBJECT_ENVIRONMENT, 0);
    delta.changes[0].environment.radiance[1] = 2;
    assert_changes(scene, &delta, BD_ASPECT_BIT(ENVIRONMENT));

    uint32_t used = (uint32_t)scene->meshes[scene->instances[0].mesh]->primitives[0].material;
    delta = of(scene, BD_OBJECT_MATERIAL, used);
    delta.changes[0].material.roughness = 0.125f;
    assert_changes(scene, &delta, BD_ASPECT_BIT(ROUGHNESS));
    delta = of(scene, BD_OBJECT_MATERIAL, used);
    strcpy(delta.changes[0].material.name, "other");
    assert_changes(scene, &delta, 0);
    delta = of(scene, BD_OBJECT_MATERIAL, scene->material_count); // that nothing shows
    delta.changes[0].material = scene->materials[used];
    assert_changes(scene, &delta, 0);
    bd_scene_release(&scene);
}

static unsigned changed_by_material(const struct bd_scene *scene, uint32_t id,
                                    const struct bd_material *material)
{
    struct bd_delta delta = of(scene, BD_OBJECT_MATERIAL, id);
    delta.changes[0].material = *material;
    struct bd_scene *out = applied(scene, &delta);
    const unsigned changed = changed_aspects(scene, out);
    bd_delta_finish(&delta);
    bd_scene_release(&out);
    return changed;
}

static void each_group_of_a_material_by_itself(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    const uint32_t id = (uint32_t)scene->meshes[scene->instances[0].mesh]->primitives[0].material;
    const struct bd_material was = scene->materials[id];
    assert_int_equal(was.alpha_mode, BD_ALPHA_OPAQUE);
    struct bd_material now = was;
    now.base_color[1] /= 2;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(COLOUR));
    now = was, now.metallic = 0.375f;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(METALNESS));
    now = was, now.emissive[2] += 1;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(EMISSION));
    now = was, now.ior = 1.75f;
    assert_int_equal(changed_by_material(scene, id, &now),
                     BD_ASPECT_BIT(ROUGHNESS) | BD_ASPECT_BIT(MEDIUM));
    now = was, now.double_sided = !was.double_sided;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(SIDES));
    // Of an opaque material alpha is no matter.
    now = was, now.base_color[3] = 0.25f, now.alpha_cutoff = 0.75f;
    assert_int_equal(changed_by_material(scene, id, &now), 0);
    now.alpha_mode = BD_ALPHA_MASK;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(ALPHA));
    bd_scene_release(&scene);
}

// A field that is new and in no group would be shown as it was.
static void every_field_of_a_material_is_in_a_group(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    const uint32_t id = (uint32_t)scene->meshes[scene->instances[0].mesh]->primitives[0].material;
    struct bd_delta mask = of(scene, BD_OBJECT_MATERIAL, id);
    mask.changes[0].material.alpha_mode = BD_ALPHA_MASK;
    struct bd_scene *masked = applied(scene, &mask);
    size_t seen = 0;
    for (size_t i = sizeof masked->materials->name;
         i < offsetof(struct bd_material, base_color_map); i++) {
        struct bd_delta before = of(masked, BD_OBJECT_MATERIAL, id);
        struct bd_delta after = of(masked, BD_OBJECT_MATERIAL, id);
        struct bd_material *now = &after.changes[0].material;
        ((unsigned char *)now)[i] ^= 1;
        if (now->is_removed == masked->materials[id].is_removed &&
            !is_written_alike(&before, &after)) {
            seen++;
            if (changed_by_material(masked, id, now) == 0)
                fail_msg("byte %zu of a material is in no group", i);
        }
        bd_delta_finish(&before), bd_delta_finish(&after);
    }
    assert_true(seen > 50);
    bd_delta_finish(&mask);
    bd_scene_release(&masked);
    bd_scene_release(&scene);
}

static void every_map_of_a_material_is_in_a_group(void **state)
{
    (void)state;
    struct bd_scene *scene = load(own_scenes, "checker.glb");
    const uint32_t id = (uint32_t)scene->meshes[scene->instances[0].mesh]->primitives[0].material;
    const struct bd_material was = scene->materials[id];
    const struct bd_texture_ref map = was.base_color_map;
    assert_int_not_equal(map.texture, BD_NONE);
    struct bd_material now = was;
    now.base_color_map.texture = BD_NONE;
    assert_int_equal(changed_by_material(scene, id, &now),
                     BD_ASPECT_BIT(COLOUR) | BD_ASPECT_BIT(ALPHA)); // it is masked
    now = was, now.metallic_roughness_map = map;
    assert_int_equal(changed_by_material(scene, id, &now),
                     BD_ASPECT_BIT(METALNESS) | BD_ASPECT_BIT(ROUGHNESS));
    now = was, now.emissive_map = map;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(EMISSION));
    now = was, now.transmission_map = map;
    assert_int_equal(changed_by_material(scene, id, &now), BD_ASPECT_BIT(MEDIUM));
    now = was, now.normal_map = map;
    assert_true(changed_by_material(scene, id, &now) & BD_ASPECT_BIT(NORMALS));
    bd_scene_release(&scene);
}

// The default camera frames the scene, and the default lights stand at the camera.
static void a_default_rig_follows(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta delta = {0};
    for (uint32_t i = 0; i < scene->node_count; i++) {
        if (scene->nodes[i].light == BD_NONE && scene->nodes[i].camera == BD_NONE) continue;
        assert_true(bd_delta_take(&delta, scene, BD_OBJECT_NODE, i));
        delta.changes[delta.count - 1].node.is_hidden = true;
    }
    struct bd_scene *bare = applied(scene, &delta);
    bd_delta_finish(&delta);
    assert_int_equal(bare->placed_light_count, 2);
    assert_int_equal(bare->light_count, bare->authored_light_count + 2);
    moved(bare, BD_OBJECT_MESH, 50,
          BD_ASPECT_BIT(TRANSFORMS) | BD_ASPECT_BIT(LIGHTS) | BD_ASPECT_BIT(CAMERAS));
    delta = of(bare, BD_OBJECT_LIGHT, 0);
    delta.changes[0].light.intensity *= 2; // hidden: the rig stays, to the last bit
    assert_changes(bare, &delta, 0);
    bd_scene_release(&bare);
    bd_scene_release(&scene);
}

static void a_log_entry_names_the_objects(void **state)
{
    (void)state;
    struct bd_scene *scene = two_lights();
    struct bd_delta delta = of(scene, BD_OBJECT_NODE, 999);
    char entries[3][BD_DELTA_ENTRY_BYTES];
    assert_true(bd_delta_take(&delta, scene, BD_OBJECT_LIGHT, 0));
    assert_true(bd_delta_take(&delta, scene, BD_OBJECT_ENVIRONMENT, 0));
    assert_int_equal(bd_delta_describe(&delta, entries, 3), 3);
    assert_string_equal(entries[0], "light 0");
    assert_string_equal(entries[1], "node 999 removed");
    assert_string_equal(entries[2], "environment");
    assert_int_equal(bd_delta_describe(&delta, entries, 2), 2);
    assert_string_equal(entries[1], "and 2 more");
    bd_delta_finish(&delta);
    bd_scene_release(&scene);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_inverse_gives_back_the_hash),
        cmocka_unit_test(a_merge_does_both),
        cmocka_unit_test(what_is_not_there_is_refused),
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(damaged_bytes_are_refused),
        cmocka_unit_test(counts_are_not_believed),
        cmocka_unit_test(aspects_follow_what_is_derived),
        cmocka_unit_test(each_group_of_a_material_by_itself),
        cmocka_unit_test(every_field_of_a_material_is_in_a_group),
        cmocka_unit_test(every_map_of_a_material_is_in_a_group),
        cmocka_unit_test(a_default_rig_follows),
        cmocka_unit_test(a_log_entry_names_the_objects),
        cmocka_unit_test(every_field_is_a_property),
        cmocka_unit_test(what_others_changed_stays),
        cmocka_unit_test(what_is_gone_stays_gone),
    };
    if (argc < 2) return 2;
    own_scenes = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
