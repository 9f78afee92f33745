// Files as bytes, for tests that change them.

#ifndef BD_TESTS_JOURNAL_FILES_H
#define BD_TESTS_JOURNAL_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct file_bytes {
    uint8_t *data; // for free()
    size_t size;
};

// NULL and 0 if there is no such file.
struct file_bytes file_read(const char *directory, const char *name);
void file_write(const char *directory, const char *name, const void *data, size_t size);
bool file_exists(const char *directory, const char *name);
// Every file of the directory goes.
void files_remove(const char *directory);

#endif
