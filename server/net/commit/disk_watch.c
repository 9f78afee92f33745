#include "net/commit/disk_watch.h"

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/commit/commits.h"
#include "scene/blobs/blobs.h"
#include "scene/journal/journal.h"

#define COLLECT_SECONDS 600

#define MOVED "the data directory is not where it was: moved, removed or replaced"

static uint64_t collect_every_ns(uint64_t blob_seconds)
{
    const uint64_t every_s =
        blob_seconds / 4 < COLLECT_SECONDS ? blob_seconds / 4 : COLLECT_SECONDS;
    return every_s * 1000000000ull;
}

static void look(uv_work_t *work)
{
    struct bd_commits *commits = work->data;
    atomic_store(&commits->disk.began_ns, bd_clock_ns());
    commits->disk.found = bd_journal_is_in_place(commits->loop->serving->journal);
    atomic_store(&commits->disk.began_ns, 0);
    atomic_store(&commits->disk.is_answered, true);
    if (bd_clock_ns() < commits->disk.collect_ns) return;
    const uint64_t seconds = commits->disk.blob_seconds;
    uint32_t count = bd_blobs_collect(commits->loop->serving->blobs, seconds);
    if (count) bd_log(BD_LOG_INFO, "net", "%u blobs were not used any more", count);
    commits->disk.collect_ns = bd_clock_ns() + collect_every_ns(seconds);
}

static void look_back(uv_work_t *work, int status)
{
    struct bd_commits *commits = work->data;
    struct bd_disk_watch *disk = &commits->disk;
    BD_ASSERT_CMP(status, ==, 0);
    disk->is_looking = false;
    if (disk->found == disk->is_in_place) return;
    disk->is_in_place = disk->found;
    if (disk->found)
        bd_log(BD_LOG_INFO, "net", "the data directory is back: edits are kept again");
    else
        bd_log(BD_LOG_ERROR, "net", MOVED "; edits are refused");
}

static void on_timer(uv_timer_t *timer)
{
    struct bd_commits *commits = timer->data;
    struct bd_disk_watch *disk = &commits->disk;
    if (disk->is_looking) return;
    disk->is_looking = true;
    disk->blob_seconds = commits->loop->serving->limits.blob_seconds;
    bd_blobs_set_reserve(commits->loop->serving->blobs,
                         commits->loop->serving->limits.disk_reserve_bytes);
    disk->asked_ns = bd_clock_ns();
    atomic_store(&disk->is_answered, false);
    int result = uv_queue_work(&commits->loop->uv, &disk->work, look, look_back);
    BD_ASSERT_CMP(result, ==, 0);
}

void bd_disk_watch_begin(struct bd_commits *commits)
{
    struct bd_disk_watch *disk = &commits->disk;
    uv_timer_init(&commits->loop->uv, &disk->timer);
    disk->timer.data = disk->work.data = commits;
    disk->is_in_place = true;
    atomic_init(&disk->began_ns, 0);
    atomic_init(&disk->is_answered, true);
    bd_blobs_set_reserve(commits->loop->serving->blobs,
                         commits->loop->serving->limits.disk_reserve_bytes);
    uv_timer_start(&disk->timer, on_timer, BD_DISK_WATCH_MS, BD_DISK_WATCH_MS);
}

void bd_disk_watch_close(struct bd_commits *commits)
{
    uv_close((uv_handle_t *)&commits->disk.timer, NULL);
}

const char *bd_disk_watch_trouble(const struct bd_commits *commits)
{
    const struct bd_disk_watch *disk = &commits->disk;
    if (!disk->is_in_place) return MOVED;
    const uint64_t now_ns = bd_clock_ns(), began_ns = atomic_load(&disk->began_ns);
    const bool is_silent = began_ns && now_ns - began_ns > BD_DISK_SILENT_MS * 1000000ull;
    // All threads that could look wait for something: for the same disk, if it takes that long.
    const bool is_crowded = disk->is_looking && !atomic_load(&disk->is_answered) &&
                            now_ns - disk->asked_ns > BD_DISK_CROWDED_MS * 1000000ull;
    return is_silent || is_crowded ? "the disk of the data directory does not answer" : NULL;
}
