// BD_UNDER_SANITIZER: 1 if this is built with the address sanitizer, otherwise 0. It reserves
// terabytes of address space and slows the host down; limits and stopwatches must know.

#ifndef BD_BASE_SANITIZER_H
#define BD_BASE_SANITIZER_H

// gcc says it by a macro, clang by a feature.
#if defined(__SANITIZE_ADDRESS__)
#define BD_UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define BD_UNDER_SANITIZER 1
#endif
#endif
#ifndef BD_UNDER_SANITIZER
#define BD_UNDER_SANITIZER 0
#endif

#endif
