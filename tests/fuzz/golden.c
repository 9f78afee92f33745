#include "tests/fuzz/golden.h"

#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/edit/edit.h"
#include "scene/store/store_journal.h"
#include "tests/fuzz/batch.h"
#include "tests/fuzz/machine.h"
#include "tests/journal/kit.h"
#include "tests/unit/scene/fields.h"

struct making {
    struct golden *golden;
    struct golden_scene *scene; // that is being edited
    struct bd_store *store;
    struct bd_journal *journal;
};

static void expect(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err) fprintf(stderr, "golden journal: %s: %s\n", detail->field, detail->message);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
}

// What is staged, to the disk and published.
static void keep(struct making *making)
{
    struct bd_err_detail detail = {0};
    const struct bd_batch *faulty;
    struct bd_batch *batch = bd_store_take_staged(making->store);
    BD_ASSERT(batch && !batch->next);
    expect(bd_store_write(making->journal, batch, &faulty, &detail), &detail);
    bd_store_publish(making->store, batch);
    if (batch->after) {
        making->scene->revision = batch->revision;
        BD_ASSERT_CMP(batch->revision, <, GOLDEN_REVISIONS_MAX);
        memcpy(making->scene->sha256[batch->revision], batch->after->content_sha256,
               BD_SHA256_BYTES);
    }
    bd_batch_free(&batch);
}

static void add_scene(struct making *making, int at, const char *name)
{
    struct bd_scene *scene = batch_small_scene();
    struct bd_err_detail detail = {0};
    struct bd_batch *batch;
    making->scene = &making->golden->scenes[at];
    expect(bd_store_stage_add(making->store, scene, name, "owner", &batch, &detail), &detail);
    memcpy(making->scene->id, batch->scene_id, sizeof making->scene->id);
    bd_scene_release(&scene);
    keep(making);
}

