// A disk in memory that can lose power and can fail, under SQLite.
//
// What is written lies in a cache until it is synced. When the power goes, each write that was not
// synced is kept, dropped or torn at sectors, at random by seed; so are truncations, and the names
// of files that were made or deleted since the directory was last synced. A sync that fails leaves
// the cache as it is and the disk with a random part of it, and a later sync does not bring the
// rest: so do real systems.
//
// It promises SQLite what its own VFS for Unix does, a power-safe overwrite (bytes beside a torn
// write stay), and has no shared memory, so that a log that needs some cannot be opened on it.
//
// Thread: one. There is one disk.

#ifndef BD_TESTS_JOURNAL_POWERCUT_VFS_H
#define BD_TESTS_JOURNAL_POWERCUT_VFS_H

#include <stdbool.h>
#include <stdint.h>

// A directory of the disk; on the machine's own there should be none of that name.
#define DISK_DIRECTORY "/nowhere/on/this/machine"

enum disk_detail { DISK_FAULT_NONE, DISK_FAULT_IO, DISK_FAULT_FULL };

// The default VFS of this process from now on.
void disk_register(void);

// An empty disk whose chances come from `seed`.
void disk_format(uint64_t seed);

// The power goes at the `at`th call from now that changes the disk (from 1; 0: never), or at the
// first sync from there: every call fails from there on.
void disk_cut_power_at(uint64_t at, bool waits_for_sync);
void disk_cut_power(void);
bool disk_has_power(void);
// Power is back. No file may be open.
void disk_restore_power(void);

// Calls fail from the `at`th from now on, `count` of them (0: until told otherwise). A full disk
// fails those that write or sync; one with faults any of them.
void disk_fail_at(enum disk_detail detail, uint64_t at, uint64_t count);
// How many calls disk_fail_at counted since, failed ones too.
uint64_t disk_call_count(void);
uint64_t disk_failed_count(void);
// How many calls disk_cut_power_at would count since the format.
uint64_t disk_change_count(void);

// Turns over one bit of a file as it lies on the disk. False if it is not that long.
bool disk_flip_bit(const char *name_end, uint64_t byte, int bit);
// Somebody deletes a file. False if there is none, or nothing in it.
bool disk_lose_file(const char *name_end);
uint64_t disk_file_size(const char *name_end);

#endif
