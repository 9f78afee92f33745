#include "clients/cli/feed.h"

#include <ctype.h>
#include <errno.h>
#include <string.h>
#include <unistd.h>

static enum bd_err read_more(struct bd_cli_feed *feed, struct bd_err_detail *detail)
{
    enum bd_err err = bd_cli_conn_wait_for_input(feed->conn, feed->fd, detail);
    if (err) return err;
    ssize_t got = read(feed->fd, feed->bytes, sizeof feed->bytes);
    if (got < 0 && errno != EINTR && errno != EAGAIN)
        return bd_err_set(detail, BD_ERR_IO, "", "%.200s: %s", feed->name, strerror(errno));
    feed->has_ended = got == 0;
    feed->taken = 0;
    feed->used = got > 0 ? (size_t)got : 0;
    return BD_ERR_OK;
}

// True if there is a byte to be taken.
static bool has_byte(struct bd_cli_feed *feed)
{
    while (feed->taken == feed->used && !feed->has_ended && !feed->err)
        feed->err = read_more(feed, &feed->detail);
    return feed->taken < feed->used;
}

static enum bd_err outcome(const struct bd_cli_feed *feed, struct bd_err_detail *detail)
{
    if (feed->err) *detail = feed->detail;
    return feed->err;
}

enum bd_err bd_cli_feed_at_end(struct bd_cli_feed *feed, bool *out, struct bd_err_detail *detail)
{
    while (has_byte(feed) && isspace(feed->bytes[feed->taken])) feed->taken++;
    *out = feed->taken == feed->used;
    return outcome(feed, detail);
}

// A byte at a time: what lies behind the document is the next one's.
static size_t take_byte(void *buffer, size_t size, void *user)
{
    struct bd_cli_feed *feed = user;
    if (size == 0 || !has_byte(feed)) return 0;
    *(unsigned char *)buffer = feed->bytes[feed->taken++];
    return 1;
}

enum bd_err bd_cli_feed_next(struct bd_cli_feed *feed, json_t **out, json_error_t *error,
                             struct bd_err_detail *detail)
{
    *out =
        json_load_callback(take_byte, feed, JSON_DISABLE_EOF_CHECK | JSON_REJECT_DUPLICATES, error);
    return outcome(feed, detail);
}
