// BD_UNDER_SANITIZER: 1 if this is built with the address or the thread sanitizer, otherwise 0. They
// reserve terabytes of address space and slow the host down; limits and stopwatches must know.
// BD_UNDER_THREAD_SANITIZER: the same of that one alone, which keeps several bytes for each.

#ifndef BD_BASE_SANITIZER_H
#define BD_BASE_SANITIZER_H

// gcc says it by a macro, clang by a feature.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define BD_UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define BD_UNDER_SANITIZER 1
#endif
#endif
#ifndef BD_UNDER_SANITIZER
#define BD_UNDER_SANITIZER 0
#endif

#if defined(__SANITIZE_THREAD__)
#define BD_UNDER_THREAD_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define BD_UNDER_THREAD_SANITIZER 1
#endif
#endif
#ifndef BD_UNDER_THREAD_SANITIZER
#define BD_UNDER_THREAD_SANITIZER 0
#endif

#endif
