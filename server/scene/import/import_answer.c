#include "scene/import/import_answer.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "scene/import/import_pipe.h"

void bd_import_answer_begin(struct bd_import_answer *answer, int fd, uint64_t start_ns,
                            uint32_t wall_seconds, uint64_t most_bytes)
{
    memset(answer, 0, offsetof(struct bd_import_answer, buffer));
    answer->fd = fd;
    answer->start_ns = start_ns;
    answer->wall_seconds = wall_seconds;
    answer->bytes_left = most_bytes;
}

static bool over(struct bd_import_answer *answer, enum bd_import_verdict verdict)
{
    answer->verdict = verdict;
    return false;
}

static bool wait_readable(const struct bd_import_answer *answer)
{
    for (;;) {
        double left_ms = 1e3 * answer->wall_seconds - bd_ms_since(answer->start_ns);
        if (left_ms <= 0) return false;
        struct pollfd poll_fd = {.fd = answer->fd, .events = POLLIN};
        int ready = poll(&poll_fd, 1, left_ms > 1e6 ? 1000000 : (int)left_ms + 1);
        if (ready > 0) return true;
        if (ready < 0 && errno != EINTR) return false;
    }
}

static bool read_some(struct bd_import_answer *answer, void *bytes, size_t size, size_t *got)
{
    for (;;) {
        if (!wait_readable(answer)) return over(answer, BD_IMPORT_LATE);
        ssize_t count = read(answer->fd, bytes, size);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return over(answer, BD_IMPORT_CUT);
        *got = (size_t)count;
        return true;
    }
}

// What is large goes where it belongs without a stop in the buffer.
static bool read_exactly(struct bd_import_answer *answer, void *bytes, size_t size)
{
    uint8_t *to = bytes;
    while (size > 0) {
        size_t got = answer->filled - answer->at;
        if (got > 0) {
            if (got > size) got = size;
            memcpy(to, answer->buffer + answer->at, got);
            answer->at += got;
        } else if (size >= sizeof answer->buffer) {
            if (!read_some(answer, to, size, &got)) return false;
        } else {
            answer->at = answer->filled = 0;
            if (!read_some(answer, answer->buffer, sizeof answer->buffer, &answer->filled))
                return false;
            continue;
        }
        to += got;
        size -= got;
    }
    return true;
}

static bool read_err(struct bd_import_answer *answer, uint64_t size_bytes)
{
    struct bd_err_detail *detail = &answer->detail;
    if (size_bytes != sizeof *detail) return over(answer, BD_IMPORT_DAMAGED);
    if (!read_exactly(answer, detail, sizeof *detail)) return false;
    detail->field[sizeof detail->field - 1] = 0;
    detail->message[sizeof detail->message - 1] = 0;
    const unsigned err = (unsigned)detail->err;
    const bool is_one = err != BD_ERR_OK && err < BD_ERR_COUNT;
    return over(answer, is_one ? BD_IMPORT_REFUSED : BD_IMPORT_DAMAGED);
}

// The next piece of the body; false at its end, whichever that is.
static bool next_piece(struct bd_import_answer *answer)
{
    struct bd_import_piece piece;
    if (!read_exactly(answer, &piece, sizeof piece)) return false;
    if (piece.magic != BD_IMPORT_PIECE_MAGIC) return over(answer, BD_IMPORT_DAMAGED);
    switch (piece.kind) {
    case BD_IMPORT_BODY:
        if (piece.size_bytes > answer->bytes_left) return over(answer, BD_IMPORT_LONG);
        answer->bytes_left -= piece.size_bytes;
        answer->piece_left = piece.size_bytes;
        answer->has_body = true;
        return true;
    case BD_IMPORT_END:
        return over(answer, piece.size_bytes ? BD_IMPORT_DAMAGED : BD_IMPORT_WHOLE);
    case BD_IMPORT_FAULT:
        return read_err(answer, piece.size_bytes);
    default:
        return over(answer, BD_IMPORT_DAMAGED);
    }
}

bool bd_import_answer_body(void *user, void *bytes, size_t size)
{
    struct bd_import_answer *answer = user;
    uint8_t *to = bytes;
    while (answer->verdict == BD_IMPORT_OPEN && size > 0) {
        if (answer->piece_left == 0) {
            if (!next_piece(answer)) return false;
            continue;
        }
        const size_t part = size < answer->piece_left ? size : (size_t)answer->piece_left;
        if (!read_exactly(answer, to, part)) return false;
        answer->piece_left -= part;
        to += part;
        size -= part;
    }
    return size == 0;
}

void bd_import_answer_end(struct bd_import_answer *answer)
{
    uint8_t more;
    if (bd_import_answer_body(answer, &more, 1)) answer->verdict = BD_IMPORT_DAMAGED;
}
