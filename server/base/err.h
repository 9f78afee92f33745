// Errors that the world causes: what went wrong, and for whom to mend it.
//
// Our own bugs are not here: they are BD_ASSERT (base/assert.h). Less quality than asked is not
// here either: it is a flag in the frame's report. A function that can fail through the world's
// fault returns `enum bd_err` and must be checked. If a person will want to know more than the
// code says, it also takes a `struct bd_err_detail *` and fills it once, where the cause is known.

#ifndef BD_BASE_ERR_H
#define BD_BASE_ERR_H

#ifdef __cplusplus
extern "C" {
#endif

#define BD_MUST_CHECK __attribute__((warn_unused_result))
#define BD_PRINTF(format_index, first_arg) __attribute__((format(printf, format_index, first_arg)))

// X(NAME, name on the wire, exit code of `bounce`, HTTP status)
#define BD_ERR_MAP(X)                                                                              \
    X(OK, "ok", 0, 200)                                                                            \
    X(USAGE, "usage", 2, 400)               /* request makes no sense: unknown name, bad value */  \
    X(BAD_INPUT, "bad_input", 4, 400)       /* a scene or image that cannot be read */             \
    X(UNSUPPORTED, "unsupported", 4, 400)   /* understood, and not offered */                      \
    X(LIMIT, "limit", 4, 413)               /* a named limit was passed */                         \
    X(UNAUTHORIZED, "unauthorized", 7, 401) /* no token, or a wrong one */                         \
    X(FORBIDDEN, "forbidden", 7, 403)       /* known peer, not allowed */                          \
    X(NOT_FOUND, "not_found", 4, 404)                                                              \
    X(CONFLICT, "conflict", 4, 409)                                                                \
    X(BUSY, "busy", 5, 429)             /* queue or rate limit; try again */                       \
    X(DEADLINE, "deadline", 5, 504)     /* time or error budget missed */                          \
    X(CANCELLED, "cancelled", 130, 499) /* asked for by the client */                              \
    X(DEVICE, "device", 6, 503)         /* no such device, or it does not work */                  \
    X(DEVICE_LOST, "device_lost", 6, 503)                                                          \
    X(NO_MEMORY, "no_memory", 5, 507) /* host or GPU budget */                                     \
    X(UNREACHABLE, "unreachable", 7, 502)                                                          \
    X(DIFFERS, "differs", 1, 409)     /* images that should be alike are not */                    \
    X(NO_GOLDEN, "no_golden", 3, 404) /* nothing there to compare with */                          \
    X(IO, "io", 4, 500)                                                                            \
    X(INTERNAL, "internal", 7, 500)

enum bd_err {
#define X(name, wire, exit_code, http) BD_ERR_##name,
    BD_ERR_MAP(X)
#undef X
        BD_ERR_COUNT
};

// What an error was about, for a person: `field` is the JSON path, option or key at fault ("" if
// none), `message` one line without a final newline.
struct bd_err_detail {
    enum bd_err err;
    char field[128];
    char message[1216];
};

// The name on the wire, "bad_input"; never NULL.
const char *bd_err_name(enum bd_err err);
// The error of that wire name; BD_ERR_INTERNAL if there is none.
enum bd_err bd_err_from_name(const char *name);
int bd_err_exit_code(enum bd_err err);
int bd_err_http_status(enum bd_err err);

// Fills `detail` (which may be NULL) and returns `err`, so that it reads
// `return bd_err_set(detail, BD_ERR_LIMIT, "size", "...")`. The message, which may quote hostile
// input and is cut to its room, is made plain (base/text.h): always UTF-8, without control
// characters.
enum bd_err bd_err_set(struct bd_err_detail *detail, enum bd_err err, const char *field,
                       const char *format, ...) BD_PRINTF(4, 5);

#ifdef __cplusplus
}
#endif

#endif