static const struct bd_scene *head_of(const struct making *making)
{
    const struct bd_scene *head;
    uint64_t revision;
    enum bd_err err = bd_store_head(making->store, making->scene->id, &head, &revision, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    return head;
}

// Takes the delta.
static void stage(struct making *making, enum bd_batch_kind kind, uint64_t of,
                  const char *client_edit_id, struct bd_delta *delta)
{
    struct bd_err_detail detail = {0};
    struct bd_batch *batch;
    const struct bd_store_change change = {.scene_id = making->scene->id,
                                           .kind = kind,
                                           .of = of,
                                           .client_edit_id = client_edit_id,
                                           .message = "why",
                                           .delta = delta};
    expect(bd_store_stage(making->store, &change, &batch, &detail), &detail);
    batch->answer = strdup("answer");
    batch->answer_bytes = 6;
    keep(making);
}

static void edit(struct making *making, const char *client_edit_id, const char *json)
{
    const struct batch_inputs inputs = {0};
    struct bd_err_detail detail = {0};
    struct bd_delta delta;
    Bounced__EditBatch *batch = batch_from_json((const uint8_t *)json, strlen(json));
    BD_ASSERT(batch);
    expect(batch_check(batch, &inputs, head_of(making), &delta, NULL, &detail), &detail);
    stage(making, BD_BATCH_EDIT, 0, client_edit_id, &delta);
    batch_free(batch);
}

static void go_back(struct making *making, bool redo)
{
    struct bd_err_detail detail = {0};
    struct bd_store_step step;
    uint64_t of;
    expect(bd_store_undo_target(making->store, making->scene->id, NULL, redo, &of, &detail),
           &detail);
    expect(
        bd_store_read_step(making->journal, making->scene->id, of, head_of(making), &step, &detail),
        &detail);
    stage(making, redo ? BD_BATCH_REDO : BD_BATCH_UNDO, of, "", &step.inverse);
    bd_store_step_finish(&step);
}

static void revert(struct making *making, uint64_t revision)
{
    struct bd_err_detail detail = {0};
    struct bd_scene *then;
    struct bd_delta delta;
    expect(bd_store_read_revision(making->journal, making->scene->id, revision, &then, &detail),
           &detail);
    bool made = bd_delta_between(head_of(making), then, &delta);
    BD_ASSERT(made);
    bd_scene_release(&then);
    stage(making, BD_BATCH_REVERT, revision, "", &delta);
}

static void name(struct making *making, const char *text, uint64_t revision)
{
    struct bd_err_detail detail = {0};
    struct bd_batch *batch;
    expect(bd_store_stage_name(making->store, making->scene->id, text, revision, false, &batch,
                               &detail),
           &detail);
    keep(making);
}

// What no batch in JSON can hold without files: a picture and a sky.
static void add_pictures(struct making *making)
{
    struct bd_picture *picture = calloc(1, sizeof *picture);
    struct bd_sky_map *sky = calloc(1, sizeof *sky);
    BD_ASSERT(picture && sky);
    *picture = (struct bd_picture){
        .reference_count = 1, .width_px = 2, .height_px = 2, .rgba = calloc(4, 4)};
    *sky = (struct bd_sky_map){
        .reference_count = 1, .width_px = 4, .height_px = 2, .rgb = calloc(24, sizeof(float))};
    BD_ASSERT(picture->rgba && sky->rgb);
    picture->rgba[0] = 200;
    sky->rgb[3] = 2;
    bd_picture_seal(picture);
    bd_sky_map_seal(sky);
    const struct bd_edit_op ops[] = {
        {.kind = BD_EDIT_ADD_TEXTURE, .picture = picture},
        {.kind = BD_EDIT_SET_MATERIAL, FIELDS(WHOLE(base_color_texture, BD_EDIT_ADDED(0)))},
        {.kind = BD_EDIT_SET_ENVIRONMENT, .environment = {.radiance = {1, 1, 1}, .map = sky}},
    };
    struct bd_err_detail detail = {0};
    struct bd_delta delta;
    expect(bd_edit_check(head_of(making), ops, sizeof ops / sizeof ops[0], &bd_edit_default_limits,
                         &delta, NULL, &detail),
           &detail);
    stage(making, BD_BATCH_EDIT, 0, "pictures", &delta);
    bd_picture_release(&picture);
    bd_sky_map_release(&sky);
}

static void write_history(struct making *making)
{
    struct bd_err_detail detail = {0};
    add_scene(making, 0, "first");
    edit(making, "bright", "{\"ops\":[{\"set_light\":{\"light\":0,\"intensity\":50}}]}");
    add_pictures(making);
    edit(making, "mesh",
         "{\"ops\":[{\"add_mesh\":{\"name\":\"new\",\"primitives\":[{\"material\":0,"
         "\"positions\":{\"values\":[0,0,0,0,1,0,0,0,1]}}]}},"
         "{\"add_node\":{\"name\":\"new\",\"parent\":0,\"mesh\":-2}}]}");
    go_back(making, false);
    go_back(making, true);
    name(making, "good", 3);
    expect(bd_store_snapshot(making->journal, making->scene->id, making->scene->revision,
                             head_of(making), &detail),
           &detail);
    edit(making, "moved",
         "{\"ops\":[{\"set_mesh_vertices\":{\"mesh\":2,\"positions\":{\"values\":"
         "[0,0,0,0,2,0,0,0,1]}}},{\"remove_node\":{\"id\":4}}]}");
    revert(making, 2);
    edit(making, "red", "{\"ops\":[{\"set_material\":{\"material\":0,\"roughness\":0.25}}]}");
    add_scene(making, 1, "second");
    edit(making, "sky", "{\"ops\":[{\"set_environment\":{\"radiance\":[1,2,3]}}]}");
}

static void make(struct golden *golden)
{
    struct bd_err_detail detail = {0};
    char directory[64];
    struct making making = {.golden = golden, .store = bd_store_create(4)};
    kit_make_directory(directory);
    expect(bd_journal_open(directory, &making.journal, &detail), &detail);
    write_history(&making);
    golden->logged = file_read(directory, BD_JOURNAL_FILE);
    golden->log = file_read(directory, BD_JOURNAL_FILE "-wal");
    bd_journal_close(&making.journal);
    golden->whole = file_read(directory, BD_JOURNAL_FILE);
    bd_store_destroy(&making.store);
    kit_remove_directory(directory);
}

const struct golden *golden_get(void)
{
    static struct golden golden;
    if (golden.whole.size > 0) return &golden;
    // SQLite's own chances are in the log's sums.
    sqlite3_initialize();
    sqlite3_test_control(SQLITE_TESTCTRL_PRNG_SEED, 1, (sqlite3 *)NULL);
    machine_freeze(true);
    machine_begin(1);
    make(&golden);
    machine_end();
    machine_freeze(false);
    BD_ASSERT(golden.whole.size > 0 && golden.log.size > 0);
    return &golden;
}
