// BD_ASSERT: our own bug. Alive in release builds; prints the expression, and both values for a
// comparison, then aborts. Never for anything that input or the machine can cause.

#ifndef BD_BASE_ASSERT_H
#define BD_BASE_ASSERT_H

#ifdef __cplusplus
extern "C" {
#endif

__attribute__((noreturn)) void bd_assert_fail(const char *file, int line, const char *expression);
__attribute__((noreturn)) void bd_assert_fail_cmp(const char *file, int line,
                                                  const char *expression, long long left,
                                                  long long right);

#define BD_ASSERT(expression)                                                                      \
    ((expression) ? (void)0 : bd_assert_fail(__FILE__, __LINE__, #expression))

// Integers only: BD_ASSERT_CMP(index, <, count).
#define BD_ASSERT_CMP(left, op, right)                                                             \
    (((left)op(right)) ? (void)0                                                                   \
                       : bd_assert_fail_cmp(__FILE__, __LINE__, #left " " #op " " #right,          \
                                            (long long)(left), (long long)(right)))

#ifdef __cplusplus
}
#endif

#endif
