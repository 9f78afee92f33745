#include "net/live/watch.h"

#include <stdio.h>
#include <string.h>

#include "base/hash.h"
#include "net/access/auth.h"
#include "net/live/view.h"

enum bd_err bd_watch_begin(struct bd_watch *watch, struct bd_live *live, const char *scene,
                           struct bd_err_detail *detail)
{
    const struct bd_store_entry *entry = NULL;
    if (scene && scene[0]) {
        enum bd_err err = bd_store_get(live->loop->serving->store, scene, &entry, detail);
        if (!err && !bd_grant_covers(watch->grant, entry->name))
            err =
                bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.64s\"", scene);
        if (err) return err;
    }
    watch->live = live;
    snprintf(watch->scene_id, sizeof watch->scene_id, "%s", entry ? entry->id : "");
    watch->previous = NULL;
    watch->next = live->watches;
    if (watch->next) watch->next->previous = watch;
    live->watches = watch;
    return BD_ERR_OK;
}

void bd_watch_end(struct bd_watch *watch)
{
    if (watch->previous)
        watch->previous->next = watch->next;
    else
        watch->live->watches = watch->next;
    if (watch->next) watch->next->previous = watch->previous;
}

static bool hears(const struct bd_watch *watch, const struct bd_store_entry *entry)
{
    if (watch->scene_id[0] && strcmp(watch->scene_id, entry->id) != 0) return false;
    return bd_grant_covers(watch->grant, entry->name);
}

#define CHANGES_TOLD 16

// Entries as the log has them, and pointers to them for the event.
struct changes {
    char entries[CHANGES_TOLD][BD_DELTA_ENTRY_BYTES];
    char *list[CHANGES_TOLD];
};

static void tell_changes(Bounced__SceneEvent *event, const struct bd_delta *delta,
                         struct changes *changes)
{
    if (!delta) return;
    event->n_changes = bd_delta_describe(delta, changes->entries, CHANGES_TOLD);
    event->changes = changes->list;
    for (size_t i = 0; i < event->n_changes; i++) changes->list[i] = changes->entries[i];
}

static char *read_only(const char *text)
{
    return text && text[0] ? (char *)(uintptr_t)text : NULL;
}

static void tell_origin(Bounced__SceneEvent *event, const struct bd_live_change *change)
{
    event->kind = read_only(change->kind);
    event->author = read_only(change->author);
    event->batch = read_only(change->batch);
    event->has_of = change->of > 0;
    event->of = change->of;
}

void bd_live_changed(struct bd_live *live, const char *scene_id,
                     const struct bd_live_change *change)
{
    struct changes changes;
    const struct bd_store_entry *entry;
    if (bd_store_get(live->loop->serving->store, scene_id, &entry, NULL)) return;
    char id[BD_SCENE_ID_BYTES], hash[8 + BD_SHA256_HEX] = "sha256:";
    snprintf(id, sizeof id, "%s", entry->id);
    bd_sha256_hex(entry->scene->content_sha256, hash + 7);
    Bounced__SceneEvent event = BOUNCED__SCENE_EVENT__INIT;
    event.scene = id;
    tell_origin(&event, change);
    event.has_revision = 1;
    event.revision = entry->revision;
    event.hash = hash;
    event.has_transient = entry->transient > 0;
    event.transient = entry->transient;
    tell_changes(&event, change->delta, &changes);
    for (struct bd_watch *watch = live->watches; watch;) {
        struct bd_watch *next = watch->next;
        if (hears(watch, entry)) watch->event(watch->user, &event);
        watch = next;
    }
    bd_views_scene_changed(live, id, strcmp(change->kind, "removed") == 0);
}
